!> What the guards of a monitor found.
module guard_findings
   use polydem_kinds, only: wp
   use polydem_monitor, only: monitor_t
   use polydem_step_guard, only: step_guard_t
   implicit none
   private
   public :: greatest_share, warnings_of

contains

   !> Greatest dt / stable dt so far
   pure real(wp) function greatest_share(monitor)
      type(monitor_t), intent(in) :: monitor
      integer :: k

      greatest_share = -1.0_wp
      do k = 1, size(monitor%list)
         select type (guard => monitor%list(k)%guard)
         type is (step_guard_t)
            greatest_share = guard%greatest
         end select
      end do
   end function greatest_share

   !> Number of warnings of the guard of an entry
   integer function warnings_of(monitor, name)
      type(monitor_t), intent(in) :: monitor
      character(len=*), intent(in) :: name
      integer :: k

      warnings_of = -1
      do k = 1, size(monitor%list)
         if (monitor%list(k)%guard%name == name) warnings_of = int(monitor%list(k)%guard%warning%count)
      end do
   end function warnings_of

end module guard_findings
