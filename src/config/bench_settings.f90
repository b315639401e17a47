!> Settings of a bench. They do not change after reading.
!>
!> The defaults are in `namelist_entries`.
module polydem_bench_settings
   use polydem_kinds, only: ip
   use polydem_strings, only: text_t
   implicit none
   private
   public :: bench_settings_t

   !> Group &bench: scenes, finders and numbers of threads to measure
   type :: bench_settings_t
      !> Path of the namelist file, for messages
      character(len=:), allocatable :: file
      !> Text of the namelist file, with a line end after each line
      character(len=:), allocatable :: text
      !> Every entry in use with its value, one per line
      character(len=:), allocatable :: resolved
      !> Scenes, (scene): each a trace, or a namelist file followed by overrides
      type(text_t), allocatable :: scenes(:)
      !> Place (file:line) where `scenes` is given, for messages
      character(len=:), allocatable :: scenes_place
      !> Name of each scene, (scene)
      type(text_t), allocatable :: names(:)
      !> Runs that prepare the scenes: namelist files with overrides
      type(text_t), allocatable :: prepare(:)
      !> Place (file:line) where `prepare` is given, for messages
      character(len=:), allocatable :: prepare_place
      !> Names of the finders
      type(text_t), allocatable :: finders(:)
      !> Numbers of threads
      integer(ip), allocatable :: threads(:)
      !> Number of timed repeats
      integer(ip) :: repeats
      !> 'replay': recorded boxes; 'live': whole time steps
      character(len=:), allocatable :: mode
      !> Number of steps of a sample; 0: all available steps
      integer(ip) :: steps
      !> Folder of traces and samples; empty: results/<name of the namelist file>
      character(len=:), allocatable :: folder
   end type bench_settings_t

end module polydem_bench_settings
