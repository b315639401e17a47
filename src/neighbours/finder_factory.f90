!> The finders by name: the only place that knows them all.
module polydem_finder_factory
   use polydem_all_pairs, only: all_pairs_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_finder, only: finder_t
   use polydem_quadtree, only: quadtree_t
   use polydem_sort_and_sweep, only: sort_and_sweep_t
   use polydem_strings, only: join
   implicit none
   private
   public :: new_finder, finder_names

   !> Names of all finders, as in the namelist and in results
   character(len=*), parameter :: finder_names(3) = &
      [character(len=14) :: 'all_pairs', 'sort_and_sweep', 'quadtree']

contains

   !> Make a finder that has seen no box yet.
   subroutine new_finder(finder, name, error)
      !> Finder to make
      class(finder_t), allocatable, intent(out) :: finder
      !> One of `finder_names`
      character(len=*), intent(in) :: name
      !> Allocated if there is no such finder
      type(error_t), allocatable, intent(inout) :: error

      select case (name)
      case ('all_pairs')
         allocate (all_pairs_t :: finder)
      case ('sort_and_sweep')
         allocate (sort_and_sweep_t :: finder)
      case ('quadtree')
         allocate (quadtree_t :: finder)
      case default
         call raise(error, input_error, "there is no finder '"//trim(name)//"'; choose one of "// &
            join(finder_names, ', '))
      end select
   end subroutine new_finder

end module polydem_finder_factory
