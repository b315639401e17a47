!> Work of several threads: parts of a range, and the changes that each thread records.
module polydem_thread_changes
   use omp_lib, only: omp_get_max_threads
   use polydem_kinds, only: ip, lp
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: thread_changes_t, part

   !> Changes of a step by thread
   type :: thread_changes_t
      !> Changes that each thread recorded, (thread)
      type(pair_changes_t), allocatable :: of(:)
   contains
      procedure :: clear
      procedure :: n_threads
      procedure :: join
   end type thread_changes_t

contains

   !> Make one empty list per thread.
   subroutine clear(self)
      class(thread_changes_t), intent(inout) :: self
      integer :: w

      if (allocated(self%of)) then
         if (size(self%of) /= omp_get_max_threads()) deallocate (self%of)
      end if
      if (.not. allocated(self%of)) allocate (self%of(omp_get_max_threads()))
      do w = 1, size(self%of)
         call self%of(w)%clear()
      end do
   end subroutine clear

   !> Number of threads
   pure integer function n_threads(self)
      class(thread_changes_t), intent(in) :: self

      n_threads = size(self%of)
   end function n_threads

   !> Append the changes of all threads to a list.
   pure subroutine join(self, changes)
      class(thread_changes_t), intent(in) :: self
      !> List of changes
      type(pair_changes_t), intent(inout) :: changes
      integer :: w

      do w = 1, size(self%of)
         call changes%append(self%of(w))
      end do
   end subroutine join

   !> Split the range 1..n into m parts of equal size and return part w.
   pure subroutine part(n, m, w, low, high)
      !> End of the range
      integer(ip), intent(in) :: n
      !> Number of parts, and number of the part, from 1
      integer, intent(in) :: m, w
      !> First and last element of the part
      integer(ip), intent(out) :: low, high

      low = int((int(n, lp)*int(w - 1, lp))/int(m, lp), ip) + 1_ip
      high = int((int(n, lp)*int(w, lp))/int(m, lp), ip)
   end subroutine part

end module polydem_thread_changes
