!> The one list of the variable fields of bodies. Checkpoints and migration between ranks both use it.
module polydem_body_fields
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: lp
   use polydem_serializer, only: serializer_t
   implicit none
   private
   public :: serialize_bodies

contains

   !> Serialize the variable fields of bodies.
   subroutine serialize_bodies(serializer, bodies)
      !> Serializer, which reads or writes columns over /bodies
      class(serializer_t), intent(inout) :: serializer
      type(bodies_t), intent(inout) :: bodies

      call serializer%match('/bodies/id', int(bodies%id, lp), '1', 'identifiers of the bodies, ascending')
      call serializer%field('/bodies/position', bodies%position, 'm', 'centres of mass')
      call serializer%field('/bodies/angle', bodies%angle, 'rad', 'angles since the start')
      call serializer%field('/bodies/velocity', bodies%velocity, 'm/s', 'velocities of the centres of mass')
      call serializer%field('/bodies/angular_velocity', bodies%angular_velocity, 'rad/s', 'angular velocities')
      call serializer%field('/bodies/acceleration', bodies%acceleration, 'm/s2', 'accelerations of the centres of mass')
      call serializer%field('/bodies/angular_acceleration', bodies%angular_acceleration, 'rad/s2', &
         'angular accelerations')
      call serializer%field('/bodies/force', bodies%force, 'N/m', 'sums of the forces')
      call serializer%field('/bodies/torque', bodies%torque, 'N', 'sums of the torques about the centres of mass')
   end subroutine serialize_bodies

end module polydem_body_fields
