!> Lists of bodies for the passes over blocks of bodies, and runs of consecutive slots, which one plain loop can treat.
module polydem_body_runs
   use omp_lib, only: omp_get_max_threads
   use polydem_bodies, only: block_size
   use polydem_kinds, only: ip, min_parallel_size
   implicit none
   private
   public :: find_run, list_others, number_of_parts

contains

   !> Number of parts of the free bodies, one per thread; a single part if they are few
   integer function number_of_parts(n)
      !> Number of free bodies
      integer(ip), intent(in) :: n

      number_of_parts = 1
      if (n > min_parallel_size) number_of_parts = omp_get_max_threads()
   end function number_of_parts

   !> List those of some slots that are not excluded.
   pure subroutine list_others(n, slots, excluded, n_others, others)
      !> Number of slots
      integer(ip), intent(in) :: n
      !> The slots
      integer(ip), intent(in) :: slots(n)
      !> Whether each body is excluded, (slot)
      logical, intent(in), contiguous :: excluded(:)
      !> Number of the others
      integer(ip), intent(out) :: n_others
      !> Their slots
      integer(ip), intent(inout) :: others(block_size)
      integer(ip) :: k

      n_others = 0_ip
      do k = 1_ip, n
         if (excluded(slots(k))) cycle
         n_others = n_others + 1_ip
         others(n_others) = slots(k)
      end do
   end subroutine list_others

   !> Find the next run of consecutive slots in a list.
   pure subroutine find_run(slots, high, next, first, last)
      !> Index of the last slot that may belong to the run
      integer(ip), intent(in) :: high
      !> Ascending slots
      integer(ip), intent(in) :: slots(high)
      !> Index of the first slot of the run; on return that of the slot after the run
      integer(ip), intent(inout) :: next
      !> First and last slot of the run
      integer(ip), intent(out) :: first, last

      first = slots(next)
      last = first
      if (slots(high) - first == high - next) then
         last = slots(high)
         next = high + 1_ip
         return
      end if
      do next = next + 1_ip, high
         if (slots(next) /= last + 1_ip) exit
         last = slots(next)
      end do
   end subroutine find_run

end module polydem_body_runs
