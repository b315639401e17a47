!> Handing bodies out to processes anew: when, and how all that is known of them goes along.
!>
!> It happens in the middle of a step, when bodies are where they will be when pairs are sought. Then every process has
!> its own bodies, those of others near them (ghosts) and all fixed ones, in ascending order; pairs are found from
!> nothing and get back what was remembered of them. At the start the leader has all bodies; so the first step begins
!> the run of all.
module polydem_settle
   use polydem_archive, only: archive_t
   use polydem_bodies, only: turn_bodies
   use polydem_errors, only: error_t
   use polydem_freight, only: freight_t, join_freights, load, trade_freight, unload
   use polydem_ghosts, only: new_ghosts
   use polydem_kept_bodies, only: keep_bodies
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ledger, only: keep_books
   use polydem_mover, only: mover_t
   use polydem_pair_freight, only: receive_pairs, send_pairs
   use polydem_rank_order, only: sort_by_rank
   use polydem_simulation_parts, only: fit_to_bodies, simulation_t
   use polydem_timers, only: stage_boxes, stage_forces, stage_integrate, stage_neighbours, stage_overlap
   implicit none
   private
   public :: settle, recall_pairs

   !> Stages whose time is work that follows the bodies
   integer, parameter :: work_stages(*) = [stage_boxes, stage_neighbours, stage_overlap, stage_forces, stage_integrate]
   !> Steps after a division before work is compared again
   integer(lp), parameter :: patience = 100_lp
   !> Work for a body without pairs, in pairs
   real(dp), parameter :: base_weight = 2.0_dp
   !> Room for rounding around a body, as a share of its extent
   real(wp), parameter :: rounding = 1024.0_wp*epsilon(1.0_wp)

