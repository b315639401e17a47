!> The polygons of bodies, called pieces: what overlaps. A body moves, a piece is a convex polygon, and a box bounds a
!> piece or a part of it; pairs of the pair list are pairs of pieces, forces act on bodies.
!>
!> Vertices are packed: body s owns the columns `vertex_start(s) : vertex_start(s + 1) - 1` of two arrays, relative to
!> its centre of mass. If every body of the run has one piece, piece s is that of body s, and nothing else is stored.
!> Otherwise the vertices of a body are those of its pieces, one piece after the other, each anticlockwise. The one
!> column `number` says where they begin; files and messages between ranks have it beside the vertices, and
!> `find_pieces` derives the rest. Pieces are numbered in the order of their bodies.
module polydem_pieces
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: greatest_radius, mass_properties, signed_area, thickness_of => thickness
   implicit none
   private
   public :: pieces_t

   !> Convex polygons
   type :: pieces_t
      !> Greatest number of pieces of a body of the run. If it is 1, what follows `turned` is not allocated
      integer(ip) :: most = 1_ip
      !> First vertex of each body, (number of bodies + 1)
      integer(ip), allocatable :: vertex_start(:)
      !> Vertices in the body frame, at angle 0, (2, vertex) [m]. They never change
      real(wp), allocatable :: vertex(:, :)
      !> The same turned by the angle of the body, (2, vertex) [m]
      real(wp), allocatable :: turned(:, :)
      !> Number of the piece of each vertex within its body, from 0, (vertex)
      integer(ip), allocatable :: number(:)
      !> First piece of each body, (number of bodies + 1)
      integer(ip), allocatable :: first(:)
      !> Slot of the body of each piece, (piece)
      integer(ip), allocatable :: body(:)
      !> First vertex of each piece, (number of pieces + 1)
      integer(ip), allocatable :: start(:)
      !> Centroid of each piece in the body frame, and turned, (2, piece) [m]
      real(wp), allocatable :: centre(:, :), arm(:, :)
      !> Greatest distance of a vertex of each piece from its centroid, (piece) [m]
      real(wp), allocatable :: radius(:)
      !> Twice the least distance of an edge of each piece from its centroid, (piece) [m]
      real(wp), allocatable :: thickness(:)
      !> Turned vertices relative to the centroid of their piece, (2, vertex) [m]
      real(wp), allocatable :: outline(:, :)
   contains
      procedure :: polygon
      procedure :: turned_polygon
      procedure :: piece_polygon
      procedure :: turned_piece
      procedure :: numbers_of
      procedure :: pieces_of
      procedure :: first_of
      procedure :: n_pieces
      procedure :: body_of
      procedure :: bodies_of
      procedure :: area_of
      procedure :: area_of_piece
      procedure :: second_moment_of
      procedure :: allow
      procedure :: find_pieces
      procedure :: turn_pieces
   end type pieces_t

