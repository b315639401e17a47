!> Force of Magnus on a body that spins in a medium at rest: c m omega times the velocity, turned by a right angle. It
!> does no work; the velocity turns with the rate c omega.
module polydem_magnus_force
   use polydem_bodies, only: bodies_t, block_size
   use polydem_body_force, only: body_force_t
   use polydem_kinds, only: ip, wp
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: magnus_force_t

   !> Force of Magnus
   type, extends(body_force_t) :: magnus_force_t
      !> Coefficient c
      real(wp) :: coefficient = 0.0_wp
   contains
      procedure :: configure
      procedure :: add
   end type magnus_force_t

contains

   !> Copy the coefficient from the settings.
   subroutine configure(self, settings)
      class(magnus_force_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings

      self%coefficient = settings%magnus
   end subroutine configure

   !> Add the force.
   pure subroutine add(self, others, bodies, slots, force)
      class(magnus_force_t), intent(in) :: self
      real(wp), intent(in) :: others(3, block_size)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: slots(:)
      real(wp), intent(inout) :: force(3, block_size)
      integer(ip) :: k

      associate (unused => others)
      end associate
      do k = 1_ip, size(slots, kind=ip)
         associate (s => slots(k), v => bodies%velocity(:, slots(k)))
            force(1:2, k) = force(1:2, k) &
               + self%coefficient*bodies%mass(s)*bodies%angular_velocity(s)*[-v(2), v(1)]
         end associate
      end do
   end subroutine add

end module polydem_magnus_force
