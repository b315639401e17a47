!> A finder that is wrong: it records the end of a pair that never began.
module invented_pair
   use polydem_boxes, only: boxes_t
   use polydem_finder, only: finder_t
   use polydem_kinds, only: ip
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: invented_pair_t

   !> The finder
   type, extends(finder_t) :: invented_pair_t
   contains
      procedure :: find
      procedure :: survey
   end type invented_pair_t

contains

   !> Record the end of the pair of the first and the last body, which are far apart.
   subroutine find(self, boxes, changes)
      class(invented_pair_t), intent(inout) :: self
      type(boxes_t), intent(in) :: boxes
      type(pair_changes_t), intent(inout) :: changes

      self%work%thorough = .false.
      call changes%record(1_ip, boxes%n_pieces, -2_ip)
   end subroutine find

   !> There is nothing to count.
   subroutine survey(self)
      class(invented_pair_t), intent(inout) :: self

      self%work%thorough = .false.
   end subroutine survey

end module invented_pair
