!> From pairs to forces on bodies in one walk over blocks of contacts: overlaps, force law, guards, sums per body.
!>
!> A block of contacts stays in the first-level cache from its overlaps to the sums of its forces; a table of contacts
!> is written only for those who ask for it. Each thread walks over one range of pairs. Sums of forces are in the same
!> order for any number of threads (see `polydem_force_sums`).
module polydem_contact_walk
   use omp_lib, only: omp_get_max_threads
   use polydem_clock, only: wall_seconds
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_rows, only: append_rows, gather_rows, release_rows, start_rows
   use polydem_contacts, only: contacts_t, is_degenerate
   use polydem_fill_block, only: fill_block
   use polydem_force_sums, only: add_late_terms, add_terms, clear_sums, contact_terms_t, reserve_sums, terms_of_block
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ownership, only: find_owned_pairs
   use polydem_pair_ranges, only: balance_ranges, divide_pairs, most_ranges
   use polydem_passing, only: test_block
   use polydem_range_results, only: range_results_t
   use polydem_simulation, only: simulation_t, sum_contacts_own => sum_contacts, sum_degenerate
   use polydem_walk_results, only: walk_results_t
   use polydem_wall_shares, only: find_shares, set_shares
   use polydem_wall_terms, only: append_walls, join_walls
   implicit none
   private
   public :: walk_contacts

   !> One of so many blocks is timed
   integer(ip), parameter :: timed_blocks = 8_ip

