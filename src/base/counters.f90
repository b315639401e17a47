!> Named integer counters (pairs, contacts, swaps, nodes, ...) that the stages of a run report.
!>
!> Each stage counts in integers of its own and copies the sums into `counters_t` on request. Counting therefore costs
!> one addition and no search by name.
module polydem_counters
   use polydem_kinds, only: lp
   use polydem_strings, only: index_of
   implicit none
   private
   public :: counters_t, counter_name_length, at_end, at_start, over_steps, greatest_step

   !> Maximum length of the name of a counter
   integer, parameter :: counter_name_length = 32

   !> What a value belongs to: the state at the end or at the start, the sum over all steps, or their greatest value
   character(len=*), parameter :: at_end = 'at end', at_start = 'at the start', over_steps = 'summed over steps', &
      greatest_step = 'greatest of a step'
   !> Length of the longest of these texts
   integer, parameter :: scope_length = 18

   !> A list of names and values, in the order in which they were set
   type :: counters_t
      !> Names, as in the output
      character(len=counter_name_length), allocatable :: name(:)
      !> Values
      integer(lp), allocatable :: value(:)
      !> What each value belongs to
      character(len=scope_length), allocatable :: scope(:)
   contains
      procedure :: set
      procedure :: get
   end type counters_t

contains

   !> Set a counter. A new name is appended.
   subroutine set(self, name, value, scope)
      class(counters_t), intent(inout) :: self
      !> Name of the counter, at most counter_name_length characters
      character(len=*), intent(in) :: name
      !> Value of the counter
      integer(lp), intent(in) :: value
      !> What the value belongs to: at_end (if absent), at_start, over_steps or greatest_step
      character(len=*), intent(in), optional :: scope
      integer :: k

      if (.not. allocated(self%name)) allocate (self%name(0), self%value(0), self%scope(0))
      k = index_of(name, self%name)
      if (k == 0) then
         self%name = [character(len=counter_name_length) :: self%name, name]
         self%value = [self%value, value]
         self%scope = [character(len=scope_length) :: self%scope, at_end]
         k = size(self%name)
      end if
      self%value(k) = value
      self%scope(k) = at_end
      if (present(scope)) self%scope(k) = scope
   end subroutine set

   !> Value of a counter; zero if it was never set
   integer(lp) function get(self, name)
      class(counters_t), intent(in) :: self
      !> Name of the counter
      character(len=*), intent(in) :: name
      integer :: k

      get = 0_lp
      if (.not. allocated(self%name)) return
      k = index_of(name, self%name)
      if (k > 0) get = self%value(k)
   end function get

end module polydem_counters
