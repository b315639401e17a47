!> A wall: fixed bodies with a name, or some without one that motions drive together. Its pose is the reference pose, to
!> which each of its motions is applied in turn. What loads displace further comes on top of it.
module polydem_wall
   use polydem_bodies, only: bodies_t
   use polydem_bodies_in_cell, only: path_of
   use polydem_elementary, only: hypotenuse
   use polydem_kinds, only: ip, wp
   use polydem_motion, only: carry_bodies, motion_item_t, pose_bodies
   use polydem_sort, only: place_in
   implicit none
   private
   public :: wall_t, gap, number_of, have_same_drivers

   !> A wall
   type :: wall_t
      !> Its name; empty for bodies without one
      character(len=:), allocatable :: name
      !> Identifiers of its bodies
      integer(ip), allocatable :: id(:)
      !> Slots of those that this rank has: all ranks have all fixed bodies
      integer(ip), allocatable :: slots(:)
      !> Positions of the bodies before all motions, (2, :) [m]
      real(wp), allocatable :: position(:, :)
      !> Angles of the bodies before all motions [rad]
      real(wp), allocatable :: angle(:)
      !> Numbers of its motions, of which each one moves what the motions before it have moved
      integer, allocatable :: motions(:)
      !> Numbers of its loads, which displace it from where the motions place it
      integer, allocatable :: loads(:)
      !> Point about which torques are stated, (2) [m]
      real(wp) :: pivot(2) = 0.0_wp
      !> Time at which it is removed [s]
      real(wp) :: vanish_at = huge(1.0_wp)
      !> Whether it has been removed
      logical :: is_removed = .false.
   contains
      procedure :: start
      procedure :: find_slots
      procedure :: is_driven
      procedure :: move
      procedure :: centre
      procedure :: centre_of_area
      procedure :: gyration_square
      procedure :: turn
      procedure :: extent
      procedure :: greatest_arm
      procedure :: reference_arm
   end type wall_t

