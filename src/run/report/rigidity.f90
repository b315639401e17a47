!> How near to rigid bodies a scene is: the least stiffness over its pressures, and what that means for its force law.
!>
!> The errors are fits c (P/E)^n to runs of two problems with known rigid answers: the angular velocity of a block of
!> 1 x 4 that topples under its own weight, where P is that of four blocks, and the velocity of a square after an
!> elastic impact on its corner, where P is density times speed squared (page of the verification).
module polydem_rigidity
   use polydem_kinds, only: ip, wp
   use polydem_log, only: log_t
   use polydem_scene_measures, only: scene_measures_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: describe_rigidity, tipping_error, impact_error

   !> Coefficient and exponent of the errors of a law
   type :: fit_t
      !> Name in &forces
      character(len=15) :: law
      !> Coefficient and exponent of tipping, (2)
      real(wp) :: tipping(2)
      !> Those of an impact on a corner, (2)
      real(wp) :: impact(2)
   end type fit_t

   real(wp), parameter :: third = 1.0_wp/3.0_wp
   !> Fits of all laws
   type(fit_t), parameter :: fits(5) = [ &
      fit_t('polar', [10.5_wp, 1.0_wp], [3.0_wp, 0.5_wp]), &
      fit_t('effective_polar', [9.5_wp, 1.0_wp], [2.8_wp, 0.5_wp]), &
      fit_t('conservative', [2.9_wp, 0.25_wp], [1.8_wp, 0.25_wp]), &
      fit_t('area', [2.9_wp, third], [0.53_wp, third]), &
      fit_t('own_length', [2.84_wp, third], [0.44_wp, third])]

contains

   !> Write the stiffness over the static pressure and over that of impacts, with the errors to expect.
   subroutine describe_rigidity(simulation, measures, log)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(log_t), intent(inout) :: log
      character(len=:), allocatable :: text

      if (measures%free == 0_ip) return
      associate (s => simulation, law => simulation%settings%forces%law)
         text = 'stiffness  E = '//to_text(measures%stiffness, 3)//' N/m2'
         if (measures%softness > 0.0_wp) text = text//', '//to_text(1.0_wp/measures%softness, 2)// &
            ' times the static pressure '//to_text(s%pressure%greatest, 2)//' N/m2 '//s%pressure%origin// &
            ': faces '//to_text(measures%softness, 2)//' of a grain deep, error of tipping '// &
            share_text(tipping_error(law, measures%softness))
         call log%write_line(text)
         if (measures%impact_softness > 0.0_wp) call log%write_line('           '// &
            to_text(1.0_wp/measures%impact_softness, 2)//' times the pressure of impacts at '// &
            to_text(s%expected%speed, 3)//' m/s: error of an elastic impact on a corner '// &
            share_text(impact_error(law, measures%impact_softness)))
      end associate
   end subroutine describe_rigidity

   !> Error of the angular velocity of a block that topples, relative to the rigid one
   pure real(wp) function tipping_error(law, softness)
      !> Name of the elastic law
      character(len=*), intent(in) :: law
      !> Static pressure over stiffness
      real(wp), intent(in) :: softness
      integer :: k

      tipping_error = 0.0_wp
      do k = 1, size(fits)
         if (fits(k)%law == law) tipping_error = fits(k)%tipping(1)*softness**fits(k)%tipping(2)
      end do
   end function tipping_error

   !> Error of the velocity after an impact on a corner, over the speed of the impact
   pure real(wp) function impact_error(law, softness)
      !> Name of the elastic law
      character(len=*), intent(in) :: law
      !> Pressure of the impact over stiffness
      real(wp), intent(in) :: softness
      integer :: k

      impact_error = 0.0_wp
      do k = 1, size(fits)
         if (fits(k)%law == law) impact_error = fits(k)%impact(1)*softness**fits(k)%impact(2)
      end do
   end function impact_error

   !> An error as text: in per cent with one digit
   pure function share_text(error) result(text)
      !> Error as a share
      real(wp), intent(in) :: error
      character(len=:), allocatable :: text
      integer(ip) :: decade

      if (error > 1.0_wp) then
         text = 'above 100 %: far from rigid'
      else if (error >= 0.1_wp) then
         text = 'about '//to_text(10_ip*nint(10.0_wp*error, ip))//' %'
      else if (error >= 0.0095_wp) then
         text = 'about '//to_text(nint(100.0_wp*error, ip))//' %'
      else if (error >= 0.00095_wp) then
         decade = nint(1000.0_wp*error, ip)
         text = 'about 0.'//to_text(decade)//' %'
      else
         text = 'about '//to_text(100.0_wp*error, 1)//' %'
      end if
   end function share_text

end module polydem_rigidity
