!> Axis-aligned bounding boxes: the only input of neighbour finders.
module polydem_boxes
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: boxes_t

   !> Boxes 1..n. A body of common size has one box. A large body has several boxes, which overlap slightly.
   type :: boxes_t
      !> Number of boxes
      integer(ip) :: n = 0_ip
      !> Number of bodies
      integer(ip) :: n_bodies = 0_ip
      !> Whether box k belongs to body k for every k (no body is cut)
      logical :: one_to_one = .true.
      !> xmin, ymin, xmax, ymax of each closed box, (4, box) [m]; half a cache line per box
      real(wp), allocatable :: bounds(:, :)
      !> Slot of the body of each box, ascending
      integer(ip), allocatable :: body(:)
      !> Whether that body is fixed
      logical, allocatable :: fixed(:)
      !> Whether that body is passive: fixed, or moved by another rank. Two passive bodies never form a pair
      logical, allocatable :: passive(:)
      !> Upper bound of the half sides of a box at any angle of its body [m]
      real(wp), allocatable :: reach(:)
   end type boxes_t

end module polydem_boxes