contains

   !> Start with the present poses of the bodies as the reference, without motions and loads.
   subroutine start(self, bodies)
      !> The wall with the identifiers of its bodies
      class(wall_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies

      self%motions = [integer ::]
      self%loads = [integer ::]
      call self%find_slots(bodies)
      self%position = bodies%position(:, self%slots)
      self%angle = bodies%angle(self%slots)
   end subroutine start

   !> Whether motions or loads drive it
   pure logical function is_driven(self)
      class(wall_t), intent(in) :: self

      is_driven = size(self%motions) + size(self%loads) > 0
   end function is_driven

   !> Find the bodies among those of this rank.
   subroutine find_slots(self, bodies)
      class(wall_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies
      integer(ip) :: slots(size(self%id)), kept(size(self%id)), k, n, s

      n = 0_ip
      do k = 1_ip, size(self%id, kind=ip)
         s = place_in(bodies%id(:bodies%n), self%id(k))
         if (s > bodies%n) cycle
         if (bodies%id(s) /= self%id(k)) cycle
         n = n + 1_ip
         slots(n) = s
         kept(n) = k
      end do
      self%slots = slots(:n)
      if (.not. self%is_driven() .or. n == size(self%id)) return
      ! All bodies of a driven wall are fixed: those that this rank does not have any more have left the run.
      self%id = self%id(kept(:n))
      self%position = self%position(:, kept(:n))
      self%angle = self%angle(kept(:n))
   end subroutine find_slots

   !> Set positions, angles, velocities and accelerations of the bodies of a driven wall at a time, without its loads.
   subroutine move(self, motions, time, bodies)
      class(wall_t), intent(in) :: self
      !> All motions
      type(motion_item_t), intent(in) :: motions(:)
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      !> Bodies; position, angle, velocities and accelerations of the bodies of the wall change
      type(bodies_t), intent(inout) :: bodies
      logical :: is_moved
      integer :: k

      if (size(self%motions) /= 1 .or. size(self%loads) > 0) then
         call reset_bodies(self, bodies)
      else if (.not. motions(self%motions(1))%motion%starts_from_reference) then
         call reset_bodies(self, bodies)
      end if
      is_moved = .false.
      do k = 1, size(self%motions)
         associate (motion => motions(self%motions(k))%motion)
            if (time < motion%start) cycle
            if (is_moved .or. .not. motion%starts_from_reference) then
               call carry_bodies(motion, time, self%slots, bodies)
            else
               call pose_bodies(motion, time, self%slots, self%position, self%angle, bodies)
            end if
            is_moved = .true.
         end associate
      end do
   end subroutine move

   !> Put the bodies of a wall at rest in their reference poses.
   pure subroutine reset_bodies(wall, bodies)
      type(wall_t), intent(in) :: wall
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: k

      do k = 1_ip, size(wall%slots, kind=ip)
         associate (slot => wall%slots(k))
            bodies%position(:, slot) = wall%position(:, k)
            bodies%angle(slot) = wall%angle(k)
            bodies%velocity(:, slot) = 0.0_wp
            bodies%angular_velocity(slot) = 0.0_wp
            bodies%acceleration(:, slot) = 0.0_wp
            bodies%angular_acceleration(slot) = 0.0_wp
         end associate
      end do
   end subroutine reset_bodies

   !> Mean of the centres of mass of the bodies, on their paths through the copies of a periodic cell [m]
   pure function centre(self, bodies)
      class(wall_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp) :: centre(2)
      integer :: k

      centre = 0.0_wp
      do k = 1, size(self%slots)
         centre = centre + path_of(bodies, self%slots(k))
      end do
      if (size(self%slots) > 0) centre = centre/real(size(self%slots), wp)
   end function centre

   !> Centre of the area, at the present positions of the bodies; parts where they overlap count twice (2) [m]
   pure function centre_of_area(self, bodies) result(centre)
      class(wall_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp) :: centre(2), area, total
      integer :: k

      centre = 0.0_wp
      total = 0.0_wp
      associate (slots => self%slots)
         do k = 1, size(slots)
            area = bodies%pieces%area_of(slots(k))
            ! Relative to the first body, so that the precision does not depend on the distance from the origin
            centre = centre + area*(bodies%position(:, slots(k)) - bodies%position(:, slots(1)))
            total = total + area
         end do
         if (size(slots) > 0) centre = bodies%position(:, slots(1)) + centre/total
      end associate
   end function centre_of_area

   !> Mean square distance of the area from a point; parts where the bodies overlap count twice [m2]
   pure real(wp) function gyration_square(self, point, bodies) result(square)
      class(wall_t), intent(in) :: self
      !> The point, (2) [m]
      real(wp), intent(in) :: point(2)
      type(bodies_t), intent(in) :: bodies
      real(wp) :: arm(2), area, total
      integer :: k

      square = 0.0_wp
      total = 0.0_wp
      associate (slots => self%slots)
         do k = 1, size(slots)
            area = bodies%pieces%area_of(slots(k))
            arm = bodies%position(:, slots(k)) - point
            square = square + (bodies%pieces%second_moment_of(slots(k)) + area*(arm(1)*arm(1) + arm(2)*arm(2)))
            total = total + area
         end do
         if (size(slots) > 0) square = square/total
      end associate
   end function gyration_square

   !> Angle by which the first body has turned [rad]
   pure real(wp) function turn(self, bodies)
      class(wall_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies

      turn = 0.0_wp
      if (size(self%slots) > 0 .and. size(self%angle) > 0) turn = bodies%angle(self%slots(1)) - self%angle(1)
   end function turn

   !> Least and greatest coordinate along an axis, on the path through the copies of a periodic cell [m]
   pure function extent(self, axis, bodies)
      class(wall_t), intent(in) :: self
      !> 1: along x, 2: along y
      integer, intent(in) :: axis
      !> Bodies with turned vertices
      type(bodies_t), intent(in) :: bodies
      real(wp) :: extent(2)
      real(wp) :: origin(2)
      integer(ip) :: k, v

      extent = [huge(1.0_wp), -huge(1.0_wp)]
      associate (slots => self%slots)
         do k = 1_ip, size(slots, kind=ip)
            origin = path_of(bodies, slots(k))
            do v = bodies%pieces%vertex_start(slots(k)), bodies%pieces%vertex_start(slots(k) + 1_ip) - 1_ip
               associate (place => origin(axis) + bodies%pieces%turned(axis, v))
                  extent(1) = min(extent(1), place)
                  extent(2) = max(extent(2), place)
               end associate
            end do
         end do
      end associate
   end function extent

   !> Upper bound of the distance of a vertex from a point [m]
   pure real(wp) function greatest_arm(self, point, bodies) result(arm)
      class(wall_t), intent(in) :: self
      !> The point, (2) [m]
      real(wp), intent(in) :: point(2)
      type(bodies_t), intent(in) :: bodies

      arm = longest(bodies%radius(self%slots), bodies%position(:, self%slots), point)
   end function greatest_arm

   !> Upper bound of the distance of a vertex from a point before all motions [m]
   pure real(wp) function reference_arm(self, point, bodies) result(arm)
      class(wall_t), intent(in) :: self
      !> The point, (2) [m]
      real(wp), intent(in) :: point(2)
      type(bodies_t), intent(in) :: bodies

      arm = longest(bodies%radius(self%slots), self%position, point)
   end function reference_arm

   !> Greatest distance from a point, of circles [m]
   pure real(wp) function longest(radius, position, point) result(arm)
      !> Their radii [m]
      real(wp), intent(in) :: radius(:)
      !> Their centres, (2, :) [m]
      real(wp), intent(in) :: position(:, :)
      !> The point, (2) [m]
      real(wp), intent(in) :: point(2)
      integer :: k

      arm = 0.0_wp
      do k = 1, size(radius)
         arm = max(arm, radius(k) + hypotenuse(position(1, k) - point(1), position(2, k) - point(2)))
      end do
   end function longest

   !> Distance between two walls along an axis; negative if they overlap there [m]
   pure real(wp) function gap(first, second, axis, bodies)
      !> The walls
      type(wall_t), intent(in) :: first, second
      !> 1: along x, 2: along y
      integer, intent(in) :: axis
      !> Bodies with turned vertices
      type(bodies_t), intent(in) :: bodies
      real(wp) :: of_first(2), of_second(2)

      of_first = first%extent(axis, bodies)
      of_second = second%extent(axis, bodies)
      gap = max(of_second(1) - of_first(2), of_first(1) - of_second(2))
   end function gap

   !> Whether the same motions and loads drive two walls
   pure logical function have_same_drivers(wall, other)
      !> The walls
      type(wall_t), intent(in) :: wall, other

      have_same_drivers = size(wall%motions) == size(other%motions) .and. size(wall%loads) == size(other%loads)
      if (have_same_drivers) have_same_drivers = all(wall%motions == other%motions) .and. all(wall%loads == other%loads)
   end function have_same_drivers

   !> Number of the wall with a name; 0 if there is none
   pure integer(ip) function number_of(name, walls)
      !> The name
      character(len=*), intent(in) :: name
      !> All walls
      type(wall_t), intent(in) :: walls(:)

      do number_of = size(walls, kind=ip), 1_ip, -1_ip
         if (walls(number_of)%name == name) return
      end do
   end function number_of

end module polydem_wall
