!> Measures of an initial scene: sizes, masses and speeds of its bodies, and depth and energy of its contacts. They are
!> those of the bodies of all ranks.
module polydem_scene_measures
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_contact_depth, only: deepest_contact, depth_share, depth_text, thinner_pieces
   use polydem_contacts, only: contacts_t
   use polydem_driven, only: along_angle
   use polydem_elementary, only: hypotenuse
   use polydem_energy_guard, only: find_stored_energy
   use polydem_global_reductions, only: keep_greatest, reduce_to_greatest, reduce_to_least, sum_exactly
   use polydem_motion_tests, only: greatest_displacement, place_of
   use polydem_kinds, only: ip, lp, wp
   use polydem_ownership, only: owns_body, owns_pair
   use polydem_run_duration, only: longest_run
   use polydem_simulation, only: simulation_t
   use polydem_step_guard, only: find_stable_step
   use polydem_strings, only: to_text
   use polydem_walls, only: walls_t
   implicit none
   private
   public :: scene_measures_t, measure_scene

   !> Measures of a scene at time 0; those of free bodies are 0 if there are none
   type :: scene_measures_t
      !> Bounding box of all vertices: (x and y, least and greatest) [m]
      real(wp) :: extent(2, 2) = 0.0_wp
      !> Bounding box of the vertices of free bodies, as `extent` [m]
      real(wp) :: free_extent(2, 2) = 0.0_wp
      !> Number of free bodies, fixed bodies, vertices, boxes and boxes of fixed bodies
      integer(lp) :: free = 0_lp, fixed = 0_lp, corners = 0_lp, boxes = 0_lp, fixed_boxes = 0_lp
      !> Diameter of the free bodies: least, median, greatest, (3) [m]
      real(wp) :: diameter(3) = 0.0_wp
      !> Thickness of the thinnest body [m]
      real(wp) :: thickness = 0.0_wp
      !> Identifier of the thinnest body
      integer(lp) :: thinnest = 0_lp
      !> Mass of the free bodies: least, greatest, total, (3) [kg/m]
      real(wp) :: mass(3) = 0.0_wp
      !> Mass over area of the free bodies: least, greatest, (2) [kg/m3]
      real(wp) :: density(2) = 0.0_wp
      !> Greatest speed of a free body at the start [m/s]
      real(wp) :: speed = 0.0_wp
      !> Of each load with a torque: least and greatest distance of a free body from the line through the pivot and the
      !> centre of its wall, positive where the wall turns to with a positive torque, then the width of the wall across
      !> this line; the width is 0 if the pivot is within the wall, and for other loads, (3, load) [m]
      real(wp), allocatable :: sides(:, :)
      !> Greatest speed of any prescribed motion [m/s]
      real(wp) :: wall_speed = 0.0_wp
      !> Speed after a fall through the whole extent [m/s]
      real(wp) :: fall_speed = 0.0_wp
      !> Greatest depth of overlap that the initial speed of a free body can cause [m]
      real(wp) :: impact = 0.0_wp
      !> Identifier of that body
      integer(lp) :: fastest = 0_lp
      !> Greatest displacement of a point of a body in a step [m]
      real(wp) :: move = 0.0_wp
      !> Identifier of that body
      integer(lp) :: farthest = 0_lp
      !> Number of bodies of each material, (0:n); not allocated if there are no materials
      integer(lp), allocatable :: of_material(:)
      !> Least stiffness of all pairs of materials [N/m2]
      real(wp) :: stiffness = 0.0_wp
      !> Greatest static pressure, and that of impacts at the expected speed: density times its square, over that
      !> stiffness [1]
      real(wp) :: softness = 0.0_wp, impact_softness = 0.0_wp
      !> Distance between neighbouring numbers at the farthest vertex of a free body from the origin [m]
      real(wp) :: last_bit = 0.0_wp
      !> Depth by which the lightest free body sinks into a body below it, and depth under the full height of the free
      !> bodies: about load over stiffness [m]
      real(wp) :: static_depth(2) = 0.0_wp
      !> Kinetic energy of the free bodies, and their weight times the extent along gravity [J/m]
      real(wp) :: kinetic = 0.0_wp, potential = 0.0_wp
      !> Elastic energy of the contacts [J/m]
      real(wp) :: stored = 0.0_wp
      !> Number of contacts, and number of those deeper than `listed_depth` in &guards
      integer(lp) :: contacts = 0_lp, deep = 0_lp
      !> Greatest depth of a contact over the thickness of the thinner piece
      real(wp) :: depth_share = 0.0_wp
      !> Clause about this contact
      character(len=:), allocatable :: deepest
      !> Clause about the contact with the greatest depth in metres
      character(len=:), allocatable :: longest_depth
      !> Stable time step of the contacts [s]
      real(wp) :: stable_step = huge(1.0_wp)
   end type scene_measures_t