contains

   !> Vertices of a body in its frame, (2, vertex) [m]
   pure function polygon(self, s)
      class(pieces_t), intent(in) :: self
      !> Slot of the body
      integer(ip), intent(in) :: s
      real(wp) :: polygon(2, self%vertex_start(s + 1_ip) - self%vertex_start(s))

      polygon = self%vertex(:, self%vertex_start(s):self%vertex_start(s + 1_ip) - 1_ip)
   end function polygon

   !> Vertices of a body turned by its angle, (2, vertex) [m]
   pure function turned_polygon(self, s)
      class(pieces_t), intent(in) :: self
      !> Slot of the body
      integer(ip), intent(in) :: s
      real(wp) :: turned_polygon(2, self%vertex_start(s + 1_ip) - self%vertex_start(s))

      turned_polygon = self%turned(:, self%vertex_start(s):self%vertex_start(s + 1_ip) - 1_ip)
   end function turned_polygon

   !> Vertices of a piece in the frame of its body, (2, vertex) [m]
   pure function piece_polygon(self, p) result(polygon)
      class(pieces_t), intent(in) :: self
      !> Index of the piece
      integer(ip), intent(in) :: p
      real(wp), allocatable :: polygon(:, :)

      if (self%most == 1_ip) then
         polygon = self%polygon(p)
      else
         polygon = self%vertex(:, self%start(p):self%start(p + 1_ip) - 1_ip)
      end if
   end function piece_polygon

   !> Vertices of a piece turned by the angle of its body, relative to the centre of the body, (2, vertex) [m]
   pure function turned_piece(self, p) result(polygon)
      class(pieces_t), intent(in) :: self
      !> Index of the piece
      integer(ip), intent(in) :: p
      real(wp), allocatable :: polygon(:, :)

      if (self%most == 1_ip) then
         polygon = self%turned_polygon(p)
      else
         polygon = self%turned(:, self%start(p):self%start(p + 1_ip) - 1_ip)
      end if
   end function turned_piece

   !> Number of the piece of each vertex of a body, from 0
   pure function numbers_of(self, s) result(numbers)
      class(pieces_t), intent(in) :: self
      !> Slot of the body
      integer(ip), intent(in) :: s
      integer(ip) :: numbers(self%vertex_start(s + 1_ip) - self%vertex_start(s))

      numbers = 0_ip
      if (self%most > 1_ip) numbers = self%number(self%vertex_start(s):self%vertex_start(s + 1_ip) - 1_ip)
   end function numbers_of

   !> First and last piece of a body
   pure function pieces_of(self, s) result(pieces)
      class(pieces_t), intent(in) :: self
      !> Slot of the body
      integer(ip), intent(in) :: s
      integer(ip) :: pieces(2)

      pieces = s
      if (self%most > 1_ip) pieces = [self%first(s), self%first(s + 1_ip) - 1_ip]
   end function pieces_of

   !> First piece of a body
   pure integer(ip) function first_of(self, s)
      class(pieces_t), intent(in) :: self
      !> Slot of the body
      integer(ip), intent(in) :: s

      first_of = s
      if (self%most > 1_ip) first_of = self%first(s)
   end function first_of

   !> Number of pieces of all bodies of this rank
   pure integer(ip) function n_pieces(self)
      class(pieces_t), intent(in) :: self

      n_pieces = size(self%vertex_start, kind=ip) - 1_ip
      if (self%most > 1_ip) n_pieces = size(self%body, kind=ip)
   end function n_pieces

   !> Slot of the body of a piece
   pure integer(ip) function body_of(self, p)
      class(pieces_t), intent(in) :: self
      !> Index of the piece
      integer(ip), intent(in) :: p

      body_of = p
      if (self%most > 1_ip) body_of = self%body(p)
   end function body_of

   !> Slots of the bodies of some pieces, 0 for the piece 0
   pure function bodies_of(self, pieces) result(slots)
      class(pieces_t), intent(in) :: self
      !> Indices of the pieces
      integer(ip), intent(in) :: pieces(:)
      integer(ip) :: slots(size(pieces))
      integer(ip) :: k

      do k = 1_ip, size(pieces, kind=ip)
         slots(k) = 0_ip
         if (pieces(k) > 0_ip) slots(k) = self%body_of(pieces(k))
      end do
   end function bodies_of

   !> Area of a body: the sum of the areas of its pieces [m2]
   pure real(wp) function area_of(self, s) result(area)
      class(pieces_t), intent(in) :: self
      !> Slot of the body
      integer(ip), intent(in) :: s
      integer(ip) :: p

      if (self%most == 1_ip) then
         area = signed_area(self%polygon(s))
         return
      end if
      area = 0.0_wp
      do p = self%first(s), self%first(s + 1_ip) - 1_ip
         area = area + self%area_of_piece(p)
      end do
   end function area_of

   !> Area of a piece [m2]
   pure real(wp) function area_of_piece(self, p) result(area)
      class(pieces_t), intent(in) :: self
      !> Index of the piece
      integer(ip), intent(in) :: p

      area = signed_area(self%piece_polygon(p))
   end function area_of_piece

   !> Polar second moment of area of a body about its centre: the sum of those of its pieces [m4]
   pure real(wp) function second_moment_of(self, s) result(sum_of)
      class(pieces_t), intent(in) :: self
      !> Slot of the body
      integer(ip), intent(in) :: s
      real(wp) :: area, centroid(2), own
      integer(ip) :: of_body(2), p

      sum_of = 0.0_wp
      of_body = self%pieces_of(s)
      do p = of_body(1), of_body(2)
         call mass_properties(self%piece_polygon(p), area, centroid, own)
         sum_of = sum_of + (own + area*(centroid(1)*centroid(1) + centroid(2)*centroid(2)))
      end do
   end function second_moment_of

   !> Allow bodies of a number of pieces in the run, which the bodies here need not have.
   pure subroutine allow(self, most)
      class(pieces_t), intent(inout) :: self
      !> The number
      integer(ip), intent(in) :: most

      if (most <= self%most) return
      if (self%most == 1_ip) allocate (self%number(size(self%vertex, 2)), source=0_ip)
      self%most = most
      call self%find_pieces()
   end subroutine allow

   !> Derive the pieces from the vertices and the column `number`. Without this column nothing is done.
   pure subroutine find_pieces(self)
      class(pieces_t), intent(inout) :: self
      integer(ip) :: n, p, s, v
      real(wp) :: area, second_moment

      if (self%most == 1_ip) return
      n = 0_ip
      associate (n_bodies => size(self%vertex_start, kind=ip) - 1_ip, n_vertices => size(self%vertex, 2, kind=ip))
         do s = 1_ip, n_bodies
            n = n + 1_ip + self%number(self%vertex_start(s + 1_ip) - 1_ip)
         end do
         if (allocated(self%first)) &
            deallocate (self%first, self%body, self%start, self%centre, self%arm, self%radius, self%thickness, &
                        self%outline)
         allocate (self%first(n_bodies + 1_ip), self%body(n), self%start(n + 1_ip), self%centre(2, n), self%arm(2, n), &
                   self%radius(n), self%thickness(n), self%outline(2, n_vertices))
         p = 0_ip
         do s = 1_ip, n_bodies
            self%first(s) = p + 1_ip
            do v = self%vertex_start(s), self%vertex_start(s + 1_ip) - 1_ip
               if (v > self%vertex_start(s)) then
                  if (self%number(v) == self%number(v - 1_ip)) cycle
               end if
               p = p + 1_ip
               self%start(p) = v
               self%body(p) = s
            end do
         end do
         self%first(n_bodies + 1_ip) = p + 1_ip
         self%start(p + 1_ip) = n_vertices + 1_ip
      end associate
      do p = 1_ip, n
         associate (shape => self%vertex(:, self%start(p):self%start(p + 1_ip) - 1_ip))
            call mass_properties(shape, area, self%centre(:, p), second_moment)
            self%radius(p) = greatest_radius(shape - spread(self%centre(:, p), 2, size(shape, 2)))
            self%thickness(p) = thickness_of(shape - spread(self%centre(:, p), 2, size(shape, 2)))
            self%outline(:, self%start(p):self%start(p + 1_ip) - 1_ip) = &
               shape - spread(self%centre(:, p), 2, size(shape, 2))
         end associate
      end do
      self%arm(:, :) = self%centre
   end subroutine find_pieces

   !> Turn the centroids of the pieces of some bodies, and set their outlines from the turned vertices.
   pure subroutine turn_pieces(self, slots, direction)
      class(pieces_t), intent(inout) :: self
      !> Slots of the bodies, whose vertices are turned
      integer(ip), intent(in) :: slots(:)
      !> Cosine and sine of the angle of each, (2, body)
      real(wp), intent(in) :: direction(:, :)
      integer(ip) :: k, p, v

      do k = 1_ip, size(slots, kind=ip)
         do p = self%first(slots(k)), self%first(slots(k) + 1_ip) - 1_ip
            self%arm(1, p) = direction(1, k)*self%centre(1, p) - direction(2, k)*self%centre(2, p)
            self%arm(2, p) = direction(1, k)*self%centre(2, p) + direction(2, k)*self%centre(1, p)
            do v = self%start(p), self%start(p + 1_ip) - 1_ip
               self%outline(1, v) = self%turned(1, v) - self%arm(1, p)
               self%outline(2, v) = self%turned(2, v) - self%arm(2, p)
            end do
         end do
      end do
   end subroutine turn_pieces

end module polydem_pieces
