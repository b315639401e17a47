!> Makes the neighbour stage of the time step with a finder given by its name.
module polydem_new_neighbours
   use polydem_boxes, only: boxes_t
   use polydem_errors, only: error_t
   use polydem_finder, only: finder_t
   use polydem_finder_factory, only: new_finder
   use polydem_kinds, only: wp
   use polydem_neighbours, only: neighbours_t, restart_neighbours
   implicit none
   private
   public :: new_neighbours, choose_finder

contains

   !> Make the stage with an empty list and a finder given by its name.
   subroutine new_neighbours(self, finder_name, boxes, error, skin, isa)
      !> Stage to make
      type(neighbours_t), intent(out) :: self
      !> Name of the finder
      character(len=*), intent(in) :: finder_name
      !> Boxes of the first step; only their number, pieces and bodies are used
      type(boxes_t), intent(in) :: boxes
      !> Allocated if there is no such finder
      type(error_t), allocatable, intent(inout) :: error
      !> Skin of a Verlet list [m]; 0 or absent: automatic
      real(wp), intent(in), optional :: skin
      !> Instruction set of the kernels; `isa_base` if absent
      integer, intent(in), optional :: isa

      call choose_finder(self, finder_name, error, skin, isa)
      if (.not. allocated(error)) call restart_neighbours(self, boxes)
   end subroutine new_neighbours

   !> Choose the finder of a stage that is started later.
   subroutine choose_finder(self, finder_name, error, skin, isa)
      !> Stage, not yet started
      type(neighbours_t), intent(inout) :: self
      !> Name of the finder
      character(len=*), intent(in) :: finder_name
      !> Allocated if there is no such finder
      type(error_t), allocatable, intent(inout) :: error
      !> Skin of a Verlet list [m]; 0 or absent: automatic
      real(wp), intent(in), optional :: skin
      !> Instruction set of the kernels; `isa_base` if absent
      integer, intent(in), optional :: isa
      class(finder_t), allocatable :: finder

      call new_finder(finder, finder_name, error, skin)
      if (allocated(error)) return
      if (present(isa)) finder%isa = isa
      call self%set_finder(finder)
   end subroutine choose_finder

end module polydem_new_neighbours
