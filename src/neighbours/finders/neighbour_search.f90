!> From bodies to pairs: the maker of the boxes, the boxes, and the pairs that a finder finds from them.
module polydem_neighbour_search
   use polydem_box_maker, only: box_maker_t
   use polydem_boxes, only: boxes_t
   use polydem_neighbours, only: neighbours_t
   implicit none
   private
   public :: neighbour_search_t

   !> Boxes of the bodies, and the pairs of those that overlap
   type :: neighbour_search_t
      !> Maker of the bounding boxes
      type(box_maker_t) :: maker
      !> Bounding boxes
      type(boxes_t) :: boxes
      !> Pairs of pieces whose boxes overlap
      type(neighbours_t) :: neighbours
   end type neighbour_search_t

end module polydem_neighbour_search
