!> Reads the settings of a run from a namelist file and the overrides of the command line. Both pass the same checks,
!> which are based on the table of entries.
!>
!> polydem has its own namelist parser because the namelist input of compilers does not name the line of an error, does
!> not detect keys given twice, and reports most errors as 'end of file'.
module polydem_read_settings
   use polydem_check_materials, only: check_materials
   use polydem_check_parts, only: check_parts
   use polydem_check_settings, only: check_settings
   use polydem_check_area, only: check_area, check_rectangles
   use polydem_check_sources, only: check_sources
   use polydem_check_stages, only: check_stages
   use polydem_errors, only: error_t
   use polydem_exclusive_entries, only: resolve_exclusive_entries
   use polydem_fill_groups, only: fill_groups
   use polydem_group_instances, only: index_of_instance, instance_t
   use polydem_missing_entries, only: run_example
   use polydem_namelist_entries, only: entries
   use polydem_namelist_tokens, only: source_t
   use polydem_resolve_entries, only: resolve_entries
   use polydem_settings, only: settings_t
   use polydem_settings_origin, only: store_origin
   use polydem_text_file, only: read_text_file
   implicit none
   private
   public :: read_settings, read_settings_text

contains

   !> Read settings from a file.
   subroutine read_settings(file, overrides, settings, error)
      !> Path of the namelist file
      character(len=*), intent(in) :: file
      !> Overrides of the command line, each 'group.key=value' or 'group.name.key=value'; the last override of an entry
      !> applies
      character(len=*), intent(in) :: overrides(:)
      !> Complete, checked settings
      type(settings_t), intent(inout) :: settings
      !> Error in the file or an override; its message starts with file:line or --set group.key=value
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text

      call read_text_file(file, text, error)
      if (allocated(error)) return
      call read_settings_text(file, text, overrides, settings, error)
   end subroutine read_settings

   !> Read settings from a text.
   pure subroutine read_settings_text(file_name, text, overrides, settings, error)
      !> Name of the source in messages
      character(len=*), intent(in) :: file_name
      !> Text with the namelist groups
      character(len=*), intent(in) :: text
      !> Overrides of the command line, each 'group.key=value' or 'group.name.key=value'; the last override of an entry
      !> applies
      character(len=*), intent(in) :: overrides(:)
      !> Complete, checked settings
      type(settings_t), intent(inout) :: settings
      !> Error in the text or an override
      type(error_t), allocatable, intent(inout) :: error
      type(source_t) :: source
      type(instance_t), allocatable :: instances(:)

      source%name = trim(file_name)
      source%text = text
      call resolve_entries(source, entries, run_example, overrides, instances, error)
      if (allocated(error)) return
      call resolve_exclusive_entries(instances(index_of_instance(instances, 'forces')), error)
      if (allocated(error)) return
      call store_origin(source, entries, instances, settings%source_locations_t)
      call fill_groups(instances, settings)
      call check_parts(settings, instances, error)
      call check_materials(settings, instances, error)
      call check_settings(settings, instances, error)
      call check_stages(settings, instances, error)
      call check_sources(settings, instances, error)
      call check_area(settings, instances, error)
      call check_rectangles(settings, instances, error)
   end subroutine read_settings_text

end module polydem_read_settings
