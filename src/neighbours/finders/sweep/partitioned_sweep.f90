!> Parallel sort-and-sweep: all threads together sort each list of ends.
!>
!> Krengel et al. (2026, section 4.1) report that their attempts at this failed, after Tenhagen and Matuttis (2013).
!> This implementation is optimised as far as possible and shows the reasons. The list of each axis is split into one
!> part per thread. In pass 1, each thread sets the new values of the ends in its parts and sorts the parts. Ends that
!> must cross the border between two parts remain. Pass 2 shifts the parts by half of their length, so the old borders
!> lie in the middle of the new parts, and merges the two sorted halves of each part. Pass 3 uses the first parts again,
!> and so on. This is odd-even transposition of blocks (Knuth 1998, section 5.3.4). The sort is complete after a pass
!> that does not replace the first or the last end of any part, because the neighbouring ends beyond the borders were in
!> order before this pass. A merge accesses only the ends that move, and one more end.
!>
!> Only neighbours in the wrong order are exchanged, so exchanges and changes are the same as in `sort_and_sweep`.
!> Crossings are the exchanges that the first pass cannot make.
!>
!> Three things limit the speed-up. Each core fetches the boxes that other cores wrote. The parts have unequal work,
!> and all threads wait for the slowest after every pass, twice in nearly every step. With few threads these two cost
!> most. With many threads the waiting itself does: sorting a part takes some ten microseconds, and less with more
!> threads, but a barrier takes longer. A thread that the operating system suspends makes all others wait; this happens
!> if there are more threads than free processors. The serial work (joining and sorting the changes, merging them into
!> the list of pairs) is small. Few ends cross borders because ends move by a few places per step; these ends make the
!> second pass necessary but add little work. Threads write to shared cache lines only at the borders.
!>
!> The waiting time is the time in which a thread does not work, from the start of the threads to the end of the last
!> one, as the mean over the threads. A thread that the operating system suspends during work counts as working.
module polydem_partitioned_sweep
   use omp_lib, only: omp_get_max_threads, omp_get_num_threads, omp_get_thread_num
   use polydem_boxes, only: boxes_t
   use polydem_clock, only: wall_seconds
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: count_bytes, count_crossings, count_passes, phase_filter, phase_structure, &
      phase_waiting
   use polydem_kinds, only: dp, ip, lp, wp, min_parallel_size
   use polydem_pair_changes, only: pair_changes_t
   use polydem_sweep_ends, only: bytes_of, ends_t, add_report, place_ends, range_t, refresh_ends, report_t, &
      sort_ends
   implicit none
   private
   public :: partitioned_sweep_t, share

   !> One part of the lists of both axes, with the results of the thread that sorts it
   type :: part_t
      !> Changes and counts of the step
      type(report_t) :: report
      !> Number of exchanges of the step in passes after the first
      integer(lp) :: crossings = 0_lp
      !> Whether the last even (0) and the last odd pass (1) replaced the first or the last end of the part
      logical :: at_border(0:1) = .false.
      !> Working time in this step of the thread whose first part this is; 0 for other parts [s]
      real(dp) :: busy = 0.0_dp
      !> Padding that puts the next part on another cache line
      real(dp) :: padding(8) = 0.0_dp
   end type part_t

   !> Finder that stores the sorted ends of boxes
   type, extends(finder_t) :: partitioned_sweep_t
      private
      !> Ends of all boxes in x and in y
      type(ends_t) :: ends(2)
      !> Parts of both lists, (part)
      type(part_t), allocatable :: part(:)
      !> Bounds of the previous step, (4, box) [m]
      real(wp), allocatable :: before(:, :)
   contains
      procedure :: find
      procedure :: survey
   end type partitioned_sweep_t

