!> The duration of a run: given, or the sum of the longest durations of its stages.
module polydem_run_duration
   use polydem_kinds, only: wp
   use polydem_settings, only: settings_t, stage_settings_t
   implicit none
   private
   public :: longest_run, longest_stage

contains

   !> Longest simulated time of a run [s]
   pure real(wp) function longest_run(settings) result(duration)
      type(settings_t), intent(in) :: settings
      integer :: k

      duration = settings%integrate%duration
      if (size(settings%stage) > 0) duration = 0.0_wp
      do k = 1, size(settings%stage)
         duration = duration + longest_stage(settings%stage(k))
      end do
   end function longest_run

   !> Longest simulated time of a stage [s]
   pure real(wp) function longest_stage(stage) result(duration)
      !> The stage
      type(stage_settings_t), intent(in) :: stage

      duration = stage%longest
      if (stage%until == 'duration') duration = stage%duration
   end function longest_stage

end module polydem_run_duration
