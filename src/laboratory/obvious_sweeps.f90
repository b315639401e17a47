!> Fine-grained parallel sweeps as one would first write them, to show what makes them slow. `partitioned_sweep` is the
!> version that works.
!>
!>     odd_even_sweep   All threads exchange single neighbouring ends that are out of order: in odd passes those of the
!>                      places (1, 2), (3, 4), ..., in even passes those of (2, 3), (4, 5), ... (odd-even transposition,
!>                      Knuth 1998, section 5.3.4), until an odd and an even pass exchange nothing. An end moves by one
!>                      place per pass, so there are as many passes as the farthest end moves places, and two more.
!>     locked_sweep     Each thread sorts one part of the lists. The changes that an end causes enter the one list of
!>                      changes under a lock. In even passes the parts are shifted by half of their length. All ends are
!>                      looked at in every pass, until a pass after the first exchanges nothing.
!>     mended_sweep     Each thread sorts one part of the lists. Then one thread alone merges each part into those below
!>                      it, while the others wait.
!>
!> All threads wait for one another at the end of every pass: the count of passes is that of barriers. Two ends are
!> exchanged once if their order has changed, and never otherwise, so exchanges and changes are those of
!> `sort_and_sweep`. The waiting time includes that for the lock.
module polydem_obvious_sweeps
   use omp_lib, only: omp_destroy_lock, omp_get_max_threads, omp_get_num_threads, omp_get_thread_num, omp_init_lock, &
      omp_lock_kind, omp_set_lock, omp_test_lock, omp_unset_lock
   use polydem_boxes, only: boxes_t
   use polydem_clock, only: wall_seconds
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, count_crossings, count_lock_waits, count_locks, count_passes, &
      phase_filter, phase_structure, phase_waiting
   use polydem_kinds, only: dp, ip, lp, wp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   use polydem_partitioned_sweep, only: share
   use polydem_sweep_ends, only: add_report, bytes_of, ends_t, place_ends, range_t, refresh_ends, report_t, sort_ends
   implicit none
   private
   public :: locked_sweep_t, mended_sweep_t, odd_even_sweep_t

   !> What one thread does in a step
   type :: part_t
      !> Changes and counts
      type(report_t) :: report
      !> Number of exchanges of the first pass
      integer(lp) :: first_swaps = 0_lp
      !> How often the thread took the lock, and how often it had to wait for it
      integer(lp) :: locks = 0_lp, lock_waits = 0_lp
      !> Whether the last even (0) and the last odd pass (1) exchanged ends
      logical :: moved(0:1) = .false.
      !> Time in the parallel region, and the part of it in which the thread waits [s]
      real(dp) :: seconds = 0.0_dp, waited = 0.0_dp
      !> Padding that puts the next part on another cache line
      real(dp) :: padding(8) = 0.0_dp
   end type part_t

   !> A sweep whose lists all threads sort together
   type, abstract, extends(finder_t) :: team_sweep_t
      private
      !> Ends of all boxes in x and in y
      type(ends_t) :: ends(2)
      !> Work of the threads, (thread)
      type(part_t), allocatable :: part(:)
      !> Bounds of the previous step, (4, box) [m]
      real(wp), allocatable :: before(:, :)
      !> Changes of the step in the list that all threads share
      type(pair_changes_t) :: shared
      !> Number of passes of the step
      integer(lp) :: passes = 0_lp
      !> Lock of the shared list
      integer(omp_lock_kind) :: lock = 0
   contains
      procedure :: find
      procedure :: survey
      procedure(sort_together), deferred :: sort_together
   end type team_sweep_t

   !> Odd-even transposition of single ends
   type, extends(team_sweep_t) :: odd_even_sweep_t
   contains
      procedure :: sort_together => transpose_ends
   end type odd_even_sweep_t

   !> Sort of parts with one list of changes under a lock
   type, extends(team_sweep_t) :: locked_sweep_t
   contains
      procedure :: sort_together => sort_with_lock
   end type locked_sweep_t

   !> Sort of parts, whose borders one thread repairs
   type, extends(team_sweep_t) :: mended_sweep_t
   contains
      procedure :: sort_together => sort_and_mend
   end type mended_sweep_t

   abstract interface
      !> Work of one thread: set the values of the ends and sort them together with the other threads. All threads have
      !> ended the last pass when it returns.
      subroutine sort_together(self, boxes, me, n_threads)
         import :: boxes_t, team_sweep_t
         class(team_sweep_t), intent(inout) :: self
         !> Boxes of this step
         type(boxes_t), intent(in) :: boxes
         !> Number of this thread, from 1, and number of threads
         integer, intent(in) :: me, n_threads
      end subroutine sort_together
   end interface

