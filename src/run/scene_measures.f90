!> Measures of an initial scene: sizes, masses and speeds of its bodies, and the elastic energy of its contacts.
module polydem_scene_measures
   use polydem_bodies, only: bodies_t
   use polydem_body_sizes, only: measure_body
   use polydem_elementary, only: hypotenuse
   use polydem_energy_guard, only: stored_energy
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: diameter
   use polydem_prescribed_motion, only: motion_t
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: scene_measures_t, measure_scene

   !> Measures of a scene at time 0; those of free bodies are 0 if there are none
   type :: scene_measures_t
      !> Bounding box of all vertices: (x and y, least and greatest) [m]
      real(wp) :: extent(2, 2) = 0.0_wp
      !> Bounding box of the vertices of free bodies, as `extent` [m]
      real(wp) :: free_extent(2, 2) = 0.0_wp
      !> Number of vertices of all bodies
      integer(ip) :: corners = 0_ip
      !> Diameter of the free bodies: least, median, greatest, (3) [m]
      real(wp) :: diameter(3) = 0.0_wp
      !> Thickness of the thinnest body [m]
      real(wp) :: thickness = 0.0_wp
      !> Slot of the thinnest body
      integer(ip) :: thinnest = 0_ip
      !> Mass of the free bodies: least, greatest, total, (3) [kg/m]
      real(wp) :: mass(3) = 0.0_wp
      !> Mass over area of the free bodies: least, greatest, (2) [kg/m3]
      real(wp) :: density(2) = 0.0_wp
      !> Greatest speed of a free body at the start [m/s]
      real(wp) :: speed = 0.0_wp
      !> Greatest speed of any prescribed motion [m/s]
      real(wp) :: wall_speed = 0.0_wp
      !> Speed after a fall through the whole extent [m/s]
      real(wp) :: fall_speed = 0.0_wp
      !> Greatest depth of overlap that the initial speed of a free body can cause [m]
      real(wp) :: impact = 0.0_wp
      !> Slot of that body; 0 if no free body moves
      integer(ip) :: fastest = 0_ip
      !> Pressure under the full height of the free bodies, over the stiffness [1]
      real(wp) :: softness = 0.0_wp
      !> Kinetic energy of the free bodies, and their weight times the extent along gravity [J/m]
      real(wp) :: kinetic = 0.0_wp, potential = 0.0_wp
      !> Elastic energy of the contacts [J/m]
      real(wp) :: stored = 0.0_wp
   end type scene_measures_t

