!> What moves the free bodies: the integration scheme, what it leaves out in free flight, and the limit
!> of displacements.
module polydem_body_motion
   use polydem_bodies, only: bodies_t
   use polydem_free_flight, only: free_flight_t
   use polydem_integrator, only: integrator_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: body_motion_t

   !> Motion of the free bodies
   type :: body_motion_t
      !> Integration scheme
      class(integrator_t), allocatable :: integrator
      !> What a step leaves out for bodies in free flight
      type(free_flight_t) :: flight
      !> Greatest displacement of a point in a step, beyond which guards respond; set by them [m]
      real(wp) :: limit = huge(1.0_wp)
   contains
      procedure :: predict
   end type body_motion_t

contains

   !> Predict up to `block_size` bodies at the end of the step. Several threads may call it for different bodies.
   subroutine predict(self, dt, slots, bodies)
      class(body_motion_t), intent(inout) :: self
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      type(bodies_t), intent(inout) :: bodies

      call self%flight%predict(self%integrator, self%limit, dt, slots, bodies)
   end subroutine predict

end module polydem_body_motion