contains

   !> Sum the contact forces on all bodies over the pairs of this step.
   subroutine walk_contacts(self, dt, overlap_share)
      !> The simulation with its pair list; sums of forces, contact history and the results of the walk are set
      type(simulation_t), intent(inout) :: self
      !> Time since the last evaluation [s]
      real(wp), intent(in) :: dt
      !> Share of the time spent in the search for overlaps, in a walk of which some blocks were timed
      real(dp), intent(out) :: overlap_share
      integer(ip) :: ends(0:most_ranges), last(0:most_ranges)
      integer(ip) :: n, r, k

      associate (pairs => self%neighbours%pairs)
         n = min(int(omp_get_max_threads(), ip), most_ranges)
         call divide_pairs(pairs%n, pairs%first, n, self%walk%upto, ends)
         call reserve_ranges(n, self%walk)
         last(0) = 0_ip
         do r = 1_ip, n - 1_ip
            last(r) = pairs%first(ends(r))
         end do
         last(n) = self%bodies%n
      end associate
      call reserve_sums(self%bodies%n, self%force_sums)
      if (self%law%needs_shares) &
         call find_shares(self%law, self%bodies, self%neighbours%pairs, self%history, self%isa, self%walk%shares)
      !$omp parallel if (n > 1_ip) default(none) shared(self, dt, ends, last, n) private(r, k)
      !$omp do schedule(static, 1)
      do r = 1_ip, n
         call walk_range(self, dt, r, ends(r - 1_ip:r), last(r - 1_ip:r))
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
      overlap_share = 0.5_dp
      associate (seconds => self%walk%ranges(1)%seconds)
         if (sum(seconds) > 0.0_dp) overlap_share = seconds(1)/sum(seconds)
      end associate
   end subroutine walk_contacts

   !> Make room for the results of n ranges.
   subroutine reserve_ranges(n, walk)
      integer(ip), intent(in) :: n
      type(walk_results_t), intent(inout) :: walk

      if (allocated(walk%ranges)) then
         if (size(walk%ranges) >= n) return
         deallocate (walk%ranges, walk%all_of, walk%walls_of, walk%suspects_of, walk%elapsed)
      end if
      allocate (walk%ranges(n), walk%all_of(n), walk%walls_of(n), walk%suspects_of(n), walk%elapsed(n))
   end subroutine reserve_ranges

   !> Walk over the pairs of one range in descending order.
   subroutine walk_range(self, dt, r, ends, last)
      type(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      !> Index of the range
      integer(ip), intent(in) :: r
      !> Index of the last pair before the range, and of its last pair
      integer(ip), intent(in) :: ends(2)
      !> Last slot of the range before, and last slot whose sums this thread may change; it sets those between
      integer(ip), intent(in) :: last(2)
      type(contact_block_t) :: block
      type(contact_terms_t) :: terms
      real(dp) :: clock(3), began
      integer(ip) :: next, tested, n_blocks, low, high, cursor
      logical :: timed

      began = wall_seconds()
      call start_results(self%contacts, self%keeps_contacts, r, self%walk)
      next = ends(2)
      tested = next + 1_ip
      n_blocks = 0_ip
      high = last(2)
      cursor = 0_ip
      if (self%law%needs_shares .and. self%walk%shares%n > 0_ip) &
         cursor = count(self%walk%shares%pair(:self%walk%shares%n) <= ends(2), kind=ip)
      do while (next > ends(1))
         timed = mod(n_blocks, timed_blocks) == 0_ip
         n_blocks = n_blocks + 1_ip
         if (timed) clock(1) = wall_seconds()
         associate (pairs => self%neighbours%pairs)
            call fill_block(self%bodies, pairs%first, pairs%second, self%law%needs_effective_area, self%isa, &
                            ends(1) + 1_ip, next, tested, self%history, block)
         end associate
         if (timed) clock(2) = wall_seconds()
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
         if (.not. timed) cycle
         clock(3) = wall_seconds()
         self%walk%ranges(r)%seconds = self%walk%ranges(r)%seconds + (clock(2:3) - clock(1:2))
      end do
      call clear_sums(last(1) + 1_ip, high, self%force_sums)
      self%walk%elapsed(r) = max(wall_seconds() - began, tiny(began))
   end subroutine walk_range

   !> Empty the results of a range.
   subroutine start_results(contacts, keeps_contacts, r, walk)
      type(contacts_t), intent(in) :: contacts
      !> Whether the range will keep all its contacts. About as many are expected as this rank owned in the last step
      logical, intent(in) :: keeps_contacts
      !> Index of the range
      integer(ip), intent(in) :: r
      type(walk_results_t), intent(inout) :: walk

      call start_rows(contacts, merge(walk%ranges(r)%n_contacts, 0_ip, keeps_contacts), walk%all_of(r))
      call start_rows(contacts, 0_ip, walk%suspects_of(r))
      walk%walls_of(r)%n = 0_ip
      associate (results => walk%ranges(r))
         results%late%n = 0_ip
         results%n_contacts = 0_ip
         results%n_degenerate = 0_ip
         results%passing_pair = 0_ip
         results%seconds = 0.0_dp
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
         if (self%keeps_contacts) call append_rows(block, walk%all_of(r), with_forces=.true.)
         call append_walls(self%bodies%fixed, block, terms, walk%walls_of(r))
         call test_block(walk%contact_guard, self%bodies, block, self%history, suspect, some, &
                         walk%ranges(r)%passing_pair)
         if (some) call append_rows(block, walk%suspects_of(r), with_forces=.true., chosen=suspect)
      end associate
   end subroutine keep_contacts

   !> Count the contacts that this rank owns, and those without direction.
   subroutine count_block(self, block, results)
      type(simulation_t), intent(in) :: self
      type(contact_block_t), intent(in) :: block
      type(range_results_t), intent(inout) :: results
      logical :: owned(block_size)

      if (self%comm%size == 1_ip) then
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
         if (self%keeps_contacts) call gather_rows(walk%all_of(:n), self%contacts)
         ! Most tables are for a frame. Then the memory of the rows serves better elsewhere.
         if (self%keeps_contacts .and. .not. allocated(self%law%constraint)) call release_rows(walk%all_of)
         call gather_rows(walk%suspects_of(:n), walk%suspects)
      end associate
      associate (suspects => self%walk%suspects)
         suspects%n_degenerate = 0_ip
         do c = 1_ip, suspects%n
            if (is_degenerate(suspects, c)) suspects%n_degenerate = suspects%n_degenerate + 1_ip
         end do
         self%contacts%n_degenerate = suspects%n_degenerate
      end associate
      self%sums(sum_contacts_own) = self%sums(sum_contacts_own) + int(self%n_contacts, lp)
      self%sums(sum_degenerate) = self%sums(sum_degenerate) + int(n_degenerate, lp)
   end subroutine gather_results

end module polydem_contact_walk
