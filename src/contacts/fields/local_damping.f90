!> Local damping: a share of the total force acts against the velocity, along each axis and in rotation, as
!> -alpha |F| sign v (P.A. Cundall, in Analytical and Computational Methods in Engineering Rock Mechanics (1987) 129).
!>
!> It brings a sample to rest in few oscillations, whatever their frequency, and vanishes in equilibrium. Free fall is
!> slower by the same share, so it is no model of a flow. In a sheared cell the velocity is that relative to the shear.
module polydem_local_damping
   use polydem_bodies, only: bodies_t, block_size
   use polydem_body_force, only: body_force_t
   use polydem_cell, only: shear_flow
   use polydem_kinds, only: ip, wp
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: local_damping_t

   !> Local damping
   type, extends(body_force_t) :: local_damping_t
      !> Share of the total force
      real(wp) :: share = 0.0_wp
   contains
      procedure :: configure
      procedure :: add
   end type local_damping_t

contains

   !> Copy the share from the settings.
   subroutine configure(self, settings)
      class(local_damping_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings

      self%share = settings%local_damping
   end subroutine configure

   !> Add the damping of contact forces, weight and the forces so far. A body without velocity feels none.
   pure subroutine add(self, others, bodies, slots, force)
      class(local_damping_t), intent(in) :: self
      real(wp), intent(in) :: others(3, block_size)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: slots(:)
      real(wp), intent(inout) :: force(3, block_size)
      real(wp) :: velocity(3)
      integer(ip) :: k
      integer :: i

      do k = 1_ip, size(slots, kind=ip)
         velocity(1:2) = bodies%velocity(:, slots(k))
         velocity(3) = bodies%angular_velocity(slots(k))
         velocity = velocity - shear_flow(bodies%cell, bodies%position(2, slots(k)))
         do i = 1, 3
            if (abs(velocity(i)) > 0.0_wp) &
               force(i, k) = force(i, k) - sign(self%share*abs(others(i, k) + force(i, k)), velocity(i))
         end do
      end do
   end subroutine add

end module polydem_local_damping
