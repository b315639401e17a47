!> What the guards of a simulation found.
module guard_findings
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   use polydem_step_guard, only: step_guard_t
   implicit none
   private
   public :: greatest_share, warnings_of

contains

   !> Greatest dt / stable dt so far
   pure real(wp) function greatest_share(simulation)
      type(simulation_t), intent(in) :: simulation
      integer :: k

      greatest_share = -1.0_wp
      do k = 1, size(simulation%guards)
         select type (guard => simulation%guards(k)%guard)
         type is (step_guard_t)
            greatest_share = guard%greatest
         end select
      end do
   end function greatest_share

   !> Number of warnings of the guard of an entry
   integer function warnings_of(simulation, name)
      type(simulation_t), intent(in) :: simulation
      character(len=*), intent(in) :: name
      integer :: k

      warnings_of = -1
      do k = 1, size(simulation%guards)
         if (simulation%guards(k)%guard%name == name) warnings_of = int(simulation%guards(k)%guard%warning%count)
      end do
   end function warnings_of

end module guard_findings
