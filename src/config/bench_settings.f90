!> Settings of a bench. They do not change after reading.
!>
!> The entries and their defaults follow from `entries.txt`.
module polydem_bench_settings
   use polydem_group_settings, only: bench_group_t => bench_settings_t
   implicit none
   private
   public :: bench_settings_t

   !> Group &bench, and where it comes from
   type, extends(bench_group_t) :: bench_settings_t
      !> Path of the namelist file, for messages
      character(len=:), allocatable :: file
      !> Text of the namelist file, with a line end after each line
      character(len=:), allocatable :: text
      !> Every entry in use with its value, one per line
      character(len=:), allocatable :: resolved
      !> Place (file:line) where `scenes` is given, for messages
      character(len=:), allocatable :: scenes_place
      !> Place (file:line) where `prepare` is given, for messages
      character(len=:), allocatable :: prepare_place
   end type bench_settings_t

end module polydem_bench_settings
