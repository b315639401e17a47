!> Grains without positions: one of them, and a list of them in little memory.
!>
!> A grain may have several convex pieces, as a cross has. Its corners are then those of one piece after the other, and
!> the number of the piece of each corner is stored as for bodies.
module polydem_grain_list
   use polydem_grow, only: grow
   use polydem_kinds, only: ip, lp, wp
   use polydem_polygon, only: mass_properties
   use polydem_polygon_list, only: polygon_list_t
   implicit none
   private
   public :: grain_t, grains_t, corners_of_piece, area_of_grain

   !> One grain without a position
   type :: grain_t
      !> Corners relative to an inner point (the centre of the ellipse), anticlockwise, those of each piece in turn,
      !> (2, corner) [m]
      real(wp), allocatable :: corners(:, :)
      !> Number of the piece of each corner, from 0; not allocated: one piece
      integer(ip), allocatable :: piece(:)
      !> Upper bound of twice the distance of a corner from that point, such as the long axis of the ellipse [m]
      real(wp) :: length = 0.0_wp
      !> Area of the polygon [m2]
      real(wp) :: area = 0.0_wp
   end type grain_t

   !> Grains without positions, in little memory: a list of their corners
   type, extends(polygon_list_t) :: grains_t
      !> As in `grain_t`, (grain)
      real(wp), allocatable :: length(:), area(:)
      !> Number of the piece of each corner of all grains, from 0 in each; not allocated: every grain has one piece
      integer(ip), allocatable :: piece(:)
   contains
      procedure :: start
      procedure :: append
      procedure :: pieces_of
      procedure :: n_pieces
      procedure :: most_pieces
      procedure :: piece_polygon
   end type grains_t

contains

   !> Make room for all grains.
   subroutine start(self, n, most_corners)
      class(grains_t), intent(inout) :: self
      !> Number of grains
      integer(ip), intent(in) :: n
      !> Greatest number of corners of a grain
      integer(ip), intent(in) :: most_corners

      allocate (self%length(n), self%area(n))
      call self%reserve(n, int(n, lp)*int(most_corners, lp))
   end subroutine start

   !> Append a grain.
   pure subroutine append(self, grain)
      class(grains_t), intent(inout) :: self
      !> The grain
      type(grain_t), intent(in) :: grain
      integer(ip) :: last

      call self%append_polygon(grain%corners)
      self%length(self%n) = grain%length
      self%area(self%n) = grain%area
      last = self%first(self%n + 1_ip) - 1_ip
      if (allocated(grain%piece) .and. .not. allocated(self%piece)) &
         allocate (self%piece(size(self%vertex, 2)), source=0_ip)
      if (.not. allocated(self%piece)) return
      if (last > size(self%piece)) call grow(self%piece, self%first(self%n) - 1_ip, 2_ip*last)
      self%piece(self%first(self%n):last) = 0_ip
      if (allocated(grain%piece)) self%piece(self%first(self%n):last) = grain%piece
   end subroutine append

   !> Number of the piece of each corner of a grain, from 0
   pure function pieces_of(self, k) result(piece)
      class(grains_t), intent(in) :: self
      !> Number of the grain
      integer(ip), intent(in) :: k
      integer(ip) :: piece(self%first(k + 1_ip) - self%first(k))

      piece = 0_ip
      if (allocated(self%piece)) piece = self%piece(self%first(k):self%first(k + 1_ip) - 1_ip)
   end function pieces_of

   !> Number of pieces of a grain
   pure integer(ip) function n_pieces(self, k)
      class(grains_t), intent(in) :: self
      !> Number of the grain
      integer(ip), intent(in) :: k

      n_pieces = 1_ip
      if (allocated(self%piece)) n_pieces = self%piece(self%first(k + 1_ip) - 1_ip) + 1_ip
   end function n_pieces

   !> Greatest number of pieces of a grain
   pure integer(ip) function most_pieces(self)
      class(grains_t), intent(in) :: self

      most_pieces = 1_ip
      if (allocated(self%piece)) most_pieces = maxval(self%piece(:self%first(self%n + 1_ip) - 1_ip)) + 1_ip
   end function most_pieces

   !> Corners of a piece, relative to the same point as those of the grain, (2, corner) [m]
   pure function piece_polygon(self, k, p) result(corners)
      class(grains_t), intent(in) :: self
      !> Number of the grain, and number of the piece, from 0
      integer(ip), intent(in) :: k, p
      real(wp), allocatable :: corners(:, :)

      corners = corners_of_piece(self%polygon(k), self%pieces_of(k), p)
   end function piece_polygon

   !> Corners of a piece among those of all pieces, (2, corner)
   pure function corners_of_piece(corners, piece, p) result(chosen)
      !> All corners
      real(wp), intent(in) :: corners(:, :)
      !> Number of the piece of each corner, from 0 and ascending
      integer(ip), intent(in) :: piece(:)
      !> Number of the piece
      integer(ip), intent(in) :: p
      real(wp) :: chosen(2, count(piece == p))
      integer :: first

      first = findloc(piece, p, dim=1)
      chosen = corners(:, first:first + size(chosen, 2) - 1)
   end function corners_of_piece

   !> Area of a grain: the sum of those of its pieces [m2]
   pure real(wp) function area_of_grain(grain)
      !> The grain
      type(grain_t), intent(in) :: grain
      real(wp) :: area, centroid(2), second_moment
      integer(ip) :: p

      if (.not. allocated(grain%piece)) then
         call mass_properties(grain%corners, area_of_grain, centroid, second_moment)
         return
      end if
      area_of_grain = 0.0_wp
      do p = 0_ip, maxval(grain%piece)
         call mass_properties(corners_of_piece(grain%corners, grain%piece, p), area, centroid, second_moment)
         area_of_grain = area_of_grain + area
      end do
   end function area_of_grain

end module polydem_grain_list