contains

   !> Agree with the others whether all goes well and whether bodies have to be handed out anew, and do it.
   subroutine settle(self, error)
      !> The simulation in the middle of a step, with the boxes of this step
      type(simulation_t), intent(inout) :: self
      !> A failure of this process; afterwards that of any
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: wish(1)

      if (self%team%size == 1_ip) return
      wish = 0_lp
      if (.not. allocated(error)) then
         associate (n => self%boxes%n)
            if (self%domain%must_settle(self%boxes%bounds(:, :n), self%boxes%passive(:n))) wish = 1_lp
         end associate
      end if
      call self%team%agree(error, wish)
      if (allocated(error) .or. wish(1) == 0_lp) return
      call self%domain%adapt_margin(self%step)
      if (is_uneven(self)) call divide(self)
      call hand_out(self, error)
   end subroutine settle

   !> Give the pairs that were found anew what was remembered of them.
   subroutine recall_pairs(self)
      !> The simulation, whose list of pairs has just been made
      type(simulation_t), intent(inout) :: self
      integer(ip) :: n_known

      if (.not. allocated(self%arrived)) return
      associate (pairs => self%neighbours%pairs)
         call receive_pairs(self%arrived, pairs%n, pairs%first, pairs%second, self%bodies%row, self%memory, n_known)
         pairs%n_began = pairs%n_began - n_known
      end associate
      deallocate (self%arrived)
   end subroutine recall_pairs

   !> Whether space must be divided anew: at first, and when work has become uneven.
   logical function is_uneven(self)
      type(simulation_t), intent(inout) :: self
      integer(lp) :: greatest(1), total(1)

      is_uneven = self%domain%division_step < 0_lp
      if (is_uneven .or. self%domain%settings%balance == 'off') return
      if (self%step - self%domain%division_step < patience) return
      if (self%domain%settings%balance == 'counted') then
         total = nint(sum(weights_of(self)), lp)
      else
         total = nint(1.0e9_dp*(work_seconds(self) - self%domain%division_seconds), lp)
      end if
      greatest = total
      call self%team%maximise(greatest)
      call self%team%add_up(total)
      is_uneven = real(greatest(1), dp)*real(self%team%size, dp) > &
         real(self%domain%settings%imbalance, dp)*real(total(1), dp)
   end function is_uneven

   !> Divide space so that the work for the bodies is spread evenly.
   subroutine divide(self)
      type(simulation_t), intent(inout) :: self
      real(dp), allocatable :: weight(:)
      real(dp) :: seconds

      associate (domain => self%domain, bodies => self%bodies)
         weight = weights_of(self)
         seconds = work_seconds(self)
         if (domain%settings%balance == 'measured' .and. domain%division_step >= 0_lp .and. size(weight) > 0) &
            weight = weight*((seconds - domain%division_seconds)/sum(weight))
         call domain%partition%divide(self%team, bodies%position(:, bodies%free), weight)
         domain%division_step = self%step
         domain%division_seconds = seconds
         domain%divisions = domain%divisions + 1_lp
      end associate
   end subroutine divide

   !> Work for each free body, in pairs, (body)
   function weights_of(self) result(weight)
      type(simulation_t), intent(in) :: self
      real(dp), allocatable :: weight(:), of_slot(:)
      integer(ip) :: p

      allocate (of_slot(self%bodies%n))
      of_slot = base_weight
      associate (pairs => self%neighbours%pairs)
         do p = 1_ip, pairs%n
            of_slot(pairs%first(p)) = of_slot(pairs%first(p)) + 1.0_dp
            of_slot(pairs%second(p)) = of_slot(pairs%second(p)) + 1.0_dp
         end do
      end associate
      weight = of_slot(self%bodies%free)
   end function weights_of

   !> Time spent on the bodies so far [s]
   pure real(dp) function work_seconds(self)
      type(simulation_t), intent(in) :: self

      work_seconds = sum(self%timers%total(work_stages))
   end function work_seconds

   !> Hand all bodies out by the present division.
   subroutine hand_out(self, error)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      integer(ip), allocatable :: owner(:)
      integer(ip) :: k

      do k = 1_ip, size(self%motions, kind=ip)
         self%motions(k)%slots = self%bodies%row(self%motions(k)%slots)
      end do
      owner = owners_of(self)
      call send_memory(self, owner)
      call send_bodies(self, owner)
      call fetch_ghosts(self)
      do k = 1_ip, size(self%motions, kind=ip)
         self%motions(k)%slots = slots_of_rows(self%bodies%row, self%motions(k)%slots)
      end do
      call self%domain%ghosts%follow(self%team, self%bodies)
      call turn_bodies(self%bodies, [(k, k=1_ip, self%bodies%n)])
      call fit_to_bodies(self, error, self%domain%grain)
      call self%domain%set_reference(self%boxes%bounds(:, :self%boxes%n), self%step)
      associate (domain => self%domain)
         domain%settlements = domain%settlements + 1_lp
         if (domain%settlements > 1_lp) return
         domain%first_arrivals = domain%arrivals
         domain%first_messages = self%team%messages
         domain%first_bytes = self%team%bytes
      end associate
   end subroutine hand_out

   !> Process that will have each body, negative for fixed ones, (slot)
   function owners_of(self) result(owner)
      type(simulation_t), intent(in) :: self
      integer(ip), allocatable :: owner(:)
      integer(ip) :: s

      allocate (owner(self%bodies%n))
      owner = -1_ip
      do s = 1_ip, self%bodies%n
         if (.not. self%bodies%fixed(s)) owner(s) = self%domain%partition%owner_of(self%bodies%position(:, s))
      end do
   end function owners_of

   !> Send what is remembered of the pairs whose lead body is one of this process.
   subroutine send_memory(self, owner)
      type(simulation_t), intent(inout) :: self
      integer(ip), intent(in) :: owner(:)
      logical, allocatable :: is_mine(:)
      integer(ip) :: p, lead

      associate (pairs => self%neighbours%pairs, bodies => self%bodies)
         allocate (is_mine(pairs%n))
         do p = 1_ip, pairs%n
            lead = pairs%first(p)
            if (bodies%fixed(lead)) lead = pairs%second(p)
            is_mine(p) = .not. bodies%ghost(lead)
         end do
         allocate (self%arrived)
         call send_pairs(self%team, pairs%n, pairs%first, pairs%second, bodies%row, is_mine, owner, self%memory, &
                         self%arrived)
      end associate
   end subroutine send_memory

   !> Send the free bodies of this process to their owners; fixed ones stay.
   subroutine send_bodies(self, owner)
      type(simulation_t), intent(inout) :: self
      integer(ip), intent(in) :: owner(:)
      type(freight_t) :: freight
      type(mover_t) :: mover
      integer(ip), allocatable :: counts(:), counts_received(:), slots(:), order(:)
      integer(ip) :: s

      associate (bodies => self%bodies)
         slots = pack([(s, s=1_ip, bodies%n)],.not. bodies%ghost)
         call sort_by_rank(merge(owner(slots), self%team%rank, owner(slots) >= 0_ip), self%team%size, counts, order)
         slots = slots(order)
         call load(bodies, slots, freight)
      end associate
      mover%slots = slots
      call keep_columns(mover, self)
      call mover%move(self%team, counts)
      call trade_freight(self%team, counts, freight, counts_received)
      self%domain%arrivals = self%domain%arrivals + &
         int(sum(counts_received) - counts_received(lbound(counts_received, 1) + self%team%rank), lp)
      call unload(freight, (self%bodies%n_all), self%bodies, mover%slots)
      call self%integrator%start(self%bodies)
      call keep_columns(mover, self)
      call turn_bodies(self%bodies, [(s, s=1_ip, self%bodies%n)])
   end subroutine send_bodies

   !> Tell the others where the bodies of this process are, and get those of theirs that are near.
   subroutine fetch_ghosts(self)
      type(simulation_t), intent(inout) :: self
      type(freight_t) :: freight, strangers
      type(mover_t) :: mover
      integer(ip), allocatable :: sent(:), counts(:), counts_received(:), slots(:)
      real(wp), allocatable :: boxes(:, :)
      integer(lp) :: n_ghosts(1)
      integer(ip) :: s, n

      n = self%bodies%n
      boxes = grown_boxes(self)
      call self%domain%regions%publish(self%team, boxes)
      call list_needed(self, boxes, sent, counts)
      call load(self%bodies, sent, strangers)
      call trade_freight(self%team, counts, strangers, counts_received)
      mover%slots = [(s, s=1_ip, n)]
      call load(self%bodies, mover%slots, freight)
      call keep_columns(mover, self)
      mover%gives_back = .true.
      call join_freights(freight, strangers)
      call unload(freight, (self%bodies%n_all), self%bodies, slots)
      self%bodies%ghost(slots(n + 1_ip:)) = .true.
      self%bodies%free = pack([(s, s=1_ip, self%bodies%n)],.not. (self%bodies%fixed .or. self%bodies%ghost))
      mover%slots = slots(:n)
      call self%integrator%start(self%bodies)
      call keep_columns(mover, self)
      call new_ghosts(self%domain%ghosts, counts, slots(sent), counts_received, slots(n + 1_ip:), &
                      self%settings%forces%midstep_slip)
      n_ghosts = int(self%bodies%n - n, lp)
      call self%team%add_up(n_ghosts)
      self%domain%ghost_share = real(n_ghosts(1), wp)/real(self%bodies%n_all, wp)
   end subroutine fetch_ghosts

   !> Keep all that changes about bodies, also what lasts for this step only.
   subroutine keep_columns(archive, self)
      class(archive_t), intent(inout) :: archive
      type(simulation_t), intent(inout) :: self

      call keep_bodies(archive, self%bodies)
      call self%integrator%carry(archive)
      if (self%settings%output%ledger) call keep_books(self%ledger, self%bodies%n, archive)
   end subroutine keep_columns

   !> Boxes of the free bodies, grown by as far as they may go, (4, body) [m]
   function grown_boxes(self) result(boxes)
      type(simulation_t), intent(in) :: self
      real(wp), allocatable :: boxes(:, :)
      real(wp) :: low(2), high(2), room
      integer(ip) :: k, s, v

      associate (bodies => self%bodies)
         allocate (boxes(4, size(bodies%free)))
         do k = 1_ip, size(bodies%free, kind=ip)
            s = bodies%free(k)
            low = bodies%turned(:, bodies%vertex_start(s))
            high = low
            do v = bodies%vertex_start(s) + 1_ip, bodies%vertex_start(s + 1_ip) - 1_ip
               low = min(low, bodies%turned(:, v))
               high = max(high, bodies%turned(:, v))
            end do
            room = self%domain%margin + self%settings%boxes%margin + rounding*(sum(high - low) + &
               abs(bodies%position(1, s)) + abs(bodies%position(2, s)))
            boxes(1:2, k) = bodies%position(:, s) + (low - room)
            boxes(3:4, k) = bodies%position(:, s) + (high + room)
         end do
      end associate
   end function grown_boxes

   !> List the bodies that other processes need, in the order of these.
   subroutine list_needed(self, boxes, slots, counts)
      type(simulation_t), intent(in) :: self
      !> Grown boxes of the free bodies, (4, body)
      real(wp), intent(in) :: boxes(:, :)
      integer(ip), allocatable, intent(out) :: slots(:), counts(:)
      integer(ip), allocatable :: rank(:), longer(:), order(:)
      integer(ip) :: needing(self%team%size), k, m, n

      allocate (slots(64), rank(64))
      n = 0_ip
      do k = 1_ip, size(boxes, 2, kind=ip)
         call self%domain%regions%needed_by(boxes(:, k), needing, m)
         if (n + m > size(slots)) then
            longer = [slots, spread(0_ip, 1, n + m)]
            call move_alloc(longer, slots)
            longer = [rank, spread(0_ip, 1, n + m)]
            call move_alloc(longer, rank)
         end if
         slots(n + 1_ip:n + m) = self%bodies%free(k)
         rank(n + 1_ip:n + m) = needing(:m)
         n = n + m
      end do
      call sort_by_rank(rank(:n), self%team%size, counts, order)
      slots = slots(order)
   end subroutine list_needed

   !> Slots of bodies given by their places among all of the run
   pure function slots_of_rows(row, wanted) result(slots)
      !> Ascending, (slot)
      integer(ip), intent(in) :: row(:)
      integer(ip), intent(in) :: wanted(:)
      integer(ip) :: slots(size(wanted))
      integer(ip) :: k, low, high, middle

      do k = 1_ip, size(wanted, kind=ip)
         low = 1_ip
         high = size(row, kind=ip)
         do while (low < high)
            middle = low + (high - low)/2_ip
            if (row(middle) < wanted(k)) then
               low = middle + 1_ip
            else
               high = middle
            end if
         end do
         slots(k) = low
      end do
   end function slots_of_rows

end module polydem_settle
