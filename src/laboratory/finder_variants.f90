!> Neighbour finders of a bench: those of a run, variants of them with other compiler options, and parallel sweeps as
!> one would first write them (`obvious_sweeps.f90`).
!>
!> `quadtree_called` is the quadtree compiled without inlining; `quadtree_o2` and `sort_and_sweep_o2` are compiled at
!> -O2.
module polydem_finder_variants
   use polydem_errors, only: error_t
   use polydem_finder, only: finder_t
   use polydem_finder_factory, only: new_finder
   use polydem_obvious_sweeps, only: locked_sweep_t, mended_sweep_t, odd_even_sweep_t
   use polydem_quadtree_called, only: quadtree_called_t => quadtree_t
   use polydem_quadtree_o2, only: quadtree_o2_t => quadtree_t
   use polydem_sort_and_sweep_o2, only: sort_and_sweep_o2_t => sort_and_sweep_t
   implicit none
   private
   public :: new_finder_or_variant

contains

   !> Create a finder or a variant of one, without boxes.
   subroutine new_finder_or_variant(finder, name, error)
      !> The new finder
      class(finder_t), allocatable, intent(out) :: finder
      !> Name as in &neighbours, or that of a variant
      character(len=*), intent(in) :: name
      !> Allocated if there is no finder of this name
      type(error_t), allocatable, intent(inout) :: error

      select case (name)
      case ('quadtree_called')
         allocate (quadtree_called_t :: finder)
      case ('quadtree_o2')
         allocate (quadtree_o2_t :: finder)
      case ('sort_and_sweep_o2')
         allocate (sort_and_sweep_o2_t :: finder)
      case ('odd_even_sweep')
         allocate (odd_even_sweep_t :: finder)
      case ('locked_sweep')
         allocate (locked_sweep_t :: finder)
      case ('mended_sweep')
         allocate (mended_sweep_t :: finder)
      case default
         call new_finder(finder, name, error)
      end select
   end subroutine new_finder_or_variant

end module polydem_finder_variants