contains

   !> Compute the measures of a scene.
   subroutine measure_scene(simulation, measures)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      !> Measures of the scene
      type(scene_measures_t), intent(out) :: measures
      real(wp) :: gravity, down(2)
      integer :: k

      associate (s => simulation, bodies => simulation%bodies)
         measures%corners = bodies%vertex_start(bodies%n + 1_ip) - 1_ip
         call survey_bodies(bodies, measures)
         if (size(bodies%free) > 0) measures%diameter(2) = s%maker%median_diameter
         call survey_free_bodies(bodies, s%settings%forces%stiffness, measures)
         do k = 1, size(s%motions)
            measures%wall_speed = max(measures%wall_speed, greatest_speed(s%motions(k), s%guard%radius))
         end do
         gravity = hypotenuse(s%settings%forces%gravity(1), s%settings%forces%gravity(2))
         if (gravity > 0.0_wp) then
            down = abs(s%settings%forces%gravity)/gravity
            measures%potential = gravity*measures%mass(3)*along(measures%extent)
            measures%fall_speed = sqrt(2.0_wp*gravity*along(measures%extent))
            measures%softness = measures%density(2)*gravity*along(measures%free_extent)/s%settings%forces%stiffness
         end if
         measures%stored = stored_energy(s%contacts)
      end associate

   contains

      !> Length of an extent along gravity [m]
      pure real(wp) function along(extent)
         real(wp), intent(in) :: extent(2, 2)

         along = down(1)*(extent(1, 2) - extent(1, 1)) + down(2)*(extent(2, 2) - extent(2, 1))
      end function along

   end subroutine measure_scene

   !> Find the extents and the thinnest body.
   pure subroutine survey_bodies(bodies, measures)
      type(bodies_t), intent(in) :: bodies
      type(scene_measures_t), intent(inout) :: measures
      real(wp) :: thickness, radius
      integer(ip) :: s

      measures%thickness = huge(1.0_wp)
      measures%extent = reshape([1.0_wp, 1.0_wp, -1.0_wp, -1.0_wp], [2, 2])*huge(1.0_wp)
      measures%free_extent = measures%extent
      do s = 1_ip, bodies%n
         call extend_extent(measures%extent, bodies, s)
         if (.not. bodies%fixed(s)) call extend_extent(measures%free_extent, bodies, s)
         call measure_body(bodies, s, thickness, radius)
         if (thickness >= measures%thickness) cycle
         measures%thickness = thickness
         measures%thinnest = s
      end do
      if (size(bodies%free) == 0) measures%free_extent = 0.0_wp
   end subroutine survey_bodies

   !> Extend a bounding box to the vertices of a body.
   pure subroutine extend_extent(extent, bodies, s)
      real(wp), intent(inout) :: extent(2, 2)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      integer(ip) :: v

      do v = bodies%vertex_start(s), bodies%vertex_start(s + 1_ip) - 1_ip
         extent(:, 1) = min(extent(:, 1), bodies%position(:, s) + bodies%turned(:, v))
         extent(:, 2) = max(extent(:, 2), bodies%position(:, s) + bodies%turned(:, v))
      end do
   end subroutine extend_extent

   !> Find sizes, masses, densities and speeds of the free bodies.
   !>
   !> A body of mass m and speed v causes an overlap of at most v sqrt(m/E) in a contact of stiffness E, if the contact
   !> is as long as the length in the force law and the other body is at rest.
   pure subroutine survey_free_bodies(bodies, stiffness, measures)
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: stiffness
      type(scene_measures_t), intent(inout) :: measures
      real(wp) :: length, density, speed, impact
      integer(ip) :: k, s

      if (size(bodies%free) == 0) return
      measures%diameter(1) = huge(1.0_wp)
      measures%mass(1) = huge(1.0_wp)
      measures%density(1) = huge(1.0_wp)
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         associate (shape => bodies%shape(:, bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip))
            length = diameter(shape)
            density = bodies%mass(s)/area_of(shape)
         end associate
         speed = hypotenuse(bodies%velocity(1, s), bodies%velocity(2, s))
         measures%diameter([1, 3]) = [min(measures%diameter(1), length), max(measures%diameter(3), length)]
         measures%mass = [min(measures%mass(1), bodies%mass(s)), max(measures%mass(2), bodies%mass(s)), &
                        measures%mass(3) + bodies%mass(s)]
         measures%density = [min(measures%density(1), density), max(measures%density(2), density)]
         measures%speed = max(measures%speed, speed)
         measures%kinetic = measures%kinetic + 0.5_wp*bodies%mass(s)*speed**2 &
            + 0.5_wp*bodies%inertia(s)*bodies%angular_velocity(s)**2
         impact = speed*sqrt(bodies%mass(s)/stiffness)
         if (impact <= measures%impact) cycle
         measures%impact = impact
         measures%fastest = s
      end do
   end subroutine survey_free_bodies

   !> Area of a polygon [m2]
   pure real(wp) function area_of(shape)
      real(wp), intent(in) :: shape(:, :)
      integer :: v, w

      area_of = 0.0_wp
      w = size(shape, 2)
      do v = 1, size(shape, 2)
         area_of = area_of + 0.5_wp*(shape(1, w)*shape(2, v) - shape(2, w)*shape(1, v))
         w = v
      end do
   end function area_of

   !> Greatest speed of any point of the bodies of a prescribed motion [m/s]
   pure real(wp) function greatest_speed(motion, radius)
      type(motion_t), intent(in) :: motion
      !> Greatest distance of a vertex from the centre of each body, (slot) [m]
      real(wp), intent(in) :: radius(:)
      integer :: k

      greatest_speed = 0.0_wp
      select case (motion%kind)
      case ('rotation')
         do k = 1, size(motion%slots)
            greatest_speed = max(greatest_speed, abs(motion%rate)*(radius(motion%slots(k)) + hypotenuse( &
                             motion%position(1, k) - motion%pivot(1), motion%position(2, k) - motion%pivot(2))))
         end do
      case ('translation')
         greatest_speed = hypotenuse(motion%velocity(1), motion%velocity(2))
      case default
         greatest_speed = motion%frequency*hypotenuse(motion%amplitude(1), motion%amplitude(2))
      end select
   end function greatest_speed

end module polydem_scene_measures
