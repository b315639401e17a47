!> Common procedures of the tests of scenes: making a scene from a few entries, and simple checks of its geometry.
module scene_checks
   use polydem_bodies, only: bodies_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_read_settings, only: read_settings_text
   use polydem_scene, only: build_scene
   use polydem_settings, only: settings_t
   use polydem_walls, only: walls_t
   implicit none
   private
   public :: make_scene, scene_message, find_vertices, polygon_area, all_convex, count_overlaps
   public :: count_differences, kinds_of

contains

   !> Make a scene from entries of &scene.
   subroutine make_scene(entries, bodies, error, settings, walls)
      !> Entries, separated by commas
      character(len=*), intent(in) :: entries
      !> Bodies
      type(bodies_t), intent(out) :: bodies
      !> Error of the reader or the generator
      type(error_t), allocatable, intent(out) :: error
      !> Settings
      type(settings_t), intent(out), optional :: settings
      !> Motions, and the walls that they or loads drive
      type(walls_t), intent(out), optional :: walls
      type(settings_t) :: own_settings
      type(walls_t) :: own_walls
      character(len=8) :: no_overrides(0)
      integer :: k

      call read_settings_text('test.nml', '&scene '//entries//' /'//new_line('a') &
                              //'&integrate duration = 1 /'//new_line('a'), no_overrides, own_settings, error)
      if (.not. allocated(error)) call build_scene(own_settings, bodies, own_walls, error)
      if (present(settings)) settings = own_settings
      if (.not. present(walls) .or. allocated(error)) return
      walls = own_walls
      walls%wall = own_walls%wall(pack([(k, k=1, size(own_walls%wall))], &
                                       [(own_walls%wall(k)%is_driven(), k=1, size(own_walls%wall))]))
   end subroutine make_scene

   !> Kinds of the motions of a wall, separated by blanks
   function kinds_of(walls, number) result(text)
      !> Walls with their motions
      type(walls_t), intent(in) :: walls
      !> Number of the wall
      integer, intent(in) :: number
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      associate (motions => walls%wall(number)%motions)
         do k = 1, size(motions)
            text = text//' '//walls%motions(motions(k))%motion%kind
         end do
      end associate
      text = trim(adjustl(text))
   end function kinds_of

   !> Message of the error of a scene; empty if there is none
   function scene_message(entries) result(message)
      !> Entries, separated by commas
      character(len=*), intent(in) :: entries
      character(len=:), allocatable :: message
      type(bodies_t) :: bodies
      type(error_t), allocatable :: error

      message = ''
      call make_scene(entries, bodies, error)
      if (allocated(error)) message = error%message
   end function scene_message

   !> Find the corners of a body in world coordinates.
   subroutine find_vertices(bodies, slot, vertices)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: slot
      !> Corners of the body, anticlockwise, (2, corner) [m]
      real(wp), allocatable, intent(out) :: vertices(:, :)
      integer :: k, first, n

      first = bodies%pieces%vertex_start(slot)
      n = bodies%pieces%vertex_start(slot + 1) - first
      allocate (vertices(2, n))
      do k = 1, n
         vertices(:, k) = bodies%pieces%turned(:, first + k - 1) + bodies%position(:, slot)
      end do
   end subroutine find_vertices

   !> Area by the shoelace formula
   real(wp) function polygon_area(vertices)
      !> Corners, (2, :)
      real(wp), intent(in) :: vertices(:, :)
      integer :: k, n

      polygon_area = 0.0_wp
      do k = 1, size(vertices, 2)
         n = modulo(k, size(vertices, 2)) + 1
         polygon_area = polygon_area + 0.5_wp*(vertices(1, k)*vertices(2, n) - vertices(1, n)*vertices(2, k))
      end do
   end function polygon_area

   !> Whether every polygon turns left at every corner, once around
   logical function all_convex(bodies)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: v(:, :)
      integer :: k, l, m, s, n
      real(wp) :: a(2), b(2), total, rounding

      all_convex = .true.
      do s = 1, bodies%n
         call find_vertices(bodies, int(s, ip), v)
         n = size(v, 2)
         total = 0.0_wp
         do k = 1, n
            l = modulo(k, n) + 1
            m = modulo(l, n) + 1
            a = v(:, l) - v(:, k)
            b = v(:, m) - v(:, l)
            ! Vertices are rounded at their distance from the origin.
            rounding = 4.0_wp*epsilon(1.0_wp)*maxval(abs(v))*(norm2(a) + norm2(b))
            if (a(1)*b(2) - a(2)*b(1) <= -rounding) all_convex = .false.
            total = total + atan2(a(1)*b(2) - a(2)*b(1), a(1)*b(1) + a(2)*b(2))
         end do
         if (abs(total - 8.0_wp*atan(1.0_wp)) > 1.0e-6_wp + 8.0_wp*real(n, wp)*epsilon(1.0_wp)) all_convex = .false.
      end do
   end function all_convex

   !> Number of pairs of bodies, not both fixed, of which some pieces have no separating edge
   integer function count_overlaps(bodies)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: reach(:)
      real(wp) :: distance(2)
      integer(ip) :: i, j

      allocate (reach(bodies%n))
      do i = 1_ip, bodies%n
         associate (v => bodies%pieces%turned(:, bodies%pieces%vertex_start(i):bodies%pieces%vertex_start(i + 1) - 1))
            reach(i) = sqrt(maxval(v(1, :)**2 + v(2, :)**2))
         end associate
      end do
      count_overlaps = 0
      do j = 2_ip, bodies%n
         do i = 1_ip, j - 1_ip
            if (bodies%fixed(i) .and. bodies%fixed(j)) cycle
            distance = bodies%position(:, i) - bodies%position(:, j)
            if (distance(1)**2 + distance(2)**2 > (reach(i) + reach(j))**2) cycle
            if (meet(i, j)) count_overlaps = count_overlaps + 1
         end do
      end do

   contains

      !> Whether some pieces of two bodies have no separating edge
      logical function meet(a, b)
         integer(ip), intent(in) :: a, b
         real(wp), allocatable :: p(:, :), q(:, :)
         integer(ip) :: of_a(2), of_b(2), k, l

         meet = .false.
         of_a = bodies%pieces%pieces_of(a)
         of_b = bodies%pieces%pieces_of(b)
         do k = of_a(1), of_a(2)
            p = bodies%pieces%turned_piece(k)
            p = p + spread(bodies%position(:, a), 2, size(p, 2))
            do l = of_b(1), of_b(2)
               q = bodies%pieces%turned_piece(l)
               q = q + spread(bodies%position(:, b), 2, size(q, 2))
               meet = meet .or. .not. (separated(p, q) .or. separated(q, p))
            end do
         end do
      end function meet

   end function count_overlaps

   !> Whether all of b lies outside some edge of a
   logical function separated(a, b)
      real(wp), intent(in) :: a(:, :), b(:, :)
      real(wp) :: edge(2)
      integer :: k

      separated = .true.
      do k = 1, size(a, 2)
         edge = a(:, modulo(k, size(a, 2)) + 1) - a(:, k)
         if (all(edge(1)*(b(2, :) - a(2, k)) - edge(2)*(b(1, :) - a(1, k)) <= 0.0_wp)) return
      end do
      separated = .false.
   end function separated

   !> Number of coordinates that differ in two sets of bodies; -1 if their numbers of corners differ
   integer function count_differences(a, b)
      !> Bodies
      type(bodies_t), intent(in) :: a
      !> Other bodies
      type(bodies_t), intent(in) :: b

      count_differences = -1
      if (a%n /= b%n .or. size(a%pieces%vertex, 2) /= size(b%pieces%vertex, 2)) return
      count_differences = count(abs(a%pieces%vertex - b%pieces%vertex) > 0.0_wp) &
                                   + count(abs(a%position - b%position) > 0.0_wp) &
                                   + count(abs(a%velocity - b%velocity) > 0.0_wp)
   end function count_differences

end module scene_checks
