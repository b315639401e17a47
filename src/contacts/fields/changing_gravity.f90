!> Gravity that changes with time, the same everywhere: it turns, and an oscillation is added.
!>
!> The constant part is that of `gravity`, whose potential the balance has. This is the rest: its work comes from
!> outside, like that of a moving wall. An oscillation is what grains feel in a container that shakes, seen from it.
module polydem_changing_gravity
   use polydem_elementary, only: sine_and_cosine, two_pi
   use polydem_kinds, only: wp
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: changing_gravity_t, changes_gravity, new_changing_gravity


   !> The part of gravity that is not constant
   type :: changing_gravity_t
      private
      !> Amplitude of the oscillation (2) [m/s2]
      real(wp) :: amplitude(2) = 0.0_wp
      !> Angular velocity of gravity, and angular frequency of the oscillation [1/s]
      real(wp) :: turn = 0.0_wp, frequency = 0.0_wp
   contains
      procedure :: acceleration
      procedure :: rate
   end type changing_gravity_t

contains

   !> Whether the settings ask for gravity that changes
   pure logical function changes_gravity(settings)
      type(forces_settings_t), intent(in) :: settings

      changes_gravity = any(abs(settings%shake) > 0.0_wp) .or. abs(settings%turn_rate) > 0.0_wp
   end function changes_gravity

   !> Gravity that changes as the settings say
   pure function new_changing_gravity(settings) result(changing)
      type(forces_settings_t), intent(in) :: settings
      type(changing_gravity_t) :: changing

      changing%amplitude = settings%shake
      changing%turn = two_pi*settings%turn_rate
      changing%frequency = two_pi*settings%shake_frequency
   end function new_changing_gravity

   !> Acceleration at a time, less the constant part (2) [m/s2]
   pure function acceleration(self, gravity, time)
      class(changing_gravity_t), intent(in) :: self
      !> Constant part: gravity before it turns (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Simulated time [s]
      real(wp), intent(in) :: time
      real(wp) :: acceleration(2), s, c

      call sine_and_cosine(self%turn*time, s, c)
      acceleration(1) = (c - 1.0_wp)*gravity(1) - s*gravity(2)
      acceleration(2) = (c - 1.0_wp)*gravity(2) + s*gravity(1)
      call sine_and_cosine(self%frequency*time, s, c)
      acceleration = acceleration + s*self%amplitude
   end function acceleration

   !> Greatest rate of change, which bounds the time step [1/s]
   pure real(wp) function rate(self)
      class(changing_gravity_t), intent(in) :: self

      rate = max(abs(self%turn), self%frequency)
   end function rate

end module polydem_changing_gravity
