!> Factory of partitions of space: the only module that uses all of them.
module polydem_partition_factory
   use polydem_coordinate_bisection, only: coordinate_bisection_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_morton_bisection, only: morton_bisection_t
   use polydem_partition, only: partition_t
   use polydem_strings, only: join
   implicit none
   private
   public :: new_partition, partition_names

   !> Names of all partitions, as in the namelist
   character(len=*), parameter :: partition_names(2) = [character(len=9) :: 'bisection', 'morton']

contains

   !> Make a partition in which rank 0 owns all space.
   subroutine new_partition(partition, name, error)
      class(partition_t), allocatable, intent(out) :: partition
      !> One of `partition_names`
      character(len=*), intent(in) :: name
      !> Allocated if there is no partition of this name
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      select case (name)
      case ('bisection')
         allocate (coordinate_bisection_t :: partition)
      case ('morton')
         allocate (morton_bisection_t :: partition)
      case default
         call raise(error, input_error, "there is no partition of space '"//trim(name)//"'; choose one of "// &
            join(partition_names, ', '))
      end select
   end subroutine new_partition

end module polydem_partition_factory
