!> A force on bodies that is no contact, such as drag.
!>
!> A new one is a file with a type that extends `body_force_t`, and a line in `body_forces.f90`. It acts on the free
!> bodies, with their positions and velocities at the evaluation of the contacts. Its work counts as damping, and its
!> impulse as that of a fixed body; the angular impulse has an error of second order in dt. What depends on a velocity
!> takes that relative to `shear_flow`, which is the same for all copies of a body in a sheared cell.
module polydem_body_force
   use polydem_bodies, only: bodies_t, block_size
   use polydem_kinds, only: ip, wp
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: body_force_t

   !> A force on free bodies
   type, abstract :: body_force_t
      !> Name for `polydem check` and the log
      character(len=40) :: name = ''
      !> Greatest rate at which it changes velocities, which bounds the time step [1/s]
      real(wp) :: rate = 0.0_wp
   contains
      procedure :: configure
      procedure(add), deferred :: add
   end type body_force_t

   abstract interface
      !> Add the force on up to `block_size` free bodies. Several threads call it for different bodies.
      pure subroutine add(self, others, bodies, slots, force)
         import :: bodies_t, block_size, body_force_t, ip, wp
         class(body_force_t), intent(in) :: self
         !> Contact forces and weight along x and y [N/m], and the torques of contacts [N], (3, body)
         real(wp), intent(in) :: others(3, block_size)
         !> Bodies with the positions and velocities of this step
         type(bodies_t), intent(in) :: bodies
         !> Slots of the bodies
         integer(ip), intent(in) :: slots(:)
         !> Forces along x and y [N/m] and torques [N] on them that are no contacts, (3, body)
         real(wp), intent(inout) :: force(3, block_size)
      end subroutine add
   end interface

contains

   !> Copy the parameters from the settings. Default: there are none.
   subroutine configure(self, settings)
      class(body_force_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings

      associate (unused_self => self, unused_settings => settings)
      end associate
   end subroutine configure

end module polydem_body_force
