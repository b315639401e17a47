!> From pairs to forces on bodies in one walk over blocks of contacts: overlaps, force law, guards, sums per body.
!>
!> A block of contacts stays in the first-level cache from its overlaps to the sums of its forces; a table of contacts
!> is written only for those who ask for it. Each thread walks over one range of pairs. Sums of forces are in the same
!> order for any number of threads (see `polydem_force_sums`).
module polydem_contact_walk
   use omp_lib, only: omp_get_max_threads
   use polydem_clock, only: wall_seconds
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_incidence, only: index_contacts
   use polydem_contact_rows, only: append_rows, gather_rows, release_rows, start_rows
   use polydem_contacts, only: contacts_t, is_degenerate
   use polydem_errors, only: error_t
   use polydem_fill_block, only: fill_block
   use polydem_force_sums, only: add_late_terms, add_terms, begin_sums, clear_sums, contact_terms_t, terms_of_block
   use polydem_motion_check, only: check_contacts
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ownership, only: find_owned_pairs
   use polydem_pair_ranges, only: balance_ranges, divide_pairs, most_ranges
   use polydem_contact_flags, only: test_block
   use polydem_simulation, only: simulation_t, sum_contacts_own => sum_contacts, sum_degenerate
   use polydem_timers, only: block_clock_t
   use polydem_walk_results, only: range_results_t, walk_results_t
   use polydem_wall_shares, only: find_shares, set_shares
   use polydem_wall_terms, only: append_border, append_walls, join_walls
   implicit none
   private
   public :: walk_contacts

