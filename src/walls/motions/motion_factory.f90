!> Factory of prescribed motions: the list of all kinds.
module polydem_motion_factory
   use polydem_conveyor, only: conveyor_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_t
   use polydem_oscillation, only: oscillation_t
   use polydem_ramp, only: new_window
   use polydem_rotation, only: rotation_t
   use polydem_run_duration, only: number_of_stage
   use polydem_settings, only: settings_t
   use polydem_table_motion, only: table_motion_t
   use polydem_translation, only: translation_t
   implicit none
   private
   public :: new_motion

contains

   !> Create a motion. The time in which it starts is that in which it slows down before an end that is known.
   subroutine new_motion(settings, number, motion, error)
      !> All settings
      type(settings_t), intent(in) :: settings
      !> Number of the motion in them
      integer, intent(in) :: number
      class(motion_t), allocatable, intent(out) :: motion
      !> Allocated if what it reads is wrong; names the entry
      type(error_t), allocatable, intent(inout) :: error

      select case (settings%motion(number)%kind)
      case ('rotation')
         allocate (rotation_t :: motion)
      case ('translation')
         allocate (translation_t :: motion)
      case ('oscillation')
         allocate (oscillation_t :: motion)
      case ('conveyor')
         allocate (conveyor_t :: motion)
      case ('table')
         allocate (table_motion_t :: motion)
      case default
         call raise(error, input_error, 'there is no motion of the kind '//trim(settings%motion(number)%kind))
         return
      end select
      associate (given => settings%motion(number))
         motion%kind = trim(given%kind)
         motion%pivot = given%pivot
         motion%window_t = new_window(given%start, given%end, given%ramp, number_of_stage(settings, given%stage))
         if (given%end > 0.0_wp) motion%ramp_down = given%ramp
      end associate
      call motion%configure(settings, number, error)
   end subroutine new_motion

end module polydem_motion_factory