contains

   !> Compute the measures of a scene. Collective; all ranks get the same measures.
   subroutine measure_scene(simulation, measures)
      !> A simulation at time 0
      type(simulation_t), intent(inout) :: simulation
      type(scene_measures_t), intent(out) :: measures
      real(wp), allocatable :: thinner(:)
      real(wp) :: gravity, down(2)
      integer(ip) :: slot

      associate (s => simulation, comm => simulation%comm)
         measures%fixed_boxes = count(s%search%boxes%fixed(:s%search%boxes%n), kind=lp)
         measures%boxes = count(.not. s%search%boxes%passive(:s%search%boxes%n), kind=lp)
         associate (pairs => s%search%neighbours%pairs)
            thinner = thinner_pieces(s%bodies, s%contacts, pairs%first, pairs%second)
         end associate
         call count_parts(comm, s%bodies, s%contacts, thinner, s%settings%guards%listed_depth, measures)
         if (allocated(s%bodies%material)) call count_materials(comm, s%bodies, s%law%pairs%n_materials, measures)
         call measure_bodies(comm, s%bodies, measures)
         if (measures%free > 0_lp) measures%diameter(2) = s%search%maker%median_diameter
         measures%stiffness = s%law%pairs%stiffness%least()
         if (measures%free > 0_lp) call measure_free_bodies(comm, s%bodies, measures)
         call greatest_displacement(s%bodies, s%moving(:s%n_moving), s%dt, measures%move, slot)
         if (slot > 0_ip) measures%farthest = int(s%bodies%id(slot), lp)
         call keep_greatest(comm, measures%move, measures%farthest)
         measures%wall_speed = s%walls%greatest_speed(s%bodies, longest_run(s%settings))
         call measure_sides(comm, s%bodies, s%walls, measures%sides)
         gravity = hypotenuse(s%forces%gravity(1), s%forces%gravity(2))
         if (gravity > 0.0_wp) then
            down = abs(s%forces%gravity)/gravity
            measures%potential = gravity*measures%mass(3)*along(measures%extent)
            measures%fall_speed = sqrt(2.0_wp*gravity*along(measures%extent))
            measures%static_depth = [measures%mass(1)*gravity, measures%density(2)*gravity &
                                     *along(measures%free_extent)*measures%diameter(2)]/measures%stiffness
         end if
         measures%softness = s%pressure%greatest/measures%stiffness
         measures%impact_softness = measures%density(2)*(s%expected%speed/measures%stiffness)*s%expected%speed
         measures%last_bit = spacing(maxval(abs(measures%free_extent)))
      end associate
      call find_stored_energy(simulation%comm, simulation%bodies, simulation%contacts, measures%stored)
      call measure_contacts(simulation%comm, simulation%bodies, simulation%contacts, thinner, measures)
      call find_stable_step(simulation, measures%stable_step, slot)

   contains

      !> Length of an extent along gravity [m]
      pure real(wp) function along(extent)
         real(wp), intent(in) :: extent(2, 2)

         along = down(1)*(extent(1, 2) - extent(1, 1)) + down(2)*(extent(2, 2) - extent(2, 1))
      end function along

   end subroutine measure_scene

   !> Count bodies, vertices, boxes and contacts.
   subroutine count_parts(comm, bodies, contacts, thinner, limit, measures)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> Thickness of the thinner piece of each contact [m]
      real(wp), intent(in) :: thinner(:)
      !> Depth of the contacts that are listed, as a share of it
      real(wp), intent(in) :: limit
      !> Numbers of bodies, vertices, boxes and contacts are set; on entry `boxes` is that of this rank
      type(scene_measures_t), intent(inout) :: measures
      integer(lp) :: counts(5)
      integer(ip) :: c, k

      counts = 0_lp
      measures%fixed = count(bodies%fixed, kind=lp)
      counts(1) = size(bodies%free, kind=lp)
      do k = 1_ip, bodies%n
         if (owns_body(comm%is_root(), bodies%in_halo(k), bodies%fixed(k))) &
            counts(2) = counts(2) + int(bodies%pieces%vertex_start(k + 1_ip) - bodies%pieces%vertex_start(k), lp)
      end do
      counts(3) = measures%boxes
      do c = 1_ip, contacts%n
         if (.not. owns_pair(bodies, contacts%row(c)%first, contacts%row(c)%second)) cycle
         counts(4) = counts(4) + 1_lp
         if (depth_share(contacts, thinner, c) > limit) counts(5) = counts(5) + 1_lp
      end do
      call comm%all_reduce_sum(counts)
      measures%free = counts(1)
      measures%corners = counts(2)
      measures%boxes = counts(3) + measures%fixed_boxes
      measures%contacts = counts(4)
      measures%deep = counts(5)
   end subroutine count_parts

   !> Count the bodies of each material.
   subroutine count_materials(comm, bodies, n_materials, measures)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: n_materials
      type(scene_measures_t), intent(inout) :: measures
      integer(ip) :: k

      allocate (measures%of_material(0:n_materials), source=0_lp)
      associate (n => measures%of_material)
         do k = 1_ip, bodies%n
            if (owns_body(comm%is_root(), bodies%in_halo(k), bodies%fixed(k))) &
               n(bodies%material(k)) = n(bodies%material(k)) + 1_lp
         end do
      end associate
      call comm%all_reduce_sum(measures%of_material)
   end subroutine count_materials

   !> Find the deepest contact in terms of its thinner body, and that with the greatest depth in metres.
   subroutine measure_contacts(comm, bodies, contacts, thinner, measures)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> Thickness of the thinner piece of each contact [m]
      real(wp), intent(in) :: thinner(:)
      type(scene_measures_t), intent(inout) :: measures
      real(wp) :: depth, greatest
      integer(lp) :: place, longest
      integer(ip) :: c, worst

      place = 0_lp
      longest = 0_lp
      greatest = -1.0_wp
      worst = deepest_contact(contacts, thinner)
      if (worst > 0_ip) then
         measures%depth_share = depth_share(contacts, thinner, worst)
         measures%deepest = depth_text(bodies, contacts, thinner, worst)
         place = place_of(bodies, contacts%row(worst)%first, contacts%row(worst)%second)
      end if
      do c = 1_ip, contacts%n
         depth = contacts%row(c)%depth
         if (depth <= greatest) cycle
         greatest = depth
         worst = c
      end do
      if (worst > 0_ip) then
         longest = place_of(bodies, contacts%row(worst)%first, contacts%row(worst)%second)
         measures%longest_depth = to_text(greatest, 3)//' m between the bodies '// &
            to_text(bodies%id(contacts%row(worst)%first))//' and '//to_text(bodies%id(contacts%row(worst)%second))
      end if
      call keep_greatest(comm, measures%depth_share, place, measures%deepest)
      call keep_greatest(comm, greatest, longest, measures%longest_depth)
   end subroutine measure_contacts

   !> Find the extents and the thinnest body.
   subroutine measure_bodies(comm, bodies, measures)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      type(scene_measures_t), intent(inout) :: measures
      integer(ip) :: s

      measures%thickness = huge(1.0_wp)
      measures%extent = reshape([1.0_wp, 1.0_wp, -1.0_wp, -1.0_wp], [2, 2])*huge(1.0_wp)
      measures%free_extent = measures%extent
      do s = 1_ip, bodies%n
         call extend_extent(measures%extent, bodies, s)
         if (.not. bodies%fixed(s)) call extend_extent(measures%free_extent, bodies, s)
         if (bodies%thickness(s) >= measures%thickness) cycle
         measures%thickness = bodies%thickness(s)
         measures%thinnest = int(bodies%id(s), lp)
      end do
      call reduce_to_least(comm, measures%extent(:, 1))
      call reduce_to_greatest(comm, measures%extent(:, 2))
      call reduce_to_least(comm, measures%free_extent(:, 1))
      call reduce_to_greatest(comm, measures%free_extent(:, 2))
      if (bodies%n_all == 0_ip) measures%extent = 0.0_wp
      if (measures%free == 0_lp) measures%free_extent = 0.0_wp
      measures%thickness = -measures%thickness
      call keep_greatest(comm, measures%thickness, measures%thinnest)
      measures%thickness = -measures%thickness
   end subroutine measure_bodies

   !> Find on which side of each wall with a torque the free bodies are.
   subroutine measure_sides(comm, bodies, walls, sides)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      type(walls_t), intent(in) :: walls
      !> As in the measures
      real(wp), allocatable, intent(out) :: sides(:, :)
      real(wp) :: bounds(3, 2), line(2)
      integer :: k

      if (.not. allocated(walls%loads)) then
         allocate (sides(3, 0))
         return
      end if
      allocate (sides(3, size(walls%loads)), source=0.0_wp)
      do k = 1, size(walls%loads)
         associate (load => walls%loads(k))
            if (load%direction /= along_angle) cycle
            line = walls%wall(load%wall)%centre(bodies) - load%pivot
            if (.not. any(abs(line) > 0.0_wp)) cycle
            line = line/hypotenuse(line(1), line(2))
            ! The wall: it begins on one side of the pivot.
            bounds = distances(bodies, walls%wall(load%wall)%slots, load%pivot, line)
            if (bounds(3, 1) < -0.1_wp*bounds(3, 2)) cycle
            sides(3, k) = bounds(2, 1) - bounds(1, 1)
            bounds = distances(bodies, bodies%free, load%pivot, line)
            sides(1:2, k) = bounds(1:2, 1)
         end associate
      end do
      call reduce_to_least(comm, sides(1, :))
      call reduce_to_greatest(comm, sides(2, :))
   end subroutine measure_sides

   !> Least and greatest distance of the vertices of some bodies from a line, positive on its left, and least and
   !> greatest distance along it: (1:2, 1) and (3, 1:2) [m]
   pure function distances(bodies, slots, point, line) result(bounds)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: slots(:)
      !> Point of the line [m], and its direction
      real(wp), intent(in) :: point(2), line(2)
      real(wp) :: bounds(3, 2), place(2), across, along
      integer(ip) :: v
      integer :: k

      bounds(:, 1) = [huge(1.0_wp), -huge(1.0_wp), huge(1.0_wp)]
      bounds(:, 2) = -huge(1.0_wp)
      do k = 1, size(slots)
         do v = bodies%pieces%vertex_start(slots(k)), bodies%pieces%vertex_start(slots(k) + 1_ip) - 1_ip
            place = bodies%position(:, slots(k)) + bodies%pieces%turned(:, v) - point
            across = line(1)*place(2) - line(2)*place(1)
            along = line(1)*place(1) + line(2)*place(2)
            bounds(:, 1) = [min(bounds(1, 1), across), max(bounds(2, 1), across), min(bounds(3, 1), along)]
            bounds(3, 2) = max(bounds(3, 2), along)
         end do
      end do
   end function distances

   !> Extend a bounding box to the vertices of a body.
   pure subroutine extend_extent(extent, bodies, s)
      real(wp), intent(inout) :: extent(2, 2)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      integer(ip) :: v

      do v = bodies%pieces%vertex_start(s), bodies%pieces%vertex_start(s + 1_ip) - 1_ip
         extent(:, 1) = min(extent(:, 1), bodies%position(:, s) + bodies%pieces%turned(:, v))
         extent(:, 2) = max(extent(:, 2), bodies%position(:, s) + bodies%pieces%turned(:, v))
      end do
   end subroutine extend_extent

   !> Find sizes, masses, densities and speeds of the free bodies.
   !>
   !> A body of mass m and speed v causes an overlap of at most v sqrt(m/E) in a contact of stiffness E, if the contact
   !> is as long as the length in the force law and the other body is at rest.
   subroutine measure_free_bodies(comm, bodies, measures)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Measures with the stiffness
      type(scene_measures_t), intent(inout) :: measures
      real(wp) :: density, speed, impact, least(3), greatest(4)
      real(wp), allocatable :: kinetic(:)
      integer(ip) :: k, s

      allocate (kinetic(size(bodies%free)))
      measures%diameter(1) = huge(1.0_wp)
      measures%mass(1) = huge(1.0_wp)
      measures%density(1) = huge(1.0_wp)
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         density = bodies%mass(s)/bodies%pieces%area_of(s)
         speed = hypotenuse(bodies%velocity(1, s), bodies%velocity(2, s))
         measures%diameter([1, 3]) = [min(measures%diameter(1), bodies%diameter(s)), &
                                       max(measures%diameter(3), bodies%diameter(s))]
         measures%mass(:2) = [min(measures%mass(1), bodies%mass(s)), max(measures%mass(2), bodies%mass(s))]
         measures%density = [min(measures%density(1), density), max(measures%density(2), density)]
         measures%speed = max(measures%speed, speed)
         kinetic(k) = 0.5_wp*bodies%mass(s)*speed**2 + 0.5_wp*bodies%inertia(s)*bodies%angular_velocity(s)**2
         impact = speed*sqrt(bodies%mass(s)/measures%stiffness)
         if (impact <= measures%impact) cycle
         measures%impact = impact
         measures%fastest = int(bodies%id(s), lp)
      end do
      least = [measures%diameter(1), measures%mass(1), measures%density(1)]
      greatest = [measures%diameter(3), measures%mass(2), measures%density(2), measures%speed]
      call reduce_to_least(comm, least)
      call reduce_to_greatest(comm, greatest)
      measures%diameter([1, 3]) = [least(1), greatest(1)]
      measures%mass(:2) = [least(2), greatest(2)]
      measures%density = [least(3), greatest(3)]
      measures%speed = greatest(4)
      call sum_exactly(comm, bodies%mass(bodies%free), measures%mass(3))
      call sum_exactly(comm, kinetic, measures%kinetic)
      call keep_greatest(comm, measures%impact, measures%fastest)
   end subroutine measure_free_bodies

end module polydem_scene_measures
