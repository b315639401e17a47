!> Redistributes the bodies over the ranks with their full state, and decides when this is necessary.
!>
!> A redistribution takes place in the middle of a step, when the bodies have the positions of the next pair search.
!> Afterwards each rank has its own bodies, the halo (copies of nearby bodies of other ranks) and all fixed bodies, in
!> ascending order of global index. The pair list is rebuilt from scratch, and the contact history of the pairs is
!> restored. At the start of a run the bodies of a rank are anywhere; the first redistribution gives each rank its own.
module polydem_redistribution
   use polydem_bodies, only: bodies_t, piece_identifiers, turn_bodies
   use polydem_box_images, only: box_images_t
   use polydem_boxes_within, only: have_boxes_within
   use polydem_communicator, only: communicator_t
   use polydem_contact_history, only: contact_history_t
   use polydem_domain, only: domain_t
   use polydem_errors, only: error_t
   use polydem_halo, only: new_halo
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_local_data, only: rebuild_local_data
   use polydem_motion_tests, only: greatest_displacement
   use polydem_packed_bodies, only: packed_bodies_t, all_to_all_bodies, copy_packed, join_packed
   use polydem_packed_history, only: pack_pairs, packed_history_t, receive_pairs, send_pairs, slots_of_pair
   use polydem_packed_state, only: join_state, pack_state, packed_state_t, send_state, unpack_state
   use polydem_pair_list, only: pair_list_t
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
      have_boxes_left = .not. have_boxes_within(self%search%maker, self%bodies%free, self%search%boxes, &
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
      call self%domain%follow_cell(self%bodies%cell)
      if (self%domain%last_step < 0_lp) then
         call choose_first_margin(self%comm, self%bodies, self%dt, self%domain)
      else
         call self%domain%adapt_margin(self%step)
      end if
      ! When the bodies have just been replaced, there are no pairs that tell the work of a rank.
      if (self%domain%last_step < 0_lp .or. allocated(self%domain%reference)) call balance_work( &
         self%comm, self%step, self%bodies, self%search%neighbours%pairs, &
         real(sum(self%timers%total(work_stages)), dp), &
         self%domain)
      call migrate(self, error)
   end subroutine redistribute

   !> Choose the margin of the first redistribution from the speeds of the free bodies. Collective.
   subroutine choose_first_margin(comm, bodies, dt, domain)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Time step [s]
      real(wp), intent(in) :: dt
      type(domain_t), intent(inout) :: domain
      real(wp) :: move
      real(dp) :: greatest(1)
      integer(ip) :: slot

      call greatest_displacement(bodies, bodies%free, dt, move, slot)
      greatest = real(move, dp)
      call comm%all_reduce_max(greatest)
      call domain%choose_margin(real(greatest(1), wp))
   end subroutine choose_first_margin

   !> Partition space again if the work of the ranks is uneven.
   subroutine balance_work(comm, step, bodies, pairs, seconds, domain)
      class(communicator_t), intent(inout) :: comm
      !> Number of the step
      integer(lp), intent(in) :: step
      type(bodies_t), intent(in) :: bodies
      !> Pairs of the last step
      type(pair_list_t), intent(in) :: pairs
      !> Time spent so far in the stages that depend on the bodies [s]
      real(dp), intent(in) :: seconds
      type(domain_t), intent(inout) :: domain
      real(dp), allocatable :: weight(:)

      weight = work_of_bodies(bodies, pairs%n, pairs%first, pairs%second)
      if (needs_repartition(domain, comm, step, weight, seconds)) &
         call divide(domain, comm, step, bodies, weight, seconds)
   end subroutine balance_work

   !> Restore the contact history of pairs after a redistribution, a restart or a replacement of bodies. A no-op
   !> otherwise.
   subroutine restore_history(received, bodies, pairs, history)
      !> History that was received; not allocated on return
      type(packed_history_t), allocatable, intent(inout) :: received
      type(bodies_t), intent(in) :: bodies
      !> Pairs directly after their search; known ones did not begin
      type(pair_list_t), intent(inout) :: pairs
      !> History of these pairs
      type(contact_history_t), intent(inout) :: history
      integer(ip) :: n_known

      if (.not. allocated(received)) return
      call receive_pairs(received, pairs%n, pairs%first, pairs%second, piece_identifiers(bodies), history, n_known)
      pairs%n_began = pairs%n_began - n_known
      pairs%n_ended = pairs%n_ended + size(received%key, kind=ip) - n_known
      deallocate (received)
   end subroutine restore_history

   !> Migrate all bodies to their owners in the present partition, and rebuild the halo.
   subroutine migrate(self, error)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      type(packed_boxes_t) :: own
      integer(ip), allocatable :: owner(:)
      integer(ip) :: k

      owner = owners_of(self%domain, self%bodies)
      call send_history(self%comm, self%bodies, self%search%neighbours%pairs, self%history, owner, &
                        self%received_history)
      call send_bodies(self, owner, own)
      call receive_halo(self, own)
      call self%domain%halo%follow(self%comm, self%bodies)
      call turn_bodies(self%bodies, [(k, k=1_ip, self%bodies%n)])
      call rebuild_local_data(self, error, self%domain%median_diameter)
      call self%comm%all_reduce_error(error)
      if (allocated(error)) return
      call measure_halo(self%comm, self%search%maker%images, self%bodies%n_all, self%domain)
      call self%domain%set_reference(self%search%boxes%bounds(:, :self%search%boxes%n), self%step)
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
   subroutine send_history(comm, bodies, pairs, history, owner, received)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      !> History of these pairs
      type(contact_history_t), intent(in) :: history
      !> Rank that owns each body from now on, negative for fixed bodies, (slot)
      integer(ip), intent(in) :: owner(:)
      !> On entry history that no pair has yet, if there is any; on return that of the pairs of this rank
      type(packed_history_t), allocatable, intent(inout) :: received
      integer(ip), allocatable :: slots(:, :), id(:)
      integer(ip) :: p

      id = piece_identifiers(bodies)
      if (allocated(received)) then
         allocate (slots(2, size(received%key)))
         do p = 1_ip, size(slots, 2, kind=ip)
            slots(:, p) = bodies%pieces%bodies_of(slots_of_pair(id, received%key(p)))
         end do
      else
         allocate (received, slots(2, pairs%n))
         call pack_pairs(pairs%n, pairs%first, pairs%second, id, history, received)
         slots(1, :) = bodies%pieces%bodies_of(pairs%first(:pairs%n))
         slots(2, :) = bodies%pieces%bodies_of(pairs%second(:pairs%n))
      end if
      call send_pairs(comm, slots, merge(-1_ip, owner, bodies%in_halo), received)
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
      call self%domain%shrink_zone()
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
   subroutine measure_halo(comm, images, n_all, domain)
      class(communicator_t), intent(inout) :: comm
      type(box_images_t), intent(in) :: images
      !> Number of bodies of the run
      integer(ip), intent(in) :: n_all
      type(domain_t), intent(inout) :: domain
      integer(lp) :: n_halo(1)

      n_halo = size(domain%halo%slots, kind=lp)
      if (allocated(images%source)) n_halo = n_halo + size(images%source, kind=lp)
      call comm%all_reduce_sum(n_halo)
      domain%halo_share = real(n_halo(1), wp)/real(n_all, wp)
   end subroutine measure_halo

end module polydem_redistribution
