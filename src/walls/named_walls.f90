!> Named walls of a scene: which bodies belong to each of them. All ranks have all fixed bodies.
module polydem_named_walls
   use polydem_bodies, only: bodies_t
   use polydem_bodies_in_cell, only: path_of
   use polydem_elementary, only: hypotenuse
   use polydem_kinds, only: ip, wp
   use polydem_serializer, only: serializer_t
   use polydem_sort, only: place_in
   use polydem_wall_bodies, only: wall_bodies_t
   implicit none
   private
   public :: named_walls_t, named_wall_t

   !> A wall with its name
   type, extends(wall_bodies_t) :: named_wall_t
      !> Slots of its bodies
      integer(ip), allocatable :: slots(:)
      !> Point about which torques are stated, (2) [m]
      real(wp) :: pivot(2) = 0.0_wp
      !> Angle of its first body before all motions [rad]
      real(wp) :: angle = 0.0_wp
      !> Time at which the wall vanishes [s]
      real(wp) :: vanish_at = huge(1.0_wp)
      !> Whether it has vanished
      logical :: is_gone = .false.
   end type named_wall_t

   !> All of them
   type :: named_walls_t
      !> The walls, in the order of the file
      type(named_wall_t), allocatable :: wall(:)
      !> Wall of each body, (slot); 0 for bodies without a named wall
      integer(ip), allocatable :: wall_of(:)
      !> Elastic energy of the contacts of walls that vanish before the next step; used after a restart [J/m]
      real(wp) :: released = 0.0_wp
   contains
      procedure :: find_slots => find_all_slots
      procedure :: mark_gone
      procedure :: has_gates
      procedure :: vanishing
      procedure :: any_vanishes
      procedure :: serialize_gates
      procedure :: centre
      procedure :: centre_of_area
      procedure :: gyration_square
      procedure :: turn
      procedure :: gap
      procedure :: extent
      procedure :: greatest_arm
   end type named_walls_t

