!> The lists of the fields of bodies, for checkpoints and for migration between ranks: those that vary, those that are
!> constant, and sizes, which follow from the constant ones and are not in a checkpoint.
module polydem_body_fields
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: ip
   use polydem_serializer, only: serializer_t
   implicit none
   private
   public :: serialize_bodies, serialize_constants, serialize_corners, serialize_vertices, serialize_sizes

contains

   !> Serialize the variable fields of bodies.
   subroutine serialize_bodies(serializer, bodies)
      !> Serializer, which reads or writes columns over /bodies
      class(serializer_t), intent(inout) :: serializer
      type(bodies_t), intent(inout) :: bodies

      call serializer%field('/bodies/position', bodies%position, 'm', 'centres of mass')
      if (allocated(bodies%image)) then
         call serializer%field('/bodies/image_x', bodies%image(:, 1), '1', 'cells crossed along x')
         call serializer%field('/bodies/image_y', bodies%image(:, 2), '1', 'cells crossed along y')
      end if
      if (allocated(bodies%shear_offset)) call serializer%field('/bodies/shear_offset', bodies%shear_offset, 'm', &
                                                        'shifts of the crossed borders of a sheared cell')
      call serializer%field('/bodies/angle', bodies%angle, 'rad', 'angles since the start')
      call serializer%field('/bodies/velocity', bodies%velocity, 'm/s', 'velocities of the centres of mass')
      call serializer%field('/bodies/angular_velocity', bodies%angular_velocity, 'rad/s', 'angular velocities')
      call serializer%field('/bodies/acceleration', bodies%acceleration, 'm/s2', 'accelerations of the centres of mass')
      call serializer%field('/bodies/angular_acceleration', bodies%angular_acceleration, 'rad/s2', &
         'angular accelerations')
      call serializer%field('/bodies/force', bodies%force, 'N/m', 'sums of the forces')
      call serializer%field('/bodies/torque', bodies%torque, 'N', 'sums of the torques about the centres of mass')
   end subroutine serialize_bodies

   !> Serialize the constant fields of bodies from which their sizes follow, except their global indices and their
   !> vertices, which have rows of their own.
   subroutine serialize_constants(serializer, bodies)
      !> Serializer, which reads or writes columns over /bodies
      class(serializer_t), intent(inout) :: serializer
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: fixed(bodies%n)

      fixed = merge(1_ip, 0_ip, bodies%fixed)
      call serializer%field('/bodies/id', bodies%id, '1', 'identifiers of the bodies, ascending')
      call serializer%field('/bodies/fixed', fixed, '1', '1: fixed or with prescribed motion, 0: free')
      call serializer%field('/bodies/mass', bodies%mass, 'kg/m', 'masses; 0: infinite')
      call serializer%field('/bodies/inertia', bodies%inertia, 'kg m', &
                            'moments of inertia about the centres of mass; 0: infinite')
      if (allocated(bodies%material)) call serializer%field('/bodies/material', bodies%material, '1', &
         'numbers of the materials: position among the groups &material, 0: none of them')
      bodies%fixed = fixed == 1_ip
   end subroutine serialize_constants

   !> Serialize the numbers of vertices of bodies.
   subroutine serialize_corners(serializer, corners)
      !> Serializer, which reads or writes columns over /pieces
      class(serializer_t), intent(inout) :: serializer
      !> Number of vertices of each body
      integer(ip), intent(inout), contiguous :: corners(:)

      call serializer%field('/pieces/corners', corners, '1', 'number of vertices of each body')
   end subroutine serialize_corners

   !> Serialize the vertices of bodies.
   subroutine serialize_vertices(serializer, bodies)
      !> Serializer, which reads or writes columns over /vertices
      class(serializer_t), intent(inout) :: serializer
      type(bodies_t), intent(inout) :: bodies

      call serializer%field('/vertices/position', bodies%pieces%vertex, 'm', &
                            'vertices of each piece, anticlockwise, relative to the centre of mass at angle 0')
      if (bodies%pieces%most > 1_ip) call serializer%field('/vertices/piece', bodies%pieces%number, '1', &
         'number of the piece of each vertex within its body, from 0')
   end subroutine serialize_vertices

   !> Serialize what `measure_bodies` finds.
   subroutine serialize_sizes(serializer, bodies)
      !> Serializer, which reads or writes columns over /bodies
      class(serializer_t), intent(inout) :: serializer
      type(bodies_t), intent(inout) :: bodies

      call serializer%field('/bodies/inverse_mass', bodies%inverse_mass, 'm/kg', 'inverse masses')
      call serializer%field('/bodies/inverse_inertia', bodies%inverse_inertia, '1/(kg m)', &
                            'inverse moments of inertia')
      call serializer%field('/bodies/radius', bodies%radius, 'm', 'greatest distances of a vertex from the centre')
      call serializer%field('/bodies/diameter', bodies%diameter, 'm', 'greatest distances between two vertices')
      call serializer%field('/bodies/thickness', bodies%thickness, 'm', 'twice the least distances of an edge')
   end subroutine serialize_sizes

end module polydem_body_fields
