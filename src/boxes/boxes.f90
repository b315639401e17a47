!> Axis-aligned bounding boxes, the only thing that neighbour finders see.
module polydem_boxes
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: boxes_t, far

   !> Greatest coordinate and greatest half side: what finders make of two boxes is then finite [m]
   real(wp), parameter :: far = 0.25_wp*huge(1.0_wp)

   !> Boxes 1..n. A body of particle size has one box; a large one is cut into several that overlap a little.
   type :: boxes_t
      !> Number of boxes
      integer(ip) :: n = 0_ip
      !> Number of bodies
      integer(ip) :: n_bodies = 0_ip
      !> Whether box k belongs to body k for every k (no body is cut)
      logical :: one_to_one = .true.
      !> xmin, ymin, xmax, ymax of each box, (4, box), closed [m]; a box is half a cache line
      real(wp), allocatable :: bounds(:, :)
      !> Slot of the body that a box belongs to; ascending
      integer(ip), allocatable :: body(:)
      !> Whether that body is fixed
      logical, allocatable :: fixed(:)
      !> Whether it is fixed, or moved by another process: two passive bodies never make a pair
      logical, allocatable :: passive(:)
      !> Greatest half side that a box can have at any angle of its body [m]
      real(wp), allocatable :: reach(:)
   end type boxes_t

end module polydem_boxes
