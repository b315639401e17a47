!> Makes finders by name. Only this module uses all finders.
!>
!> To add a finder, write it as a `finder_t` in a file of its own, and name it here by a `use` and a `case`.
module polydem_finder_factory
   use polydem_all_pairs, only: all_pairs_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_finder, only: finder_t
   use polydem_filtered_quadtree_inlined, only: filtered_quadtree_t
   use polydem_hierarchical_grid, only: hierarchical_grid_t
   use polydem_kinds, only: wp
   use polydem_linked_cells, only: linked_cells_t
   use polydem_partitioned_sweep, only: partitioned_sweep_t
   use polydem_quadtree_inlined, only: quadtree_t
   use polydem_sort_and_sweep, only: sort_and_sweep_t
   use polydem_two_level, only: two_level_t
   use polydem_verlet, only: verlet_t
   implicit none
   private
   public :: new_finder

contains

   !> Make a finder in its initial state.
   subroutine new_finder(finder, name, error, skin)
      !> Finder to make
      class(finder_t), allocatable, intent(out) :: finder
      !> Name as in the namelist, of any length
      character(len=*), intent(in) :: name
      !> Allocated if there is no such finder
      type(error_t), allocatable, intent(inout) :: error
      !> Skin of a Verlet list [m]; 0 or absent: automatic
      real(wp), intent(in), optional :: skin
      type(verlet_t), allocatable :: list
      type(sort_and_sweep_t), allocatable :: sweep

      select case (name)
      case ('all_pairs')
         allocate (all_pairs_t :: finder)
      case ('sort_and_sweep')
         allocate (sort_and_sweep_t :: finder)
      case ('unsorted_sweep')
         allocate (sweep)
         sweep%centres_first = .false.
         call move_alloc(sweep, finder)
      case ('partitioned_sweep')
         allocate (partitioned_sweep_t :: finder)
      case ('quadtree')
         call new_tree(finder, equal_leaves=.false., one_axis=.false.)
      case ('pruned_quadtree')
         call new_tree(finder, equal_leaves=.true., one_axis=.false.)
      case ('binary_tree')
         call new_tree(finder, equal_leaves=.false., one_axis=.true.)
      case ('filtered_quadtree')
         allocate (filtered_quadtree_t :: finder)
      case ('linked_cells')
         allocate (linked_cells_t :: finder)
      case ('verlet')
         allocate (list)
         if (present(skin)) list%skin = skin
         call move_alloc(list, finder)
      case ('two_level')
         allocate (two_level_t :: finder)
      case ('hierarchical_grid')
         allocate (hierarchical_grid_t :: finder)
      case default
         call raise(error, input_error, "unknown finder '"//trim(name)//"'; choose one that &neighbours lists")
      end select
   end subroutine new_finder

   !> Make one of the tree finders, which differ only in their options.
   subroutine new_tree(finder, equal_leaves, one_axis)
      class(finder_t), allocatable, intent(out) :: finder
      logical, intent(in) :: equal_leaves, one_axis
      type(quadtree_t), allocatable :: tree

      allocate (tree)
      tree%equal_leaves = equal_leaves
      tree%one_axis = one_axis
      call move_alloc(tree, finder)
   end subroutine new_tree

end module polydem_finder_factory
