!> From pairs to forces on bodies in one loop over blocks of contacts: overlaps, force law, guards, sums per body.
!>
!> A block of contacts stays in the first-level cache from its overlaps to the sums of its forces; a table of contacts
!> is written only for those who ask for it. Each thread runs over one range of pairs. Sums of forces are in the same
!> order for any number of threads (see `polydem_force_sums`).
module polydem_contact_loop
   use omp_lib, only: omp_get_max_threads
   use polydem_bodies, only: bodies_t
   use polydem_clock, only: wall_seconds
   use polydem_cell_load, only: add_virial
   use polydem_contact_block, only: block_size, contact_block_t, is_degenerate
   use polydem_contact_history, only: contact_history_t
   use polydem_contact_incidence, only: index_contacts
   use polydem_contact_rows, only: append_rows, gather_rows, release_rows, start_rows
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_fill_block, only: fill_block
   use polydem_force_sums, only: add_deferred_terms, add_terms, begin_sums, clear_sums, contact_terms_t, terms_of_block
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ownership, only: find_owned_pairs
   use polydem_pair_ranges, only: balance_ranges, divide_pairs, most_ranges
   use polydem_contact_flags, only: test_block
   use polydem_simulation, only: simulation_t, sum_contacts_own => sum_contacts, sum_degenerate
   use polydem_timers, only: block_clock_t
   use polydem_loop_results, only: range_results_t, loop_results_t
   use polydem_contact_shares, only: find_shares, set_shares
   use polydem_wall_terms, only: append_border, append_walls, join_walls
   implicit none
   private
   public :: loop_over_contacts