contains

   !> Find the bodies of the walls among the bodies of this rank.
   subroutine find_all_slots(self, bodies)
      class(named_walls_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies
      integer(ip), allocatable :: slots(:)
      integer(ip) :: j, k, n, s

      if (.not. allocated(self%wall)) return
      self%wall_of = spread(0_ip, 1, bodies%n)
      do k = 1_ip, size(self%wall, kind=ip)
         associate (wall => self%wall(k))
            allocate (slots(size(wall%id)))
            n = 0_ip
            do j = 1_ip, size(wall%id, kind=ip)
               s = place_in(bodies%id(:bodies%n), wall%id(j))
               if (s > bodies%n) cycle
               if (bodies%id(s) /= wall%id(j)) cycle
               n = n + 1_ip
               slots(n) = s
               self%wall_of(s) = k
            end do
            wall%slots = slots(:n)
            deallocate (slots)
         end associate
      end do
   end subroutine find_all_slots

   !> Mark the bodies of walls that have vanished.
   subroutine mark_gone(self, bodies)
      class(named_walls_t), intent(in) :: self
      !> Bodies; `gone` is set if a wall vanishes at any time
      type(bodies_t), intent(inout) :: bodies
      integer :: k

      if (.not. self%has_gates()) return
      bodies%gone = spread(.false., 1, bodies%n)
      do k = 1, size(self%wall)
         if (self%wall(k)%is_gone) bodies%gone(self%wall(k)%slots) = .true.
      end do
   end subroutine mark_gone

   !> Whether a wall vanishes at any time
   pure logical function has_gates(self)
      class(named_walls_t), intent(in) :: self

      has_gates = .false.
      if (allocated(self%wall)) has_gates = any(self%wall%vanish_at < huge(1.0_wp))
   end function has_gates

   !> Whether each wall vanishes at a time, and has not before, (wall)
   pure function vanishing(self, time)
      class(named_walls_t), intent(in) :: self
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      logical :: vanishing(size(self%wall))

      vanishing = time >= self%wall%vanish_at .and. .not. self%wall%is_gone
   end function vanishing

   !> Whether a wall vanishes at a time. Asked in every step, so without an array.
   pure logical function any_vanishes(self, time)
      class(named_walls_t), intent(in) :: self
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      integer :: k

      any_vanishes = .false.
      if (.not. allocated(self%wall)) return
      do k = 1, size(self%wall)
         any_vanishes = any_vanishes .or. (time >= self%wall(k)%vanish_at .and. .not. self%wall(k)%is_gone)
      end do
   end function any_vanishes

   !> Serialize which walls have vanished.
   subroutine serialize_gates(self, serializer)
      class(named_walls_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer
      integer(ip), allocatable :: flags(:)

      if (.not. self%has_gates()) return
      flags = merge(1_ip, 0_ip, self%wall%is_gone)
      call serializer%field('/run/gone', flags, '1', 'whether each wall has vanished')
      call serializer%field('/run/released', self%released, 'J/m', 'elastic energy of the contacts of walls that '// &
                            'vanish before the next step')
      self%wall%is_gone = flags == 1_ip
   end subroutine serialize_gates

   !> Mean of the centres of mass of the bodies of a wall, on their paths through the copies of a periodic cell [m]
   pure function centre(self, w, bodies)
      class(named_walls_t), intent(in) :: self
      !> Number of the wall
      integer(ip), intent(in) :: w
      type(bodies_t), intent(in) :: bodies
      real(wp) :: centre(2)
      integer :: k

      centre = 0.0_wp
      associate (slots => self%wall(w)%slots)
         do k = 1, size(slots)
            centre = centre + path_of(bodies, slots(k))
         end do
         if (size(slots) > 0) centre = centre/real(size(slots), wp)
      end associate
   end function centre

   !> Centre of the area of a wall, at the present positions of its bodies; parts where they overlap count twice (2) [m]
   pure function centre_of_area(self, w, bodies) result(centre)
      class(named_walls_t), intent(in) :: self
      !> Number of the wall
      integer(ip), intent(in) :: w
      type(bodies_t), intent(in) :: bodies
      real(wp) :: centre(2), area, total
      integer :: k

      centre = 0.0_wp
      total = 0.0_wp
      associate (slots => self%wall(w)%slots)
         do k = 1, size(slots)
            area = bodies%pieces%area_of(slots(k))
            ! Relative to the first body, so that the precision does not depend on the distance from the origin
            centre = centre + area*(bodies%position(:, slots(k)) - bodies%position(:, slots(1)))
            total = total + area
         end do
         if (size(slots) > 0) centre = bodies%position(:, slots(1)) + centre/total
      end associate
   end function centre_of_area

   !> Mean square distance of the area of a wall from a point; parts where its bodies overlap count twice [m2]
   pure real(wp) function gyration_square(self, w, point, bodies) result(square)
      class(named_walls_t), intent(in) :: self
      !> Number of the wall
      integer(ip), intent(in) :: w
      !> The point, (2) [m]
      real(wp), intent(in) :: point(2)
      type(bodies_t), intent(in) :: bodies
      real(wp) :: arm(2), area, total
      integer :: k

      square = 0.0_wp
      total = 0.0_wp
      associate (slots => self%wall(w)%slots)
         do k = 1, size(slots)
            area = bodies%pieces%area_of(slots(k))
            arm = bodies%position(:, slots(k)) - point
            square = square + (bodies%pieces%second_moment_of(slots(k)) + area*(arm(1)*arm(1) + arm(2)*arm(2)))
            total = total + area
         end do
         if (size(slots) > 0) square = square/total
      end associate
   end function gyration_square

   !> Angle by which a wall, or its first body, has turned [rad]
   pure real(wp) function turn(self, w, bodies)
      class(named_walls_t), intent(in) :: self
      !> Number of the wall
      integer(ip), intent(in) :: w
      type(bodies_t), intent(in) :: bodies

      turn = 0.0_wp
      if (size(self%wall(w)%slots) > 0) turn = bodies%angle(self%wall(w)%slots(1)) - self%wall(w)%angle
   end function turn

   !> Distance between two walls along an axis; negative if they overlap there [m]
   pure real(wp) function gap(self, pair, axis, bodies)
      class(named_walls_t), intent(in) :: self
      !> Numbers of the walls
      integer(ip), intent(in) :: pair(2)
      !> 1: along x, 2: along y
      integer, intent(in) :: axis
      !> Bodies with turned vertices
      type(bodies_t), intent(in) :: bodies
      real(wp) :: first(2), second(2)

      first = self%extent(pair(1), axis, bodies)
      second = self%extent(pair(2), axis, bodies)
      gap = max(second(1) - first(2), first(1) - second(2))
   end function gap

   !> Least and greatest coordinate of a wall along an axis, on its path through the copies of a periodic cell [m]
   pure function extent(self, w, axis, bodies)
      class(named_walls_t), intent(in) :: self
      !> Number of the wall
      integer(ip), intent(in) :: w
      !> 1: along x, 2: along y
      integer, intent(in) :: axis
      !> Bodies with turned vertices
      type(bodies_t), intent(in) :: bodies
      real(wp) :: extent(2)
      real(wp) :: origin(2)
      integer(ip) :: k, v

      extent = [huge(1.0_wp), -huge(1.0_wp)]
      associate (slots => self%wall(w)%slots)
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

   !> Upper bound of the distance of a vertex of a wall from a point [m]
   pure real(wp) function greatest_arm(self, w, point, bodies) result(arm)
      class(named_walls_t), intent(in) :: self
      !> Number of the wall
      integer(ip), intent(in) :: w
      !> The point, (2) [m]
      real(wp), intent(in) :: point(2)
      type(bodies_t), intent(in) :: bodies
      integer :: k

      arm = 0.0_wp
      associate (slots => self%wall(w)%slots)
         do k = 1, size(slots)
            arm = max(arm, bodies%radius(slots(k)) + hypotenuse(bodies%position(1, slots(k)) - point(1), &
                                                                bodies%position(2, slots(k)) - point(2)))
         end do
      end associate
   end function greatest_arm

end module polydem_named_walls
