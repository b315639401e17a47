!> The polygons of bodies, called pieces: what overlaps. A body moves, a piece has an outline, and a box bounds a piece
!> or a part of it; pairs of the pair list are pairs of pieces, forces act on bodies.
!>
!> Each body has one piece, of the same index. Vertices are packed: piece p owns the columns
!> `vertex_start(p) : vertex_start(p + 1) - 1`, anticlockwise, of two arrays. Both are relative to the centre of mass.
module polydem_pieces
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: pieces_t

   !> Convex polygons
   type :: pieces_t
      !> First vertex of each piece, (number of pieces + 1)
      integer(ip), allocatable :: vertex_start(:)
      !> Vertices in the body frame, at angle 0, (2, vertex) [m]. They never change
      real(wp), allocatable :: vertex(:, :)
      !> The same turned by the angle of the body, (2, vertex) [m]
      real(wp), allocatable :: turned(:, :)
   contains
      procedure :: polygon
      procedure :: turned_polygon
   end type pieces_t

contains

   !> Vertices of a piece in the body frame, (2, vertex) [m]
   pure function polygon(self, p)
      class(pieces_t), intent(in) :: self
      !> Index of the piece
      integer(ip), intent(in) :: p
      real(wp) :: polygon(2, self%vertex_start(p + 1_ip) - self%vertex_start(p))

      polygon = self%vertex(:, self%vertex_start(p):self%vertex_start(p + 1_ip) - 1_ip)
   end function polygon

   !> Vertices of a piece turned by the angle of its body, (2, vertex) [m]
   pure function turned_polygon(self, p)
      class(pieces_t), intent(in) :: self
      !> Index of the piece
      integer(ip), intent(in) :: p
      real(wp) :: turned_polygon(2, self%vertex_start(p + 1_ip) - self%vertex_start(p))

      turned_polygon = self%turned(:, self%vertex_start(p):self%vertex_start(p + 1_ip) - 1_ip)
   end function turned_polygon

end module polydem_pieces