contains

   !> Sum the contact forces on all bodies over the pairs of this step.
   subroutine loop_over_contacts(self, dt, tabulate, clock, error)
      !> The simulation with its pair list; sums of forces, contact history and the results of the loop are set
      type(simulation_t), intent(inout) :: self
      !> Time since the last evaluation [s]
      real(wp), intent(in) :: dt
      !> Whether to keep the table of all contacts
      logical, intent(in) :: tabulate
      !> Clock of the blocks of the first range: overlaps, then forces
      type(block_clock_t), intent(out) :: clock
      !> On entry an error of the step, after which nothing is done
      type(error_t), allocatable, intent(in) :: error
      integer(ip) :: ends(0:most_ranges), last(0:most_ranges)
      integer(ip) :: n, r, k

      if (allocated(error)) return
      self%loop%has_table = tabulate
      associate (pairs => self%search%neighbours%pairs)
         n = min(int(omp_get_max_threads(), ip), most_ranges)
         call divide_pairs(pairs%n, pairs%first, self%bodies%pieces, n, self%loop%upto, ends)
         call reserve_ranges(n, self%loop)
         last(0) = 0_ip
         do r = 1_ip, n - 1_ip
            last(r) = self%bodies%pieces%body_of(pairs%first(ends(r)))
         end do
         last(n) = self%bodies%n
      end associate
      call begin_sums(self%bodies%n, self%loop%force_sums)
      if (self%law%needs_shares) &
         call find_shares(self%law, self%bodies, self%search%neighbours%pairs, self%history, self%loop%shares)
      !$omp parallel if (n > 1_ip) default(none) shared(self, dt, ends, last, n, clock) private(r, k)
      !$omp do schedule(static, 1)
      do r = 1_ip, n
         call loop_over_range(self, dt, r, ends(r - 1_ip:r), last(r - 1_ip:r), clock)
      end do
      !$omp end do
      !$omp do schedule(static, 1)
      do k = 1_ip, n
         do r = n - 1_ip, 1_ip, -1_ip
            call add_deferred_terms(self%loop%ranges(r)%deferred, k, n, self%loop%force_sums)
         end do
         if (k == n) call join_walls(self%loop%walls_of(:n), self%loop%walls)
      end do
      !$omp end do nowait
      !$omp end parallel
      self%loop%step = self%step
      call balance_ranges(self%loop%elapsed(:n), self%loop%upto)
      call gather_results(n, .not. allocated(self%law%constraint), self%loop, self%contacts)
      associate (ranges => self%loop%ranges(:n))
         self%loop%n_contacts = sum(ranges%n_contacts)
         self%loop%virial = 0_lp
         do r = 1_ip, n
            self%loop%virial = self%loop%virial + ranges(r)%virial
         end do
         self%sums(sum_contacts_own) = self%sums(sum_contacts_own) + int(self%loop%n_contacts, lp)
         self%sums(sum_degenerate) = self%sums(sum_degenerate) + int(sum(ranges%n_degenerate), lp)
      end associate
      if (tabulate) call index_contacts(self%bodies%n, self%contacts, self%loop%incidence)
   end subroutine loop_over_contacts

   !> Make room for the results of n ranges.
   subroutine reserve_ranges(n, loop)
      integer(ip), intent(in) :: n
      type(loop_results_t), intent(inout) :: loop

      if (allocated(loop%ranges)) then
         if (size(loop%ranges) >= n) return
         deallocate (loop%ranges, loop%all_of, loop%walls_of, loop%flagged_of, loop%elapsed)
      end if
      allocate (loop%ranges(n), loop%all_of(n), loop%walls_of(n), loop%flagged_of(n), loop%elapsed(n))
   end subroutine reserve_ranges

   !> Walk over the pairs of one range in descending order.
   subroutine loop_over_range(self, dt, r, ends, last, clock)
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
      call start_results(r, self%loop)
      next = ends(2)
      tested = next + 1_ip
      high = last(2)
      cursor = 0_ip
      if (self%law%needs_shares .and. self%loop%shares%groups%n > 0_ip) &
         cursor = count(self%loop%shares%groups%pair(:self%loop%shares%groups%n) <= ends(2), kind=ip)
      do while (next > ends(1))
         call own_clock%begin_block()
         associate (pairs => self%search%neighbours%pairs)
            call fill_block(self%bodies, pairs%first, pairs%second, self%law%overlap_measure, &
                            ends(1) + 1_ip, next, tested, self%history, block)
         end associate
         call own_clock%end_part(1)
         if (self%law%needs_shares) call set_shares(self%loop%shares, cursor, block)
         call self%law%apply(self%bodies, dt, block, self%history)
         call terms_of_block(block, terms)
         ! Sums begin just before their first terms: no contact so far had a lower slot.
         if (block%n > 0_ip) then
            low = min(block%first(block%n), block%second(block%n))
            call clear_sums(low, high, self%loop%force_sums)
            high = min(high, low - 1_ip)
         end if
         call add_terms(block, terms, last(2), self%loop%force_sums, self%loop%ranges(r)%deferred)
         call count_block(self%domain%has_halo(), self%bodies, block, self%loop%ranges(r))
         if (allocated(self%bodies%cell%load)) &
            call count_virial(self%domain%has_halo(), self%bodies, block, terms, self%loop%ranges(r)%virial)
         call keep_contacts(r, self%bodies, block, terms, self%history, self%loop)
         call own_clock%end_part(2)
      end do
      call clear_sums(last(1) + 1_ip, high, self%loop%force_sums)
      if (r == 1_ip) clock = own_clock
      self%loop%elapsed(r) = max(wall_seconds() - began, tiny(began))
   end subroutine loop_over_range

   !> Empty the results of a range. About as many contacts are expected as this rank owned in the last step.
   subroutine start_results(r, loop)
      !> Index of the range
      integer(ip), intent(in) :: r
      type(loop_results_t), intent(inout) :: loop

      call start_rows(merge(loop%ranges(r)%n_contacts, 0_ip, loop%has_table), loop%all_of(r))
      call start_rows(0_ip, loop%flagged_of(r))
      loop%walls_of(r)%n = 0_ip
      loop%walls_of(r)%border%n = 0_ip
      associate (results => loop%ranges(r))
         results%deferred%n = 0_ip
         results%n_contacts = 0_ip
         results%n_degenerate = 0_ip
         results%passing_pair = 0_ip
         results%virial = 0_lp
      end associate
   end subroutine start_results

   !> Test the contacts of a block by the guards, and keep those that are needed after the loop.
   subroutine keep_contacts(r, bodies, block, terms, history, loop)
      !> Index of the range
      integer(ip), intent(in) :: r
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(in) :: block
      type(contact_terms_t), intent(in) :: terms
      !> Contact history; the direction is read and set
      type(contact_history_t), intent(inout) :: history
      type(loop_results_t), intent(inout) :: loop
      logical :: flagged(block_size), some

      if (loop%has_table) call append_rows(block, loop%all_of(r), with_forces=.true.)
      call append_walls(bodies%fixed, block, terms, loop%walls_of(r))
      if (bodies%cell%is_sheared) call append_border(bodies, block, terms, loop%walls_of(r)%border)
      call test_block(loop%flag_limits, bodies, block, history, flagged, some, loop%ranges(r)%passing_pair)
      if (some) call append_rows(block, loop%flagged_of(r), with_forces=.true., chosen=flagged)
   end subroutine keep_contacts

   !> Count the contacts that this rank owns, and those without direction.
   subroutine count_block(has_halo, bodies, block, results)
      !> Whether other ranks own some of the bodies
      logical, intent(in) :: has_halo
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(in) :: block
      type(range_results_t), intent(inout) :: results
      logical :: owned(block_size)

      if (.not. has_halo) then
         results%n_contacts = results%n_contacts + block%n
         results%n_degenerate = results%n_degenerate + count(block%degenerate(:block%n) > 0.0_wp, kind=ip)
         return
      end if
      call find_owned_pairs(block%n, block%first, block%second, bodies%in_halo, bodies%fixed, owned)
      results%n_contacts = results%n_contacts + count(owned(:block%n), kind=ip)
      results%n_degenerate = results%n_degenerate &
                             + count(owned(:block%n) .and. block%degenerate(:block%n) > 0.0_wp, kind=ip)
   end subroutine count_block

   !> Add the contacts that this rank owns to the sums for a stress-controlled cell.
   pure subroutine count_virial(has_halo, bodies, block, terms, virial)
      !> Whether other ranks own some of the bodies
      logical, intent(in) :: has_halo
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(in) :: block
      type(contact_terms_t), intent(in) :: terms
      integer(lp), intent(inout) :: virial(2, 3)
      logical :: owned(block_size)

      owned = .true.
      if (has_halo) call find_owned_pairs(block%n, block%first, block%second, bodies%in_halo, bodies%fixed, owned)
      call add_virial(bodies%cell%load%unit, block, terms, owned, virial)
   end subroutine count_virial

   !> Join the results of n ranges.
   subroutine gather_results(n, releases_rows, loop, contacts)
      integer(ip), intent(in) :: n
      !> Whether the rows of the table are released
      logical, intent(in) :: releases_rows
      type(loop_results_t), intent(inout) :: loop
      !> Table of all contacts; empty if the loop does not keep it
      type(contacts_t), intent(inout) :: contacts
      integer(ip) :: c, r

      contacts%n = 0_ip
      loop%passing_pair = 0_ip
      do r = n, 1_ip, -1_ip
         if (loop%ranges(r)%passing_pair > 0_ip) loop%passing_pair = loop%ranges(r)%passing_pair
      end do
      if (loop%has_table) call gather_rows(loop%all_of(:n), contacts)
      ! Most tables are for a frame. Then the memory of the rows serves better elsewhere.
      if (loop%has_table .and. releases_rows) call release_rows(loop%all_of)
      call gather_rows(loop%flagged_of(:n), loop%flagged)
      associate (flagged => loop%flagged)
         flagged%n_degenerate = 0_ip
         do c = 1_ip, flagged%n
            if (is_degenerate(flagged%row(c))) flagged%n_degenerate = flagged%n_degenerate + 1_ip
         end do
         contacts%n_degenerate = flagged%n_degenerate
      end associate
   end subroutine gather_results

end module polydem_contact_loop
