!> What every neighbour finder promises.
!>
!> Contract. Two boxes overlap if they share a point (touching counts). A finder looks at the boxes of a
!> step and records every change since the step before: which boxes of different bodies, not both passive,
!> began to overlap, and which ceased to. It may record a change and its reverse in one step (they
!> cancel), and in any order; nothing may be missing and nothing be recorded twice. Before the first step
!> nothing overlaps. `pair_list_t` turns the changes of boxes into the ascending list of pairs of bodies.
!>
!> What a finder remembers between steps is its own. Between steps boxes may move anywhere, but their
!> number, bodies and passiveness stay.
!>
!> A finder counts its work exactly and books its time under the phases of `polydem_work`.
module polydem_finder
   use polydem_boxes, only: boxes_t
   use polydem_pair_changes, only: pair_changes_t
   use polydem_work, only: work_t
   implicit none
   private
   public :: finder_t

   !> A neighbour finder
   type, abstract :: finder_t
      !> Counts and seconds so far
      type(work_t) :: work
   contains
      !> Record the changes of a step
      procedure(find), deferred :: find
      !> Set the counts that describe the present
      procedure(survey), deferred :: survey
   end type finder_t

   abstract interface
      !> Record which boxes began and which ceased to overlap since the last call. The clock of `work` runs when
      !> this is called, and all time is booked when it returns.
      subroutine find(self, boxes, changes)
         import :: boxes_t, finder_t, pair_changes_t
         class(finder_t), intent(inout) :: self
         !> Boxes of this step
         type(boxes_t), intent(in) :: boxes
         !> Changes, appended to what is there
         type(pair_changes_t), intent(inout) :: changes
      end subroutine find

      !> Set those counts of `work` that describe the present: candidates, nodes, depth and bytes.
      subroutine survey(self)
         import :: finder_t
         class(finder_t), intent(inout) :: self
      end subroutine survey
   end interface

end module polydem_finder
