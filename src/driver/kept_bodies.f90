!> The list of what changes about bodies, and the only one: for checkpoints, and for bodies that go to other processes.
module polydem_kept_bodies
   use polydem_archive, only: archive_t
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: lp
   implicit none
   private
   public :: keep_bodies

contains

   !> Keep what changes about bodies.
   subroutine keep_bodies(archive, bodies)
      !> Archive, which takes or gives back columns over /bodies
      class(archive_t), intent(inout) :: archive
      !> Bodies
      type(bodies_t), intent(inout) :: bodies

      call archive%match('/bodies/id', int(bodies%id, lp), '1', 'identifiers of the bodies, ascending')
      call archive%keep('/bodies/position', bodies%position, 'm', 'centres of mass')
      call archive%keep('/bodies/angle', bodies%angle, 'rad', 'angles since the start')
      call archive%keep('/bodies/velocity', bodies%velocity, 'm/s', 'velocities of the centres of mass')
      call archive%keep('/bodies/angular_velocity', bodies%angular_velocity, 'rad/s', 'angular velocities')
      call archive%keep('/bodies/acceleration', bodies%acceleration, 'm/s2', 'accelerations of the centres of mass')
      call archive%keep('/bodies/angular_acceleration', bodies%angular_acceleration, 'rad/s2', 'angular accelerations')
      call archive%keep('/bodies/force', bodies%force, 'N/m', 'sums of the forces')
      call archive%keep('/bodies/torque', bodies%torque, 'N', 'sums of the torques about the centres of mass')
   end subroutine keep_bodies

end module polydem_kept_bodies
