!> Reads the settings of a bench from a namelist file and the overrides of the command line, as those of a run are read.
module polydem_read_bench
   use polydem_bench_settings, only: bench_settings_t
   use polydem_bench_table, only: entries
   use polydem_check_bench, only: check_bench
   use polydem_errors, only: error_t
   use polydem_fill_bench, only: fill_bench
   use polydem_group_instances, only: instance_t
   use polydem_namelist_tokens, only: source_t
   use polydem_resolve_entries, only: resolve_entries
   use polydem_settings_origin, only: store_origin
   use polydem_text_file, only: read_text_file
   implicit none
   private
   public :: read_bench, read_bench_text

   !> A short text of a bench, for messages
   character(len=*), parameter :: example = &
      "&bench scenes = 'inputs/gas.nml' names = 'gas' finders = 'two_level' /"

contains

   !> Read the settings of a bench from a file.
   subroutine read_bench(file, overrides, bench, error)
      !> Path of the namelist file
      character(len=*), intent(in) :: file
      !> Overrides of the command line, each 'bench.key=value'; the last override of an entry applies
      character(len=*), intent(in) :: overrides(:)
      !> Complete, checked settings
      type(bench_settings_t), intent(inout) :: bench
      !> Error in the file or an override; its message starts with file:line or --set bench.key=value
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text

      call read_text_file(file, text, error)
      if (allocated(error)) return
      call read_bench_text(file, text, overrides, bench, error)
   end subroutine read_bench

   !> Read the settings of a bench from a text.
   pure subroutine read_bench_text(file_name, text, overrides, bench, error)
      !> Name of the source in messages
      character(len=*), intent(in) :: file_name
      !> Text with the group &bench
      character(len=*), intent(in) :: text
      !> Overrides of the command line, each 'bench.key=value'; the last override of an entry applies
      character(len=*), intent(in) :: overrides(:)
      !> Complete, checked settings
      type(bench_settings_t), intent(inout) :: bench
      !> Error in the text or an override
      type(error_t), allocatable, intent(inout) :: error
      type(source_t) :: source
      type(instance_t), allocatable :: instances(:)

      source%name = trim(file_name)
      source%text = text
      call resolve_entries(source, entries, example, overrides, instances, error)
      if (allocated(error)) return
      call store_origin(source, entries, instances, bench%source_locations_t)
      call fill_bench(instances(1), bench)
      call check_bench(bench, error)
   end subroutine read_bench_text

end module polydem_read_bench
