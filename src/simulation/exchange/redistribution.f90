!> Redistributes the bodies over the ranks with their full state, and decides when this is necessary.
!>
!> A redistribution takes place in the middle of a step, when the bodies have the positions of the next pair search.
!> Afterwards each rank has its own bodies, the halo (copies of nearby bodies of other ranks) and all fixed bodies, in
!> ascending order of global index. The pair list is rebuilt from scratch, and the contact history of the pairs is
!> restored. At the start of a run the bodies of a rank are anywhere; the first redistribution gives each rank its own.
module polydem_redistribution
   use polydem_bodies, only: piece_identifiers, turn_bodies
   use polydem_boxes_within, only: have_boxes_within
   use polydem_errors, only: error_t
   use polydem_motion_check, only: greatest_displacement
   use polydem_halo, only: new_halo
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_local_data, only: rebuild_local_data
   use polydem_packed_bodies, only: packed_bodies_t, all_to_all_bodies, copy_packed, join_packed
   use polydem_packed_history, only: pack_pairs, receive_pairs, send_pairs, slots_of_pair
   use polydem_packed_state, only: join_state, pack_state, packed_state_t, send_state, unpack_state
   use polydem_rank_order, only: sort_by_rank
   use polydem_redistribution_plan, only: divide, needs_repartition, list_needed, owners_of, padded_boxes, &
      work_of_bodies
   use polydem_simulation, only: simulation_t
   use polydem_timers, only: stage_boxes, stage_forces, stage_integrate, stage_neighbours, stage_overlap
   implicit none
   private
   public :: redistribute, have_boxes_left, restore_history

   !> Packed bodies with their boxes
   type, extends(packed_state_t) :: packed_boxes_t
      !> Indices of the free bodies
      integer(ip), allocatable :: free(:)
      !> Their padded boxes: xmin, ymin, xmax, ymax, (4, free body) [m]
      real(wp), allocatable :: boxes(:, :)
   end type packed_boxes_t

   !> Stages whose time is proportional to the work for the bodies of a rank
   integer, parameter :: work_stages(*) = [stage_boxes, stage_neighbours, stage_overlap, stage_forces, stage_integrate]