contains

   !> Sum the contact forces on all bodies over the pairs of this step.
   subroutine walk_contacts(self, dt, tabulate, clock, error)
      !> The simulation with its pair list; sums of forces, contact history and the results of the walk are set
      type(simulation_t), intent(inout) :: self
      !> Time since the last evaluation [s]
      real(wp), intent(in) :: dt
      !> Whether to keep the table of all contacts
      logical, intent(in) :: tabulate
      !> Clock of the blocks of the first range: overlaps, then forces
      type(block_clock_t), intent(out) :: clock
      !> Names a contact that must stop the run; on entry an error of the step, after which nothing is done
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: ends(0:most_ranges), last(0:most_ranges)
      integer(ip) :: n, r, k

      if (allocated(error)) return
      self%walk%has_table = tabulate
      associate (pairs => self%neighbours%pairs)
         n = min(int(omp_get_max_threads(), ip), most_ranges)
         call divide_pairs(pairs%n, pairs%first, self%bodies%pieces, n, self%walk%upto, ends)
         call reserve_ranges(n, self%walk)
         last(0) = 0_ip
         do r = 1_ip, n - 1_ip
            last(r) = self%bodies%pieces%body_of(pairs%first(ends(r)))
         end do
         last(n) = self%bodies%n
      end associate
      call begin_sums(self%bodies%n, self%force_sums)
      if (self%law%needs_shares) &
         call find_shares(self%law, self%bodies, self%neighbours%pairs, self%history, self%walk%shares)
      !$omp parallel if (n > 1_ip) default(none) shared(self, dt, ends, last, n, clock) private(r, k)
      !$omp do schedule(static, 1)
      do r = 1_ip, n
         call walk_range(self, dt, r, ends(r - 1_ip:r), last(r - 1_ip:r), clock)
      end do
      !$omp end do
      !$omp do schedule(static, 1)
      do k = 1_ip, n
         do r = n - 1_ip, 1_ip, -1_ip
            call add_late_terms(self%walk%ranges(r)%late, k, n, self%force_sums)
         end do
         if (k == n) call join_walls(self%walk%walls_of(:n), self%walk%walls)
      end do
      !$omp end do nowait
      !$omp end parallel
      self%walk%step = self%step
      call balance_ranges(self%walk%elapsed(:n), self%walk%upto)
      call gather_results(self, n)
      if (tabulate) call index_contacts(self%bodies%n, self%contacts, self%walk%incidence)
      call check_contacts(self%settings%overlap%degenerate, self%bodies, self%walk%flagged, self%step, error)
   end subroutine walk_contacts

   !> Make room for the results of n ranges.
   subroutine reserve_ranges(n, walk)
      integer(ip), intent(in) :: n
      type(walk_results_t), intent(inout) :: walk

      if (allocated(walk%ranges)) then
         if (size(walk%ranges) >= n) return
         deallocate (walk%ranges, walk%all_of, walk%walls_of, walk%flagged_of, walk%elapsed)
      end if
      allocate (walk%ranges(n), walk%all_of(n), walk%walls_of(n), walk%flagged_of(n), walk%elapsed(n))
   end subroutine reserve_ranges

   !> Walk over the pairs of one range in descending order.
   subroutine walk_range(self, dt, r, ends, last, clock)
      type(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      !> Index of the range
      integer(ip), intent(in) :: r
      !> Index of the last pair before the range, and of its last pair
      integer(ip), intent(in) :: ends(2)
      !> Last slot of the range before, and last slot whose sums this thread may change; it sets those between
      integer(ip), intent(in) :: last(2)
      !> Clock of the blocks of the first range
      type(block_clock_t), intent(inout) :: clock
      type(block_clock_t) :: own_clock
      type(contact_block_t) :: block
      type(contact_terms_t) :: terms
      real(dp) :: began
      integer(ip) :: next, tested, low, high, cursor

      began = wall_seconds()
      call start_results(self%contacts, r, self%walk)
      next = ends(2)
      tested = next + 1_ip
      high = last(2)
      cursor = 0_ip
      if (self%law%needs_shares .and. self%walk%shares%n > 0_ip) &
         cursor = count(self%walk%shares%pair(:self%walk%shares%n) <= ends(2), kind=ip)
      do while (next > ends(1))
         call own_clock%begin_block()
         associate (pairs => self%neighbours%pairs)
            call fill_block(self%bodies, pairs%first, pairs%second, self%law%needs_effective_area, &
                            ends(1) + 1_ip, next, tested, self%history, block)
         end associate
         call own_clock%end_part(1)
         if (self%law%needs_shares) call set_shares(self%walk%shares, cursor, block)
         call self%law%apply(self%bodies, dt, block, self%history)
         call terms_of_block(block, terms)
         ! Sums begin just before their first terms: no contact so far had a lower slot.
         if (block%n > 0_ip) then
            low = min(block%first(block%n), block%second(block%n))
            call clear_sums(low, high, self%force_sums)
            high = min(high, low - 1_ip)
         end if
         call add_terms(block, terms, last(2), self%force_sums, self%walk%ranges(r)%late)
         call keep_contacts(self, r, block, terms)
         call own_clock%end_part(2)
      end do
      call clear_sums(last(1) + 1_ip, high, self%force_sums)
      if (r == 1_ip) clock = own_clock
      self%walk%elapsed(r) = max(wall_seconds() - began, tiny(began))
   end subroutine walk_range

   !> Empty the results of a range. About as many contacts are expected as this rank owned in the last step.
   subroutine start_results(contacts, r, walk)
      type(contacts_t), intent(in) :: contacts
      !> Index of the range
      integer(ip), intent(in) :: r
      type(walk_results_t), intent(inout) :: walk

      call start_rows(contacts, merge(walk%ranges(r)%n_contacts, 0_ip, walk%has_table), walk%all_of(r))
      call start_rows(contacts, 0_ip, walk%flagged_of(r))
      walk%walls_of(r)%n = 0_ip
      walk%walls_of(r)%border%n = 0_ip
      associate (results => walk%ranges(r))
         results%late%n = 0_ip
         results%n_contacts = 0_ip
         results%n_degenerate = 0_ip
         results%passing_pair = 0_ip
      end associate
   end subroutine start_results

   !> Count the contacts of a block, test them by the guards, and keep those that are needed after the walk.
   subroutine keep_contacts(self, r, block, terms)
      type(simulation_t), intent(inout) :: self
      !> Index of the range
      integer(ip), intent(in) :: r
      type(contact_block_t), intent(in) :: block
      type(contact_terms_t), intent(in) :: terms
      logical :: suspect(block_size), some

      associate (walk => self%walk)
         call count_block(self, block, walk%ranges(r))
         if (walk%has_table) call append_rows(block, walk%all_of(r), with_forces=.true.)
         call append_walls(self%bodies%fixed, block, terms, walk%walls_of(r))
         if (self%bodies%cell%is_sheared) call append_border(self%bodies, block, terms, walk%walls_of(r)%border)
         call test_block(walk%flag_limits, self%bodies, block, self%history, suspect, some, &
                         walk%ranges(r)%passing_pair)
         if (some) call append_rows(block, walk%flagged_of(r), with_forces=.true., chosen=suspect)
      end associate
   end subroutine keep_contacts

   !> Count the contacts that this rank owns, and those without direction.
   subroutine count_block(self, block, results)
      type(simulation_t), intent(in) :: self
      type(contact_block_t), intent(in) :: block
      type(range_results_t), intent(inout) :: results
      logical :: owned(block_size)

      if (.not. self%domain%has_halo()) then
         results%n_contacts = results%n_contacts + block%n
         results%n_degenerate = results%n_degenerate + count(block%degenerate(:block%n) > 0.0_wp, kind=ip)
         return
      end if
      call find_owned_pairs(block%n, block%first, block%second, self%bodies%in_halo, self%bodies%fixed, owned)
      results%n_contacts = results%n_contacts + count(owned(:block%n), kind=ip)
      results%n_degenerate = results%n_degenerate &
                             + count(owned(:block%n) .and. block%degenerate(:block%n) > 0.0_wp, kind=ip)
   end subroutine count_block

   !> Join the results of n ranges.
   subroutine gather_results(self, n)
      type(simulation_t), intent(inout) :: self
      integer(ip), intent(in) :: n
      integer(ip) :: c, r, n_degenerate

      self%contacts%n = 0_ip
      n_degenerate = 0_ip
      self%n_contacts = 0_ip
      self%walk%passing_pair = 0_ip
      associate (walk => self%walk)
         do r = n, 1_ip, -1_ip
            self%n_contacts = self%n_contacts + walk%ranges(r)%n_contacts
            n_degenerate = n_degenerate + walk%ranges(r)%n_degenerate
            if (walk%ranges(r)%passing_pair > 0_ip) walk%passing_pair = walk%ranges(r)%passing_pair
         end do
         if (walk%has_table) call gather_rows(walk%all_of(:n), self%contacts)
         ! Most tables are for a frame. Then the memory of the rows serves better elsewhere.
         if (walk%has_table .and. .not. allocated(self%law%constraint)) call release_rows(walk%all_of)
         call gather_rows(walk%flagged_of(:n), walk%flagged)
      end associate
      associate (flagged => self%walk%flagged)
         flagged%n_degenerate = 0_ip
         do c = 1_ip, flagged%n
            if (is_degenerate(flagged, c)) flagged%n_degenerate = flagged%n_degenerate + 1_ip
         end do
         self%contacts%n_degenerate = flagged%n_degenerate
      end associate
      self%sums(sum_contacts_own) = self%sums(sum_contacts_own) + int(self%n_contacts, lp)
      self%sums(sum_degenerate) = self%sums(sum_degenerate) + int(n_degenerate, lp)
   end subroutine gather_results

end module polydem_contact_walk
