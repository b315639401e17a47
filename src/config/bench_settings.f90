!> The settings of a bench, immutable once read.
!>
!> Defaults are not stated here but in `namelist_entries`, once.
module polydem_bench_settings
   use polydem_kinds, only: ip
   use polydem_words, only: text_t
   implicit none
   private
   public :: bench_settings_t

   !> Group &bench: what is measured how
   type :: bench_settings_t
      !> Path of the namelist file, for messages
      character(len=:), allocatable :: file
      !> The namelist as it was read, with a line end after each line
      character(len=:), allocatable :: text
      !> Every entry as it is in force, one per line
      character(len=:), allocatable :: resolved
      !> Scenes: a trace, or a namelist file with overrides behind it
      type(text_t), allocatable :: scenes(:)
      !> Where they are given, for messages
      character(len=:), allocatable :: place_of_scenes
      !> Name of each scene
      type(text_t), allocatable :: names(:)
      !> Runs that come first: namelist files with overrides
      type(text_t), allocatable :: prepare(:)
      !> Where they are given, for messages
      character(len=:), allocatable :: place_of_prepare
      !> Names of the finders
      type(text_t), allocatable :: finders(:)
      !> Numbers of threads
      integer(ip), allocatable :: threads(:)
      !> Timed repeats
      integer(ip) :: repeats
      !> 'replay' or 'live'
      character(len=:), allocatable :: mode
      !> Steps of a sample; 0: as many as there are
      integer(ip) :: steps
      !> Folder of traces and samples; empty: results/<name of the input file>
      character(len=:), allocatable :: folder
   end type bench_settings_t

end module polydem_bench_settings
