!> The neighbourhood stage of the time step: boxes in, ascending list of pairs of bodies out.
module polydem_neighbours
   use polydem_boxes, only: boxes_t
   use polydem_counters, only: counters_t
   use polydem_errors, only: error_t
   use polydem_finder, only: finder_t
   use polydem_finder_factory, only: new_finder
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_changes, only: pair_changes_t
   use polydem_pair_list, only: pair_list_t
   use polydem_work, only: phase_merge, phase_order
   implicit none
   private
   public :: neighbours_t, new_neighbours

   !> A finder, the changes that it finds and the list that they change
   type :: neighbours_t
      !> Pairs of bodies whose boxes overlap
      type(pair_list_t) :: pairs
      !> What looks for changes
      class(finder_t), allocatable :: finder
      !> Changes of the last step
      type(pair_changes_t) :: changes
      !> Name of the finder
      character(len=:), allocatable :: name
      !> Skin of a Verlet list [m]; 0: automatic
      real(wp), private :: skin = 0.0_wp
      !> Boxes and bodies of the last step
      integer(ip), private :: n_boxes = 0_ip, n_bodies = 0_ip
   contains
      procedure :: update
      procedure :: find
      procedure :: order
      procedure :: merge => merge_changes
      procedure :: change_finder
      procedure :: report
   end type neighbours_t

contains

   !> Begin with an empty list.
   subroutine new_neighbours(self, finder_name, boxes, error, skin)
      !> Stage to make
      type(neighbours_t), intent(out) :: self
      !> Name of the finder
      character(len=*), intent(in) :: finder_name
      !> Boxes to come; only their number and bodies matter
      type(boxes_t), intent(in) :: boxes
      !> Allocated if there is no such finder
      type(error_t), allocatable, intent(inout) :: error
      !> Skin of a Verlet list [m]; 0 or left out: automatic
      real(wp), intent(in), optional :: skin

      if (present(skin)) self%skin = skin
      call new_finder(self%finder, finder_name, error, self%skin)
      if (allocated(error)) return
      self%name = finder_name
      self%n_boxes = boxes%n
      self%n_bodies = boxes%n_bodies
      call self%pairs%start(boxes%one_to_one)
   end subroutine new_neighbours

   !> Bring the list up to date with the boxes of a step.
   subroutine update(self, boxes)
      class(neighbours_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes

      call self%find(boxes)
      call self%order()
      call self%merge()
   end subroutine update

   !> First part of `update`: let the finder record the changes. If the number of boxes or bodies is
   !> another than before, the slots may mean other bodies, and all pairs end and begin anew.
   subroutine find(self, boxes)
      class(neighbours_t), intent(inout) :: self
      !> Boxes of this step
      type(boxes_t), intent(in) :: boxes
      type(error_t), allocatable :: impossible

      call self%finder%work%start()
      if (boxes%n /= self%n_boxes .or. boxes%n_bodies /= self%n_bodies) then
         call new_finder(self%finder, self%name, impossible, self%skin)
         call self%finder%work%start()
         self%n_boxes = boxes%n
         self%n_bodies = boxes%n_bodies
         call self%pairs%forget(boxes%one_to_one)
      end if
      call self%changes%clear()
      call self%finder%find(boxes, self%changes)
   end subroutine find

   !> Second part of `update`: put the changes in order.
   subroutine order(self)
      class(neighbours_t), intent(inout) :: self

      call self%finder%work%start()
      call self%changes%order()
      call self%finder%work%lap(phase_order)
   end subroutine order

   !> Third part of `update`: change the list.
   subroutine merge_changes(self)
      class(neighbours_t), intent(inout) :: self

      call self%finder%work%start()
      call self%pairs%apply(self%changes)
      call self%finder%work%lap(phase_merge)
   end subroutine merge_changes

   !> Go on with another finder. The list stays as it is, since all finders find the same; the new one
   !> learns the boxes of the last step.
   subroutine change_finder(self, finder_name, boxes, error)
      class(neighbours_t), intent(inout) :: self
      !> Name of the finder
      character(len=*), intent(in) :: finder_name
      !> Boxes of the last step
      type(boxes_t), intent(in) :: boxes
      !> Allocated if there is no such finder; then nothing is changed
      type(error_t), allocatable, intent(inout) :: error
      class(finder_t), allocatable :: finder

      call new_finder(finder, finder_name, error, self%skin)
      if (allocated(error)) return
      call move_alloc(finder, self%finder)
      self%name = finder_name
      call self%changes%clear()
      call self%finder%work%start()
      call self%finder%find(boxes, self%changes)
   end subroutine change_finder

   !> Set the counters of the list and of the finder.
   subroutine report(self, counters)
      class(neighbours_t), intent(inout) :: self
      !> List to set them in
      type(counters_t), intent(inout) :: counters

      call counters%set('pairs', int(self%pairs%n, lp))
      call counters%set('pair_contradictions', self%pairs%contradictions)
      call self%finder%survey()
      call self%finder%work%report(counters)
   end subroutine report

end module polydem_neighbours
