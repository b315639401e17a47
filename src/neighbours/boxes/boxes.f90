!> Axis-aligned bounding boxes: the only input of neighbour finders.
module polydem_boxes
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: boxes_t

   !> Boxes 1..n. A piece of common size has one box. A large piece has several boxes, which overlap slightly. In a
   !> periodic cell boxes near its border have images behind all others (`polydem_box_images`).
   type :: boxes_t
      !> Number of boxes
      integer(ip) :: n = 0_ip
      !> Number of pieces
      integer(ip) :: n_pieces = 0_ip
      !> Whether box k bounds piece k, which belongs to body k, for every k
      logical :: one_to_one = .true.
      !> xmin, ymin, xmax, ymax of each closed box, (4, box) [m]; half a cache line per box
      real(wp), allocatable :: bounds(:, :)
      !> Piece of each box, ascending but for images. A pair of boxes is recorded as the pair of their pieces
      integer(ip), allocatable :: piece(:)
      !> Slot of the body of each box, ascending but for images
      integer(ip), allocatable :: body(:)
      !> Whether that body is fixed
      logical, allocatable :: fixed(:)
      !> Whether that body is passive: fixed, or moved by another rank, or the box is an image. Two passive boxes never
      !> form a pair
      logical, allocatable :: passive(:)
      !> Upper bound of the half sides of a box at any angle of its body [m]
      real(wp), allocatable :: reach(:)
   contains
      procedure :: may_meet
   end type boxes_t

contains

   !> Whether two boxes can form a pair: they belong to two bodies and are not both passive. All finders ask here.
   pure logical function may_meet(self, i, j)
      class(boxes_t), intent(in) :: self
      !> Indices of the boxes
      integer(ip), intent(in) :: i, j

      may_meet = self%body(i) /= self%body(j) .and. .not. (self%passive(i) .and. self%passive(j))
   end function may_meet

end module polydem_boxes
