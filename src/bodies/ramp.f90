!> A window of time in which something acts, and the ramp in it.
!>
!> A ramp rises smoothly from 0 to 1 as s(u) = u^2 (3 - 2 u) with u = (t - start)/ramp; the integral of s is
!> u^3 - u^4/2. Before the end it may fall in the same way. From then on a velocity is 0 and the displacement the last
!> one, which follows from the time within the window and therefore needs no memory.
module polydem_ramp
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: window_t, ramp_t, new_window

   !> Window of time
   type :: window_t
      !> Times between which it is open [s]
      real(wp) :: start = 0.0_wp, end = huge(1.0_wp)
      !> Time from the start to the full value [s]
      real(wp) :: ramp = 0.0_wp
      !> Time before the end in which the value falls to 0; 0 if it stops at once, or if the end was not known at the
      !> start of the run [s]
      real(wp) :: ramp_down = 0.0_wp
      !> Number of the stage of the run that sets start and end; 0: it depends on no stage
      integer(ip) :: stage = 0_ip
   contains
      procedure, non_overridable :: is_open
      procedure, non_overridable :: ramp_at
   end type window_t

   !> Ramp of a window at a time
   type :: ramp_t
      !> Integral of the factor from the start of the window [s]
      real(wp) :: elapsed = 0.0_wp
      !> Fraction of the full value
      real(wp) :: factor = 0.0_wp
      !> Derivative of the factor [1/s]
      real(wp) :: growth = 0.0_wp
   end type ramp_t

contains

   !> The window that entries of the namelist describe
   elemental type(window_t) function new_window(start, end, ramp, stage) result(window)
      !> Start, end (0: none), and time in which the value grows [s]
      real(wp), intent(in) :: start, end, ramp
      !> Number of the stage; 0: none. The window opens when its stage begins
      integer(ip), intent(in) :: stage

      window%start = merge(huge(1.0_wp), start, stage > 0_ip)
      if (end > 0.0_wp) window%end = end
      window%ramp = ramp
      window%stage = stage
   end function new_window

   !> Whether a time is within the window
   elemental logical function is_open(self, time)
      class(window_t), intent(in) :: self
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time

      is_open = time >= self%start .and. time < self%end
   end function is_open

   !> The ramp at a time; 0 before the start, and its factor 0 from the end on
   elemental type(ramp_t) function ramp_at(self, time) result(ramp)
      class(window_t), intent(in) :: self
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      real(wp) :: u

      if (time < self%start) return
      ramp = rise_at(self%start, self%ramp, min(time, self%end - self%ramp_down))
      if (time <= self%end - self%ramp_down .and. time < self%end) return
      u = 0.0_wp
      if (self%ramp_down > 0.0_wp) u = max(0.0_wp, (self%end - time)/self%ramp_down)
      ramp = ramp_t(ramp%elapsed + self%ramp_down*(0.5_wp - u*u*u*(1.0_wp - 0.5_wp*u)), u*u*(3.0_wp - 2.0_wp*u), 0.0_wp)
      if (u > 0.0_wp) ramp%growth = -6.0_wp*u*(1.0_wp - u)/self%ramp_down
   end function ramp_at

   !> The ramp of a window without an end
   elemental type(ramp_t) function rise_at(start, length, time) result(ramp)
      !> Start of the window, and time to the full value [s]
      real(wp), intent(in) :: start, length
      !> Time since the start of the run, not before the start of the window [s]
      real(wp), intent(in) :: time
      real(wp) :: u

      if (time - start >= length) then
         ramp = ramp_t(time - start - 0.5_wp*length, 1.0_wp, 0.0_wp)
      else
         u = (time - start)/length
         ramp = ramp_t(length*u*u*u*(1.0_wp - 0.5_wp*u), u*u*(3.0_wp - 2.0_wp*u), 6.0_wp*u*(1.0_wp - u)/length)
      end if
   end function rise_at

end module polydem_ramp
