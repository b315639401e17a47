!> The duration of a run: given, or the sum of the longest durations of its stages; and the numbers of these.
module polydem_run_duration
   use polydem_kinds, only: ip, wp
   use polydem_settings, only: settings_t, stage_settings_t
   implicit none
   private
   public :: longest_run, longest_stage, number_of_stage

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

   !> Number of the stage with a name; 0 without a name
   pure integer(ip) function number_of_stage(settings, name) result(number)
      type(settings_t), intent(in) :: settings
      !> Its name, or an empty text
      character(len=*), intent(in) :: name
      integer(ip) :: k

      number = 0_ip
      do k = 1_ip, size(settings%stage, kind=ip)
         if (name /= '' .and. settings%stage(k)%name == name) number = k
      end do
   end function number_of_stage

end module polydem_run_duration
