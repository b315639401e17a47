!> How near to rigid bodies a scene is: the least stiffness over its pressures, and what that means for its force law.
!>
!> The errors are fits c (P/E)^n to two problems with known rigid answers: the steepest slope on which a block of 1 x 4
!> stands, where P is its weight over its width, and the velocity of a square after an elastic impact on its corner,
!> where P is density times speed squared. `test_rigidity` measures them.
module polydem_rigidity
   use polydem_elementary, only: exponential, logarithm
   use polydem_force_part, only: softness_fit_t
   use polydem_kinds, only: ip, wp
   use polydem_log, only: log_t
   use polydem_scene_measures, only: scene_measures_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: describe_rigidity, tipping_error, impact_error, share_text

contains

   !> Write the stiffness over the static pressure and over that of impacts, with the errors to expect.
   subroutine describe_rigidity(simulation, measures, log)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(log_t), intent(inout) :: log
      character(len=:), allocatable :: text

      if (measures%free == 0_ip) return
      associate (s => simulation, fit => simulation%law%fit)
         text = 'stiffness  E = '//to_text(measures%stiffness, 3)//' N/m2'
         if (measures%softness > 0.0_wp) text = text//', '//to_text(1.0_wp/measures%softness, 2)// &
            ' times the static pressure '//to_text(s%pressure%greatest, 2)//' N/m2 '//s%pressure%origin// &
            ': faces '//to_text(measures%softness, 2)//' of a grain deep, error of tipping '// &
            share_text(tipping_error(fit, measures%softness))
         call log%write_line(text)
         if (measures%impact_softness > 0.0_wp) call log%write_line('           '// &
            to_text(1.0_wp/measures%impact_softness, 2)//' times the pressure of impacts at '// &
            to_text(s%expected%speed, 3)//' m/s: error of an elastic impact on a corner '// &
            share_text(impact_error(fit, measures%impact_softness)))
      end associate
   end subroutine describe_rigidity

   !> Error of the tangent of the slope on which a block of 1 x 4 topples
   pure real(wp) function tipping_error(fit, softness)
      !> Fits of the force law
      type(softness_fit_t), intent(in) :: fit
      !> Static pressure over stiffness
      real(wp), intent(in) :: softness

      tipping_error = fitted(fit%tipping, softness)
   end function tipping_error

   !> Error of the velocity after an impact on a corner, over the speed of the impact
   pure real(wp) function impact_error(fit, softness)
      !> Fits of the force law
      type(softness_fit_t), intent(in) :: fit
      !> Pressure of the impact over stiffness
      real(wp), intent(in) :: softness

      impact_error = fitted(fit%impact, softness)
   end function impact_error

   !> A coefficient times a power with a real exponent
   pure real(wp) function fitted(fit, softness)
      !> Coefficient and exponent, (2)
      real(wp), intent(in) :: fit(2)
      real(wp), intent(in) :: softness

      fitted = fit(1)*exponential(fit(2)*logarithm(softness))
   end function fitted

   !> An error as text: in per cent with one digit; 0: it is not known
   pure function share_text(error) result(text)
      !> Error as a share
      real(wp), intent(in) :: error
      character(len=:), allocatable :: text

      if (.not. error > 0.0_wp) then
         text = 'not known'
      else if (error > 1.0_wp) then
         text = 'above 100 %, far from rigid'
      else if (error >= 0.1_wp) then
         text = 'about '//to_text(10_ip*nint(10.0_wp*error, ip))//' %'
      else if (error >= 0.0095_wp) then
         text = 'about '//to_text(nint(100.0_wp*error, ip))//' %'
      else if (error >= 0.00095_wp) then
         text = 'about 0.'//to_text(nint(1000.0_wp*error, ip))//' %'
      else
         text = 'about '//to_text(100.0_wp*error, 2)//' %'
      end if
   end function share_text

end module polydem_rigidity
