!> Neighbour stage of the time step. Its input are the boxes; its output is the ascending list of pairs of pieces whose
!> boxes overlap. It knows no finder by name; `polydem_new_neighbours` makes one.
module polydem_neighbours
   use polydem_boxes, only: boxes_t
   use polydem_counters, only: counters_t, over_steps
   use polydem_finder, only: finder_t
   use polydem_finder_statistics, only: finder_statistics_t, phase_merge, phase_order
   use polydem_kinds, only: ip, lp
   use polydem_pair_changes, only: pair_changes_t
   use polydem_pair_list, only: pair_list_t
   implicit none
   private
   public :: neighbours_t, start_neighbours, restart_neighbours

   !> Finder, list of changes, and list of pairs
   type :: neighbours_t
      !> Pairs of pieces whose boxes overlap
      type(pair_list_t) :: pairs
      !> Finder of changes
      class(finder_t), allocatable :: finder
      !> Changes of the last step
      type(pair_changes_t) :: changes
      !> Copy of the finder in its initial state
      class(finder_t), allocatable, private :: unused
      !> Number of boxes and pieces of the last step
      integer(ip), private :: n_boxes = 0_ip, n_pieces = 0_ip
   contains
      procedure :: set_finder
      procedure :: update
      procedure :: find
      procedure :: order
      procedure :: merge => merge_changes
      procedure :: change_finder
      procedure :: report
   end type neighbours_t

contains

   !> Make the stage with an empty list and a given finder.
   subroutine start_neighbours(self, finder, boxes)
      !> Stage to make
      type(neighbours_t), intent(out) :: self
      !> Finder in its initial state
      class(finder_t), intent(in) :: finder
      !> Boxes of the first step; only their number, pieces and bodies are used
      type(boxes_t), intent(in) :: boxes

      allocate (self%unused, source=finder)
      allocate (self%finder, source=finder)
      self%n_boxes = boxes%n
      self%n_pieces = boxes%n_pieces
      call self%pairs%start(boxes%one_to_one, boxes%n_pieces)
   end subroutine start_neighbours

   !> Set the finder with which the next `restart_neighbours` starts.
   subroutine set_finder(self, finder)
      class(neighbours_t), intent(inout) :: self
      !> Finder in its initial state
      class(finder_t), intent(in) :: finder

      if (allocated(self%unused)) deallocate (self%unused)
      allocate (self%unused, source=finder)
   end subroutine set_finder

   !> Start again with an empty list and the chosen finder in its initial state. Its statistics are preserved.
   subroutine restart_neighbours(self, boxes)
      !> Stage with a finder
      type(neighbours_t), intent(inout) :: self
      !> Boxes of the next step; only their number, pieces and bodies are used
      type(boxes_t), intent(in) :: boxes
      class(finder_t), allocatable :: unused
      type(finder_statistics_t) :: statistics

      if (allocated(self%finder)) then
         statistics = self%finder%work
         call self%finder%release()
      end if
      call move_alloc(self%unused, unused)
      call start_neighbours(self, unused, boxes)
      self%finder%work%value = statistics%value
      self%finder%work%seconds = statistics%seconds
   end subroutine restart_neighbours

   !> Update the list of pairs to the boxes of a step.
   subroutine update(self, boxes)
      class(neighbours_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes

      call self%find(boxes)
      call self%order()
      call self%merge()
   end subroutine update

   !> First part of `update`: the finder records the changes. If the number of boxes or pieces has changed, slots may
   !> belong to other pieces; all pairs then end, and the finder starts again.
   subroutine find(self, boxes)
      class(neighbours_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes

      call self%finder%work%start()
      if (boxes%n /= self%n_boxes .or. boxes%n_pieces /= self%n_pieces) then
         call self%finder%release()
         deallocate (self%finder)
         allocate (self%finder, source=self%unused)
         call self%finder%work%start()
         self%n_boxes = boxes%n
         self%n_pieces = boxes%n_pieces
         call self%pairs%forget(boxes%one_to_one, boxes%n_pieces)
      end if
      call self%changes%clear()
      call self%finder%find(boxes, self%changes)
   end subroutine find

   !> Second part of `update`: sort the changes.
   subroutine order(self)
      class(neighbours_t), intent(inout) :: self

      call self%finder%work%start()
      call self%changes%order()
      call self%finder%work%lap(phase_order)
   end subroutine order

   !> Third part of `update`: apply the changes to the list.
   subroutine merge_changes(self)
      class(neighbours_t), intent(inout) :: self

      call self%finder%work%start()
      call self%pairs%apply(self%changes)
      call self%finder%work%lap(phase_merge)
   end subroutine merge_changes

   !> Replace the finder. The list does not change because all finders find the same pairs. The new finder starts with
   !> the boxes of the last step.
   subroutine change_finder(self, finder, boxes)
      class(neighbours_t), intent(inout) :: self
      !> Finder in its initial state
      class(finder_t), intent(in) :: finder
      !> Boxes of the last step
      type(boxes_t), intent(in) :: boxes

      call self%finder%release()
      deallocate (self%unused, self%finder)
      allocate (self%unused, source=finder)
      allocate (self%finder, source=finder)
      call self%changes%clear()
      call self%finder%work%start()
      call self%finder%find(boxes, self%changes)
   end subroutine change_finder

   !> Set the counters of the list of pairs and of the finder.
   subroutine report(self, counters)
      class(neighbours_t), intent(inout) :: self
      !> Counters to set
      type(counters_t), intent(inout) :: counters

      call counters%set('pairs', int(self%pairs%n, lp))
      call counters%set('pair contradictions', self%pairs%contradictions, over_steps)
      call self%finder%survey()
      call self%finder%work%report(counters)
   end subroutine report

end module polydem_neighbours
