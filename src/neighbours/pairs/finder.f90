!> Interface of all neighbour finders.
!>
!> Contract. Two boxes overlap if they share a point (touching counts). In each step a finder records every change since
!> the previous step: the pairs of boxes that began to overlap and those that ceased to. Boxes of the same body and
!> boxes of two passive bodies form no pairs. Changes may be in any order. A change and its reverse in one step cancel
!> and are allowed. No other change may be missing or recorded twice. Before the first step no boxes overlap.
!> `pair_list_t` turns the changes of boxes into the ascending list of pairs of pieces.
!>
!> A finder may keep any internal state between steps. Boxes may move anywhere between steps; their number, their bodies
!> and the passive flags are constant.
!>
!> A finder counts its operations exactly, and accumulates its time in the phases of `polydem_finder_statistics`.
module polydem_finder
   use polydem_boxes, only: boxes_t
   use polydem_finder_statistics, only: finder_statistics_t
   use polydem_instruction_set, only: isa_base
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: finder_t

   !> A neighbour finder
   type, abstract :: finder_t
      !> Finder statistics: counts and seconds so far
      type(finder_statistics_t) :: work
      !> Instruction set of the kernels; set before the first step
      integer :: isa = isa_base
   contains
      !> Record the changes of a step
      procedure(find), deferred :: find
      !> Set the counts that describe the present state
      procedure(survey), deferred :: survey
      !> Free what the compiler does not free when a finder is deallocated
      procedure :: release
   end type finder_t

   abstract interface
      !> Record the boxes that began and those that ceased to overlap since the last call. The clock of `work` must run
      !> when this is called. All time is in the phases when it returns.
      subroutine find(self, boxes, changes)
         import :: boxes_t, finder_t, pair_changes_t
         class(finder_t), intent(inout) :: self
         !> Boxes of this step
         type(boxes_t), intent(in) :: boxes
         !> Changes; those of this step are appended
         type(pair_changes_t), intent(inout) :: changes
      end subroutine find

      !> Set the counts of `work` that describe the present state: candidates, nodes, depth and bytes.
      subroutine survey(self)
         import :: finder_t
         class(finder_t), intent(inout) :: self
      end subroutine survey
   end interface

contains

   !> Most finders have nothing to free.
   subroutine release(self)
      class(finder_t), intent(inout) :: self

      associate (unused => self)
      end associate
   end subroutine release

end module polydem_finder