contains

   !> Sort the ends and record the changes that follow from exchanges of ends.
   subroutine find(self, boxes, changes)
      class(partitioned_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: passes, p
      integer :: n_threads
      real(dp) :: began

      call prepare(self, boxes)
      began = wall_seconds()
      !$omp parallel if (boxes%n > min_parallel_size) default(none) shared(self, boxes, passes, n_threads)
      call sort_together(self, boxes, omp_get_thread_num(), omp_get_num_threads(), passes, n_threads)
      !$omp end parallel
      self%work%seconds(phase_waiting) = self%work%seconds(phase_waiting) + &
         (wall_seconds() - began - total_busy(self%part)/real(n_threads, dp))
      call self%work%lap(phase_structure)
      do p = 1_ip, size(self%part, kind=ip)
         call add_report(self%part(p)%report, changes, self%work)
         call self%work%add(count_crossings, self%part(p)%crossings)
      end do
      call self%work%add(count_passes, int(passes, lp))
      call self%work%lap(phase_filter)
   end subroutine find

   !> Place the ends before the first step. Make one part per thread, but no part with fewer than two ends.
   subroutine prepare(self, boxes)
      type(partitioned_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer :: parts

      if (.not. allocated(self%before)) call place_ends(boxes, .true., self%ends, self%before)
      parts = max(1, min(omp_get_max_threads(), int(boxes%n)))
      if (allocated(self%part)) then
         if (size(self%part) == parts) return
         deallocate (self%part)
      end if
      allocate (self%part(parts))
   end subroutine prepare

   !> Work of one thread: sort its parts, pass by pass, until the whole list is sorted.
   subroutine sort_together(self, boxes, me, n_threads, passes, threads_used)
      type(partitioned_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      !> Number of this thread, from 0, and number of threads
      integer, intent(in) :: me, n_threads
      !> Number of passes and number of threads; thread 0 sets them
      integer(ip), intent(inout) :: passes
      integer, intent(inout) :: threads_used
      integer(ip) :: pass, p, low, high
      real(dp) :: since, busy

      low = share(me, n_threads, size(self%part, kind=ip)) + 1_ip
      high = share(me + 1, n_threads, size(self%part, kind=ip))
      busy = 0.0_dp
      pass = 0_ip
      do
         since = wall_seconds()
         pass = pass + 1_ip
         do p = low, high
            call sort_part(self, boxes, p, pass)
         end do
         busy = busy + (wall_seconds() - since)
         !$omp barrier
         if (is_sorted_after(self%part, pass)) exit
      end do
      since = wall_seconds()
      do p = share(me, n_threads, boxes%n) + 1_ip, share(me + 1, n_threads, boxes%n)
         self%before(:, p) = boxes%bounds(:, p)
      end do
      do p = low, high
         self%part(p)%busy = 0.0_dp
      end do
      if (me == 0) passes = pass
      if (me == 0) threads_used = n_threads
      if (low <= high) self%part(low)%busy = busy + (wall_seconds() - since)
   end subroutine sort_together

   !> Do one pass over one part of both lists. In even passes the part extends from the middle of the original part to
   !> the middle of the next part; the last part has no next part and nothing to merge.
   subroutine sort_part(self, boxes, p, pass)
      type(partitioned_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: p, pass
      integer(ip) :: low, middle, high, moved(2)
      integer(lp) :: swaps
      logical :: at_border
      integer :: a

      at_border = .false.
      swaps = self%part(p)%report%swaps
      if (pass == 1_ip) call self%part(p)%report%clear()
      call limits(p, pass, size(self%part, kind=ip), 2_ip*boxes%n, low, middle, high)
      do a = 1, 2
         if (pass == 1_ip) call refresh_ends(a, low, high, boxes, self%ends(a))
         call sort_ends(range_t(a, low, merge(low, middle, pass == 1_ip) + 1_ip, high, pass > 1_ip), &
                        self%work%thorough, boxes, self%before, self%ends(a), self%part(p)%report, moved)
         at_border = at_border .or. moved(1) == low .or. moved(2) == high
      end do
      self%part(p)%at_border(iand(pass, 1_ip)) = at_border
      if (pass == 1_ip) then
         self%part(p)%crossings = 0_lp
      else
         self%part(p)%crossings = self%part(p)%crossings + (self%part(p)%report%swaps - swaps)
      end if
   end subroutine sort_part

   !> First place, last place of the lower half, and last place of a part in a pass.
   pure subroutine limits(p, pass, parts, n_ends, low, middle, high)
      integer(ip), intent(in) :: p, pass, parts, n_ends
      integer(ip), intent(out) :: low, middle, high
      integer(ip) :: border(-1:1)

      border = [share(int(p) - 1, int(parts), n_ends), share(int(p), int(parts), n_ends), &
                share(min(int(p), int(parts) - 1) + 1, int(parts), n_ends)]
      if (iand(pass, 1_ip) == 1_ip) then
         low = border(-1) + 1_ip
         middle = half_way(border(-1), border(0))
         high = border(0)
      else
         low = half_way(border(-1), border(0)) + 1_ip
         middle = border(0)
         high = half_way(border(0), border(1))
      end if
   end subroutine limits

   !> Middle of the range low..high
   pure integer(ip) function half_way(low, high)
      integer(ip), intent(in) :: low, high

      half_way = low + (high - low)/2_ip
   end function half_way

   !> Number of elements in the first k of several equal parts of n elements
   pure integer(ip) function share(k, shares, n)
      !> Number of parts to count, and of all parts
      integer, intent(in) :: k, shares
      !> Number of elements
      integer(ip), intent(in) :: n

      share = int(int(k, lp)*int(n, lp)/int(shares, lp), ip)
   end function share

   !> Whether the list is sorted after a pass: the pass did not replace the first or the last end of any part
   pure logical function is_sorted_after(part, pass)
      type(part_t), intent(in) :: part(:)
      integer(ip), intent(in) :: pass
      integer :: p

      is_sorted_after = size(part) == 1
      if (pass == 1_ip) return
      do p = 1, size(part)
         if (part(p)%at_border(iand(pass, 1_ip))) return
      end do
      is_sorted_after = .true.
   end function is_sorted_after

   !> Total working time of all threads in this step [s]
   pure real(dp) function total_busy(part)
      type(part_t), intent(in) :: part(:)
      integer :: p

      total_busy = 0.0_dp
      do p = 1, size(part)
         total_busy = total_busy + part(p)%busy
      end do
   end function total_busy

   !> Set the counter of memory [B]: ends, bounds of the previous step, parts with their changes.
   subroutine survey(self)
      class(partitioned_sweep_t), intent(inout) :: self
      integer(lp) :: bytes
      integer :: p

      if (.not. allocated(self%before)) return
      bytes = bytes_of(self%ends, self%before) + size(self%part, kind=lp)*int(storage_size(self%part)/8, lp)
      do p = 1, size(self%part)
         bytes = bytes + self%part(p)%report%changes%bytes()
      end do
      self%work%value(count_bytes) = bytes
   end subroutine survey

end module polydem_partitioned_sweep
