!> Drag of a medium, in proportion to momentum: a free body slows down as exp(-c t), whatever its size.
!>
!> A body that falls reaches the speed g/c. Translation and rotation have the same rate. The medium is at rest; in a
!> sheared cell it is sheared like the cell, and momentum is relative to it. The torque is then that of a drag on each
!> element of mass of a body whose moments of inertia are equal along all axes.
module polydem_drag
   use polydem_bodies, only: bodies_t, block_size
   use polydem_body_force, only: body_force_t
   use polydem_cell, only: shear_flow
   use polydem_kinds, only: ip, wp
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: drag_t

   !> Drag with the force -c m v and the torque -c I omega; c is `rate`
   type, extends(body_force_t) :: drag_t
   contains
      procedure :: configure
      procedure :: add
   end type drag_t

contains

   !> Copy the rate from the settings.
   subroutine configure(self, settings)
      class(drag_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings

      self%rate = settings%drag
   end subroutine configure

   !> Add the drag.
   pure subroutine add(self, others, bodies, slots, force)
      class(drag_t), intent(in) :: self
      real(wp), intent(in) :: others(3, block_size)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: slots(:)
      real(wp), intent(inout) :: force(3, block_size)
      real(wp) :: flow(3)
      integer(ip) :: k

      associate (unused => others)
      end associate
      do k = 1_ip, size(slots, kind=ip)
         associate (s => slots(k))
            flow = shear_flow(bodies%cell, bodies%position(2, s))
            force(1:2, k) = force(1:2, k) - self%rate*bodies%mass(s)*(bodies%velocity(:, s) - flow(1:2))
            force(3, k) = force(3, k) - self%rate*bodies%inertia(s)*(bodies%angular_velocity(s) - flow(3))
         end associate
      end do
   end subroutine add

end module polydem_drag
