!> Sort-and-sweep whose lists of ends are sorted by all threads together.
!>
!> Krengel et al. (2026, section 4.1) report that their attempts at it failed, after Tenhagen and Matuttis
!> (2013). This is the attempt made as well as we can, to see what fails. The list of each axis is cut into one
!> part per thread. Pass 1: every thread gives the ends of its parts their new values and sorts them. Ends
!> that must cross the border of two parts remain. Pass 2 shifts the parts by half of their length, so that
!> the borders lie in their middle, and merges the two sorted halves of each; pass 3 has the first parts
!> again, and so on, which is odd-even transposition of blocks (Knuth 1998, section 5.3.4). The last pass is
!> the one that leaves the first and the last end of all its parts where they are: the neighbours beyond were
!> in order before it. A merge looks at no more than the ends that move, and one more.
!>
!> Only neighbours are exchanged and only if they are in the wrong order, so exchanges and changes are those
!> of `sort_and_sweep`. Crossings are those exchanges that the first pass could not make.
!>
!> What limits it: all threads must wait for one another after every pass, two times in nearly every step. The
!> sorting of a part takes some ten microseconds and less with every further thread, the waiting does not; and a
!> thread that the system stops makes all others wait, which is what happens where there are more threads than
!> free processors. What one thread does for all (joining and ordering the changes, merging them into the list)
!> is little. Ends that cross borders, the reason why the list does not simply fall into parts, are few, since ends move
!> by a few places per step; they cost the second pass, not its work. Threads share no line of memory that
!> is written but those at the borders.
!>
!> The time that a thread does not work while the lists are sorted, from the start of the threads to the end of the
!> last, is booked as waiting, as the mean over the threads. A thread that works but is stopped by the system counts
!> as working.
module polydem_partitioned_sweep
   use omp_lib, only: omp_get_max_threads, omp_get_num_threads, omp_get_thread_num
   use polydem_boxes, only: boxes_t
   use polydem_clock, only: wall_seconds
   use polydem_finder, only: finder_t
   use polydem_kinds, only: dp, ip, lp, wp, worth_threads
   use polydem_pair_changes, only: pair_changes_t
   use polydem_sweep_ends, only: bytes_of, ends_t, hand_over, place_ends, refresh_ends, report_t, sort_ends
   use polydem_work, only: count_bytes, count_crossings, count_passes, phase_filter, phase_structure, phase_waiting
   implicit none
   private
   public :: partitioned_sweep_t

   !> One part of the lists of both axes, and what the thread that sorts it has to tell
   type :: part_t
      !> Changes and counts of the step
      type(report_t) :: report
      !> Exchanges of the step in passes after the first
      integer(lp) :: crossings = 0_lp
      !> Whether the first or the last end of the part was replaced, in even and in odd passes
      logical :: at_rim(0:1) = .false.
      !> Time of the step that the thread whose first part this is has worked [s]
      real(dp) :: busy = 0.0_dp
      !> Keeps the next part on another line of memory
      real(dp) :: padding(8) = 0.0_dp
   end type part_t

   !> Finder that keeps the ends of boxes sorted
   type, extends(finder_t) :: partitioned_sweep_t
      private
      !> Ends of all boxes in x and in y
      type(ends_t) :: ends(2)
      !> Parts of both lists
      type(part_t), allocatable :: part(:)
      !> Bounds of the step before, (4, box) [m]
      real(wp), allocatable :: before(:, :)
   contains
      procedure :: find
      procedure :: survey
   end type partitioned_sweep_t