contains

   !> Whether a box of a free body is outside both the zone of this rank and its padded box of the last redistribution.
   !> A step finds this out while it updates the boxes.
   pure logical function have_boxes_left(self)
      !> The simulation with updated boxes
      type(simulation_t), intent(in) :: self

      have_boxes_left = .false.
      if (.not. allocated(self%domain%reference)) return
      have_boxes_left = .not. have_boxes_within(self%maker, self%bodies%free, self%boxes, &
                                                self%domain%rank_bounds%zone, self%domain%reference)
   end function have_boxes_left

   !> Exchange errors between ranks, and redistribute the bodies if any rank requests it. Collective.
   subroutine redistribute(self, has_left, error)
      !> The simulation in the middle of a step, with the boxes of this step
      type(simulation_t), intent(inout) :: self
      !> Whether a box has left the zone of this rank and its padded box, as in `have_boxes_left`
      logical, intent(in) :: has_left
      !> On entry the error of this rank, if any; on return the same on all ranks
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: request(1)

      if (.not. self%domain%has_zone()) return
      request = 0_lp
      if (.not. allocated(error)) then
         if (self%domain%must_redistribute(self%step, has_left)) request = 1_lp
      end if
      call self%comm%all_reduce_error(error, request)
      if (allocated(error) .or. request(1) == 0_lp) return
      if (self%domain%last_step < 0_lp) then
         call choose_first_margin(self)
      else
         call self%domain%adapt_margin(self%step)
      end if
      ! When the bodies have just been replaced, there are no pairs that tell the work of a rank.
      if (self%domain%last_step < 0_lp .or. allocated(self%domain%reference)) call balance_work(self)
      call migrate(self, error)
   end subroutine redistribute

   !> Choose the margin of the first redistribution from the speeds of the free bodies. Collective.
   subroutine choose_first_margin(self)
      type(simulation_t), intent(inout) :: self
      real(wp) :: move
      real(dp) :: greatest(1)
      integer(ip) :: slot

      call greatest_displacement(self%bodies, self%bodies%free, self%dt, move, slot)
      greatest = real(move, dp)
      call self%comm%all_reduce_max(greatest)
      call self%domain%choose_margin(real(greatest(1), wp))
   end subroutine choose_first_margin

   !> Partition space again if the work of the ranks is uneven.
   subroutine balance_work(self)
      type(simulation_t), intent(inout) :: self
      real(dp), allocatable :: weight(:)
      real(dp) :: seconds

      associate (pairs => self%neighbours%pairs)
         weight = work_of_bodies(self%bodies, pairs%n, pairs%first, pairs%second)
      end associate
      seconds = work_seconds(self)
      if (needs_repartition(self%domain, self%comm, self%step, weight, seconds)) &
         call divide(self%domain, self%comm, self%step, self%bodies, weight, seconds)
   end subroutine balance_work

   !> Restore the contact history of pairs after a redistribution, a restart or a replacement of bodies. A no-op
   !> otherwise.
   subroutine restore_history(self)
      !> The simulation, directly after the pair search
      type(simulation_t), intent(inout) :: self
      integer(ip) :: n_known

      if (.not. allocated(self%received_history)) return
      associate (pairs => self%neighbours%pairs)
         call receive_pairs(self%received_history, pairs%n, pairs%first, pairs%second, &
                            piece_identifiers(self%bodies), self%history, n_known)
         pairs%n_began = pairs%n_began - n_known
         pairs%n_ended = pairs%n_ended + size(self%received_history%key, kind=ip) - n_known
      end associate
      deallocate (self%received_history)
   end subroutine restore_history

   !> Time spent so far in the stages that depend on the bodies [s]
   pure real(dp) function work_seconds(self)
      type(simulation_t), intent(in) :: self

      work_seconds = sum(self%timers%total(work_stages))
   end function work_seconds

   !> Migrate all bodies to their owners in the present partition, and rebuild the halo.
   subroutine migrate(self, error)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      type(packed_boxes_t) :: own
      integer(ip), allocatable :: owner(:)
      integer(ip) :: k

      owner = owners_of(self%domain, self%bodies)
      call send_history(self, owner)
      call send_bodies(self, owner, own)
      call receive_halo(self, own)
      call self%domain%halo%follow(self%comm, self%bodies)
      call turn_bodies(self%bodies, [(k, k=1_ip, self%bodies%n)])
      call rebuild_local_data(self, error, self%domain%median_diameter)
      call self%comm%all_reduce_error(error)
      if (allocated(error)) return
      call measure_halo(self)
      call self%domain%set_reference(self%boxes%bounds(:, :self%boxes%n), self%step)
      associate (domain => self%domain)
         domain%redistributions = domain%redistributions + 1_lp
         if (domain%redistributions > 1_lp) return
         domain%first_migrations = domain%arrivals
         domain%first_messages = self%comm%messages
         domain%first_bytes = self%comm%bytes
      end associate
   end subroutine migrate

   !> Send the contact history of all pairs to the next owners of their bodies. The history that a restart has read
   !> belongs to pairs that are not found yet, and so does that of a replacement of bodies.
   subroutine send_history(self, owner)
      type(simulation_t), intent(inout) :: self
      integer(ip), intent(in) :: owner(:)
      integer(ip), allocatable :: slots(:, :), id(:)
      integer(ip) :: p

      associate (pairs => self%neighbours%pairs, bodies => self%bodies)
         id = piece_identifiers(bodies)
         if (allocated(self%received_history)) then
            allocate (slots(2, size(self%received_history%key)))
            do p = 1_ip, size(slots, 2, kind=ip)
               slots(:, p) = bodies%pieces%bodies_of(slots_of_pair(id, self%received_history%key(p)))
            end do
         else
            allocate (self%received_history, slots(2, pairs%n))
            call pack_pairs(pairs%n, pairs%first, pairs%second, id, self%history, self%received_history)
            slots(1, :) = bodies%pieces%bodies_of(pairs%first(:pairs%n))
            slots(2, :) = bodies%pieces%bodies_of(pairs%second(:pairs%n))
         end if
         call send_pairs(self%comm, slots, merge(-1_ip, owner, bodies%in_halo), self%received_history)
      end associate
   end subroutine send_history

   !> Pack the bodies that stay on this rank, send the others to their owners, and join those that arrive. Fixed bodies
   !> stay on all ranks.
   subroutine send_bodies(self, owner, own)
      type(simulation_t), intent(inout) :: self
      !> Rank that owns each body from now on, negative for fixed bodies, (slot)
      integer(ip), intent(in) :: owner(:)
      !> The bodies that this rank owns from now on, and its fixed bodies
      type(packed_boxes_t), intent(out) :: own
      type(packed_boxes_t) :: other
      real(wp), allocatable :: boxes(:, :)
      integer(ip), allocatable :: slots(:), counts(:), counts_received(:), order(:)
      integer(ip) :: s, k

      associate (bodies => self%bodies, comm => self%comm)
         call turn_bodies(bodies, bodies%free)
         slots = pack(bodies%free, owner(bodies%free) /= comm%rank)
         call sort_by_rank(owner(slots), comm%size, counts, order)
         call pack_boxes(self, slots(order), 0_ip, other)
         call send_state(comm, counts, other%packed_state_t, counts_received)
         call comm%all_to_all(other%boxes, counts, boxes, counts_received)
         call move_alloc(boxes, other%boxes)
         other%free = [(k, k=1_ip, sum(counts_received))]
         self%domain%arrivals = self%domain%arrivals + int(sum(counts_received), lp)

         slots = pack([(s, s=1_ip, bodies%n)], bodies%fixed .or. (owner == comm%rank .and. .not. bodies%in_halo))
         call pack_boxes(self, slots, sum(counts_received) + 2_ip*count(bodies%in_halo, kind=ip), own)
      end associate
      own%free = [own%free, own%columns%n_rows + other%free]
      own%boxes = reshape([own%boxes, other%boxes], [4, size(own%free)])
      call join_state(own%packed_state_t, other%packed_state_t)
   end subroutine send_bodies

   !> Pack bodies of this rank with their state and boxes.
   subroutine pack_boxes(self, slots, room, packed)
      type(simulation_t), intent(inout) :: self
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Number of bodies to join later, for which memory is reserved
      integer(ip), intent(in) :: room
      !> The packed bodies, in the order of the slots
      type(packed_boxes_t), intent(out) :: packed
      integer(ip) :: k

      call pack_state(self, slots, room, packed%packed_state_t)
      packed%free = pack([(k, k=1_ip, size(slots, kind=ip))],.not. self%bodies%fixed(slots))
      packed%boxes = padded_boxes(self%bodies, slots(packed%free), self%domain%margin + self%settings%boxes%margin)
   end subroutine pack_boxes

   !> Publish the bounds of the bodies of this rank, receive the nearby bodies of other ranks as the halo, and unpack
   !> all of them.
   subroutine receive_halo(self, own)
      type(simulation_t), intent(inout) :: self
      !> The bodies that this rank owns, and its fixed bodies; afterwards with the halo
      type(packed_boxes_t), intent(inout) :: own
      type(packed_bodies_t) :: halo
      integer(ip), allocatable :: sent(:), counts(:), counts_received(:), slots(:)
      integer(ip) :: s, n

      call self%domain%rank_bounds%publish(self%comm, own%boxes, self%domain%period, &
                                           self%bodies%cell%is_sheared)
      call list_needed(self%domain, self%comm, own%boxes, sent, counts)
      sent = own%free(sent)
      call copy_packed(own%bodies, sent, halo)
      call all_to_all_bodies(self%comm, counts, halo, counts_received)
      call join_packed(own%bodies, halo)
      call unpack_state(self, own%packed_state_t, slots)
      n = own%columns%n_rows
      self%bodies%in_halo(slots(n + 1_ip:)) = .true.
      self%bodies%free = pack([(s, s=1_ip, self%bodies%n)],.not. (self%bodies%fixed .or. self%bodies%in_halo))
      call new_halo(self%domain%halo, self%bodies%free, counts, slots(sent), counts_received, slots(n + 1_ip:), &
                    self%law%needs_accelerations)
   end subroutine receive_halo

   !> Measure what the margin costs in each step: halo bodies, and images of boxes. Collective.
   subroutine measure_halo(self)
      type(simulation_t), intent(inout) :: self
      integer(lp) :: n_halo(1)

      n_halo = size(self%domain%halo%slots, kind=lp)
      if (allocated(self%maker%images%source)) n_halo = n_halo + size(self%maker%images%source, kind=lp)
      call self%comm%all_reduce_sum(n_halo)
      self%domain%halo_share = real(n_halo(1), wp)/real(self%bodies%n_all, wp)
   end subroutine measure_halo

end module polydem_redistribution
