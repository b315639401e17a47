!> The divisions of space by name: the only place that knows them all.
module polydem_partition_factory
   use polydem_errors, only: error_t, input_error, raise
   use polydem_morton_cut, only: morton_cut_t
   use polydem_partition, only: partition_t
   use polydem_recursive_bisection, only: recursive_bisection_t
   use polydem_strings, only: join
   implicit none
   private
   public :: new_partition, partition_names

   !> Names of all divisions, as in the namelist
   character(len=*), parameter :: partition_names(2) = [character(len=9) :: 'bisection', 'morton']

contains

   !> Make a division that gives all space to rank 0.
   subroutine new_partition(partition, name, error)
      !> Division to make
      class(partition_t), allocatable, intent(out) :: partition
      !> One of `partition_names`
      character(len=*), intent(in) :: name
      !> Allocated if there is no such division
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      select case (name)
      case ('bisection')
         allocate (recursive_bisection_t :: partition)
      case ('morton')
         allocate (morton_cut_t :: partition)
      case default
         call raise(error, input_error, "space cannot be cut by '"//trim(name)//"'; choose one of "// &
            join(partition_names, ', '))
      end select
   end subroutine new_partition

end module polydem_partition_factory