contains

   !> Sort the ends again and record the changes that their exchanges show.
   subroutine find(self, boxes, changes)
      class(partitioned_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: passes, p
      integer :: team
      real(dp) :: began

      call prepare(self, boxes)
      began = wall_seconds()
      !$omp parallel if (boxes%n > worth_threads) default(none) shared(self, boxes, passes, team)
      call sort_together(self, boxes, omp_get_thread_num(), omp_get_num_threads(), passes, team)
      !$omp end parallel
      self%work%seconds(phase_waiting) = self%work%seconds(phase_waiting) + &
         (wall_seconds() - began - total_busy(self%part)/real(team, dp))
      call self%work%lap(phase_structure)
      do p = 1_ip, size(self%part, kind=ip)
         call hand_over(self%part(p)%report, changes, self%work)
         call self%work%add(count_crossings, self%part(p)%crossings)
      end do
      call self%work%add(count_passes, int(passes, lp))
      call self%work%lap(phase_filter)
   end subroutine find

   !> Place the ends before the first step; make as many parts as there may be threads, but none of less than two ends.
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

   !> What one thread of a team does: its parts, pass by pass, until no thread can have left anything to sort.
   subroutine sort_together(self, boxes, me, team, passes, team_size)
      type(partitioned_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      !> Number of this thread, from 0 on; threads of the team
      integer, intent(in) :: me, team
      !> Passes made and threads of the team, told by thread 0
      integer(ip), intent(inout) :: passes
      integer, intent(inout) :: team_size
      integer(ip) :: pass, p, low, high
      real(dp) :: since, busy

      low = share(me, team, size(self%part, kind=ip)) + 1_ip
      high = share(me + 1, team, size(self%part, kind=ip))
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
      do p = share(me, team, boxes%n) + 1_ip, share(me + 1, team, boxes%n)
         self%before(:, p) = boxes%bounds(:, p)
      end do
      do p = low, high
         self%part(p)%busy = 0.0_dp
      end do
      if (me == 0) passes = pass
      if (me == 0) team_size = team
      if (low <= high) self%part(low)%busy = busy + (wall_seconds() - since)
   end subroutine sort_together

   !> Do one pass over one part of both lists. In even passes the part goes from the middle of the original part to the
   !> middle of the next; the last one has no next and rests.
   subroutine sort_part(self, boxes, p, pass)
      type(partitioned_sweep_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      integer(ip), intent(in) :: p, pass
      integer(ip) :: low, middle, high, moved(2)
      integer(lp) :: swaps
      logical :: at_rim
      integer :: a

      at_rim = .false.
      swaps = self%part(p)%report%swaps
      if (pass == 1_ip) call self%part(p)%report%clear()
      call limits(p, pass, size(self%part, kind=ip), 2_ip*boxes%n, low, middle, high)
      do a = 1, 2
         if (pass == 1_ip) call refresh_ends(a, low, high, boxes, self%ends(a))
         call sort_ends(a, low, merge(low, middle, pass == 1_ip) + 1_ip, high, pass > 1_ip, self%work%thorough, boxes, &
                        self%before, self%ends(a), self%part(p)%report, moved)
         at_rim = at_rim .or. moved(1) == low .or. moved(2) == high
      end do
      self%part(p)%at_rim(iand(pass, 1_ip)) = at_rim
      if (pass == 1_ip) then
         self%part(p)%crossings = 0_lp
      else
         self%part(p)%crossings = self%part(p)%crossings + (self%part(p)%report%swaps - swaps)
      end if
   end subroutine sort_part

   !> Places of a part in a pass: the first, the last of its lower half, the last.
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

   pure integer(ip) function half_way(low, high)
      integer(ip), intent(in) :: low, high

      half_way = low + (high - low)/2_ip
   end function half_way

   !> How many of n things the first k of several equal shares hold
   pure integer(ip) function share(k, shares, n)
      integer, intent(in) :: k, shares
      integer(ip), intent(in) :: n

      share = int(int(k, lp)*int(n, lp)/int(shares, lp), ip)
   end function share

   !> Whether a pass, all of whose parts are sorted now, has left the borders of its parts in order
   pure logical function is_sorted_after(part, pass)
      type(part_t), intent(in) :: part(:)
      integer(ip), intent(in) :: pass
      integer :: p

      is_sorted_after = size(part) == 1
      if (pass == 1_ip) return
      do p = 1, size(part)
         if (part(p)%at_rim(iand(pass, 1_ip))) return
      end do
      is_sorted_after = .true.
   end function is_sorted_after

   !> Seconds that all threads together have worked in this step
   pure real(dp) function total_busy(part)
      type(part_t), intent(in) :: part(:)
      integer :: p

      total_busy = 0.0_dp
      do p = 1, size(part)
         total_busy = total_busy + part(p)%busy
      end do
   end function total_busy

   !> Memory held: ends, bounds of the step before, parts with their changes.
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