contains

   !> Sort the ends and record the changes that follow from exchanges of ends.
   subroutine find(self, boxes, changes)
      class(team_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer :: n_threads, p
      real(dp) :: began, worked

      if (.not. allocated(self%before)) call place_ends(boxes, .true., self%ends, self%before)
      if (allocated(self%part)) then
         if (size(self%part) /= omp_get_max_threads()) deallocate (self%part)
      end if
      if (.not. allocated(self%part)) allocate (self%part(omp_get_max_threads()))
      call self%shared%clear()
      call omp_init_lock(self%lock)
      n_threads = 1
      began = wall_seconds()
      !$omp parallel if (boxes%n > min_parallel_size) default(none) shared(self, boxes, n_threads)
      if (omp_get_thread_num() == 0) n_threads = omp_get_num_threads()
      call work_of_thread(self, boxes, omp_get_thread_num() + 1, omp_get_num_threads())
      !$omp end parallel
      worked = 0.0_dp
      do p = 1, n_threads
         worked = worked + (self%part(p)%seconds - self%part(p)%waited)
      end do
      self%work%seconds(phase_waiting) = self%work%seconds(phase_waiting) + &
         (wall_seconds() - began - worked/real(n_threads, dp))
      call self%work%lap(phase_structure)
      call omp_destroy_lock(self%lock)
      call changes%append(self%shared)
      do p = 1, n_threads
         call add_report(self%part(p)%report, changes, self%work)
         call self%work%add(count_crossings, self%part(p)%report%swaps - self%part(p)%first_swaps)
         call self%work%add(count_locks, self%part(p)%locks)
         call self%work%add(count_lock_waits, self%part(p)%lock_waits)
      end do
      call self%work%add(count_passes, self%passes)
      call self%work%lap(phase_filter)
   end subroutine find

   !> Sort the ends as one of several threads, and keep the bounds of a share of the boxes for the next step.
   subroutine work_of_thread(self, boxes, me, n_threads)
      class(team_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer, intent(in) :: me, n_threads
      real(dp) :: began
      integer(ip) :: b

      began = wall_seconds()
      associate (mine => self%part(me))
         call mine%report%clear()
         mine%locks = 0_lp
         mine%lock_waits = 0_lp
         mine%waited = 0.0_dp
         call self%sort_together(boxes, me, n_threads)
         do b = share(me - 1, n_threads, boxes%n) + 1_ip, share(me, n_threads, boxes%n)
            self%before(:, b) = boxes%bounds(:, b)
         end do
         mine%seconds = wall_seconds() - began
      end associate
   end subroutine work_of_thread

   !> Exchange neighbouring ends that are out of order, in odd and in even places in turns.
   subroutine transpose_ends(self, boxes, me, n_threads)
      class(odd_even_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer, intent(in) :: me, n_threads
      integer(ip) :: pass, k, first, last
      logical :: moved, was_quiet
      integer :: a

      first = 2_ip*share(me - 1, n_threads, boxes%n) + 1_ip
      last = 2_ip*share(me, n_threads, boxes%n)
      do a = 1, 2
         call refresh_ends(a, first, last, boxes, self%ends(a))
      end do
      pass = 0_ip
      moved = .true.
      do
         pass = pass + 1_ip
         was_quiet = .not. moved
         moved = .false.
         do a = 1, 2
            ! The last pair of an even pass joins the last end of a thread to the first of the next one.
            do k = first + merge(0_ip, 1_ip, is_odd(pass)), min(last, 2_ip*boxes%n - 1_ip), 2_ip
               if (self%ends(a)%value(k) < self%ends(a)%value(k + 1_ip)) cycle
               call sort_range(self, boxes, me, range_t(a, k, k + 1_ip, k + 1_ip), moved)
            end do
         end do
         call end_pass(self, me, n_threads, pass, moved)
         if (was_quiet .and. .not. moved) exit
      end do
   end subroutine transpose_ends

   !> Sort the parts of the thread, shifted in every other pass, and put the changes into the shared list under a lock.
   subroutine sort_with_lock(self, boxes, me, n_threads)
      class(locked_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer, intent(in) :: me, n_threads
      integer(ip) :: pass, k, low, high
      integer :: a, shift
      logical :: moved

      pass = 0_ip
      do
         pass = pass + 1_ip
         shift = merge(0, 1, is_odd(pass))
         low = share(2*(me - 1) + shift, 2*n_threads, 2_ip*boxes%n) + 1_ip
         high = share(min(2*me + shift, 2*n_threads), 2*n_threads, 2_ip*boxes%n)
         moved = .false.
         do a = 1, 2
            if (pass == 1_ip) call refresh_ends(a, low, high, boxes, self%ends(a))
            do k = low + 1_ip, high
               if (self%ends(a)%value(k - 1_ip) < self%ends(a)%value(k)) cycle
               call sort_range(self, boxes, me, range_t(a, low, k, k), moved)
               if (self%part(me)%report%changes%n > 0_ip) call publish(self%lock, self%part(me), self%shared)
            end do
         end do
         call end_pass(self, me, n_threads, pass, moved)
         if (n_threads == 1 .or. (pass > 1_ip .and. .not. moved)) exit
      end do
   end subroutine sort_with_lock

   !> Move the changes of a thread to the list that all share, under its lock.
   subroutine publish(lock, part, shared)
      integer(omp_lock_kind), intent(inout) :: lock
      type(part_t), intent(inout) :: part
      type(pair_changes_t), intent(inout) :: shared
      real(dp) :: since

      part%locks = part%locks + 1_lp
      if (.not. omp_test_lock(lock)) then
         part%lock_waits = part%lock_waits + 1_lp
         since = wall_seconds()
         call omp_set_lock(lock)
         part%waited = part%waited + (wall_seconds() - since)
      end if
      call shared%append(part%report%changes)
      call omp_unset_lock(lock)
      call part%report%changes%clear()
   end subroutine publish

   !> Sort the part of the thread; then the first thread merges all parts, one after the other.
   subroutine sort_and_mend(self, boxes, me, n_threads)
      class(mended_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer, intent(in) :: me, n_threads
      integer(ip) :: low, high
      logical :: moved
      integer :: a, p

      low = share(me - 1, n_threads, 2_ip*boxes%n) + 1_ip
      high = share(me, n_threads, 2_ip*boxes%n)
      moved = .false.
      do a = 1, 2
         call refresh_ends(a, low, high, boxes, self%ends(a))
         call sort_range(self, boxes, me, range_t(a, low, low + 1_ip, high), moved)
      end do
      call end_pass(self, me, n_threads, 1_ip, moved)
      if (n_threads == 1) return
      if (me == 1) then
         do p = 2, n_threads
            low = share(p - 1, n_threads, 2_ip*boxes%n) + 1_ip
            high = share(p, n_threads, 2_ip*boxes%n)
            do a = 1, 2
               call sort_range(self, boxes, me, range_t(a, 1_ip, low, high, two_runs=.true.), moved)
            end do
         end do
      end if
      call end_pass(self, me, n_threads, 2_ip, moved)
   end subroutine sort_and_mend

   !> Sort a range of ends; `moved` becomes true if ends are exchanged.
   subroutine sort_range(self, boxes, me, range, moved)
      class(team_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer, intent(in) :: me
      type(range_t), intent(in) :: range
      logical, intent(inout) :: moved
      integer(ip) :: places(2)

      call sort_ends(range, self%work%thorough, boxes, self%before, self%ends(range%axis), self%part(me)%report, places)
      moved = moved .or. places(2) > 0_ip
   end subroutine sort_range

   !> Wait until all threads have ended a pass. On return `moved` says whether any of them has exchanged ends.
   subroutine end_pass(self, me, n_threads, pass, moved)
      class(team_sweep_t), intent(inout) :: self
      integer, intent(in) :: me, n_threads
      integer(ip), intent(in) :: pass
      logical, intent(inout) :: moved
      real(dp) :: since
      integer :: p

      if (pass == 1_ip) self%part(me)%first_swaps = self%part(me)%report%swaps
      self%part(me)%moved(iand(pass, 1_ip)) = moved
      if (me == 1) self%passes = int(pass, lp)
      since = wall_seconds()
      !$omp barrier
      self%part(me)%waited = self%part(me)%waited + (wall_seconds() - since)
      moved = .false.
      do p = 1, n_threads
         moved = moved .or. self%part(p)%moved(iand(pass, 1_ip))
      end do
   end subroutine end_pass

   !> Whether a number is odd
   pure logical function is_odd(k)
      integer(ip), intent(in) :: k

      is_odd = iand(k, 1_ip) == 1_ip
   end function is_odd

   !> Set the counter of memory [B]: ends, bounds of the previous step, parts with their changes.
   subroutine survey(self)
      class(team_sweep_t), intent(inout) :: self
      integer :: p

      if (.not. allocated(self%before)) return
      self%work%value(count_bytes) = bytes_of(self%ends, self%before) + self%shared%bytes() + &
         size(self%part, kind=lp)*int(storage_size(self%part)/8, lp)
      do p = 1, size(self%part)
         self%work%value(count_bytes) = self%work%value(count_bytes) + self%part(p)%report%changes%bytes()
      end do
   end subroutine survey

end module polydem_obvious_sweeps
