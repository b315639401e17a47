!> The guards of a run.
module polydem_guard_list
   use polydem_displacement_guard, only: displacement_guard_t
   use polydem_energy_guard, only: energy_guard_t
   use polydem_guard, only: guard_t
   use polydem_overlap_guard, only: overlap_guard_t
   use polydem_step_guard, only: step_guard_t
   use polydem_tunnelling_guard, only: tunnelling_guard_t
   implicit none
   private
   public :: listed_guard_t, list_guards

   !> A guard of any kind
   type :: listed_guard_t
      !> The guard
      class(guard_t), allocatable :: guard
   end type listed_guard_t

contains

   !> List all guards, also those that are off.
   subroutine list_guards(list)
      !> The guards in the order of their checks
      type(listed_guard_t), allocatable, intent(out) :: list(:)

      allocate (list(0))
      call add('displacement', displacement_guard_t())
      call add('overlap', overlap_guard_t())
      call add('tunnelling', tunnelling_guard_t())
      call add('step', step_guard_t())
      call add('energy', energy_guard_t())

   contains

      !> Append the guard of an entry of &guards.
      subroutine add(name, guard)
         character(len=*), intent(in) :: name
         class(guard_t), intent(in) :: guard
         type(listed_guard_t), allocatable :: longer(:)
         integer :: k

         allocate (longer(size(list) + 1))
         do k = 1, size(list)
            call move_alloc(list(k)%guard, longer(k)%guard)
         end do
         allocate (longer(size(longer))%guard, source=guard)
         longer(size(longer))%guard%name = name
         call move_alloc(longer, list)
      end subroutine add

   end subroutine list_guards

end module polydem_guard_list
