!> Reads the settings of a run or a bench from a namelist file and the overrides of the command line. Both pass the same
!> checks, which are based on the table of entries.
!>
!> polydem has its own namelist parser because the namelist input of compilers does not name the line of an error, does
!> not detect keys given twice, and reports most errors as 'end of file'.
module polydem_read_settings
   use polydem_check_bench, only: check_bench
   use polydem_check_materials, only: check_materials
   use polydem_check_parts, only: check_parts
   use polydem_check_settings, only: check_settings
   use polydem_check_area, only: check_area, check_rectangles
   use polydem_check_sources, only: check_sources
   use polydem_check_stages, only: check_stages
   use polydem_errors, only: error_t
   use polydem_exclusive_entries, only: resolve_exclusive_entries
   use polydem_fill_groups, only: fill_bench, fill_groups
   use polydem_group_instances, only: full_name, index_of_instance, instance_t, row_of
   use polydem_namelist_entries, only: bench_group, key_length, keys_of
   use polydem_namelist_tokens, only: source_t
   use polydem_source_locations, only: source_locations_t
   use polydem_resolve_entries, only: resolve_entries, resolved_text
   use polydem_settings, only: bench_settings_t, settings_t
   use polydem_text_file, only: read_text_file
   use polydem_unusual_values, only: list_unusual
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
      !> Complete, checked settings: `settings_t` of a run, or `bench_settings_t`
      class(source_locations_t), intent(inout) :: settings
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
      !> Complete, checked settings: `settings_t` of a run, or `bench_settings_t`
      class(source_locations_t), intent(inout) :: settings
      !> Error in the text or an override
      type(error_t), allocatable, intent(inout) :: error
      type(instance_t), allocatable :: instances(:)

      select type (settings)
      type is (settings_t)
         call read_values(file_name, text, overrides, .false., settings%source_locations_t, instances, error)
         if (allocated(error)) return
         call fill_groups(instances, settings)
         call check_parts(settings, instances, error)
         call check_materials(settings, instances, error)
         call check_settings(settings, instances, error)
         call check_stages(settings, instances, error)
         call check_sources(settings, instances, error)
         call check_area(settings, instances, error)
         call check_rectangles(settings, instances, error)
      type is (bench_settings_t)
         call read_values(file_name, text, overrides, .true., settings%source_locations_t, instances, error)
         if (allocated(error)) return
         call fill_bench(instances(index_of_instance(instances, bench_group)), settings)
         call check_bench(settings, error)
      end select
   end subroutine read_settings_text

   !> Read the values of all entries and their origin.
   pure subroutine read_values(file_name, text, overrides, of_bench, origin, instances, error)
      character(len=*), intent(in) :: file_name, text, overrides(:)
      !> Whether the text describes a bench
      logical, intent(in) :: of_bench
      type(source_locations_t), intent(inout) :: origin
      !> Instances of all groups with their values
      type(instance_t), allocatable, intent(out) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error
      type(source_t) :: source

      source%name = trim(file_name)
      source%text = text
      call resolve_entries(source, of_bench, overrides, instances, error)
      if (allocated(error)) return
      call resolve_exclusive_entries(instances(index_of_instance(instances, 'forces')), error)
      if (allocated(error)) return
      origin%file = trim(file_name)
      origin%text = normalise_line_ends(text)
      origin%resolved = resolved_text(instances)
      origin%given = resolved_text(instances, given_only=.true.)
      call list_places(instances, origin)
      call list_unusual(instances, origin%unusual)
   end subroutine read_values

   !> List where the entries were given.
   pure subroutine list_places(instances, origin)
      type(instance_t), intent(in) :: instances(:)
      type(source_locations_t), intent(inout) :: origin
      character(len=key_length), allocatable :: keys(:)
      integer :: i, k, n

      if (allocated(origin%places)) deallocate (origin%places)
      allocate (origin%places(sum([(size(keys_of(instances(i)%group)), i=1, size(instances))])))
      n = 0
      do i = 1, size(instances)
         keys = keys_of(instances(i)%group)
         do k = 1, size(keys)
            n = n + 1
            associate (entry => origin%places(n), value => instances(i)%values(row_of(instances(i), trim(keys(k)))))
               entry%group = full_name(instances(i))
               entry%key = trim(keys(k))
               entry%place = origin%file
               if (allocated(value%place)) entry%place = value%place
            end associate
         end do
      end do
   end subroutine list_places

   !> Text without carriage returns and with a line end after the last line
   pure function normalise_line_ends(text) result(plain)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: plain
      character(len=*), parameter :: line_feed = achar(10), carriage_return = achar(13)
      integer :: k, n

      allocate (character(len=len(text) + 1) :: plain)
      n = 0
      do k = 1, len(text)
         if (text(k:k) == carriage_return) cycle
         n = n + 1
         plain(n:n) = text(k:k)
      end do
      if (n > 0) then
         if (plain(n:n) /= line_feed) n = n + 1
         plain(n:n) = line_feed
      end if
      plain = plain(:n)
   end function normalise_line_ends

end module polydem_read_settings
