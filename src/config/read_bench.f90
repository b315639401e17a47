!> Reads the settings of a bench from a namelist file, with the table of entries and the parser that runs use.
module polydem_read_bench
   use polydem_bench_settings, only: bench_settings_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_fill_groups, only: fill_bench
   use polydem_namelist_entries, only: bench_group, first_row
   use polydem_namelist_tokens, only: source_t
   use polydem_namelist_values, only: value_t
   use polydem_read_settings, only: normalise_line_ends
   use polydem_resolve_entries, only: resolve_entries, resolved_text
   use polydem_strings, only: to_text, quoted, text_t
   use polydem_text_file, only: read_text_file
   implicit none
   private
   public :: read_bench, read_bench_text

   !> Characters that the name of a scene may contain; the name becomes part of file names
   character(len=*), parameter :: safe_letters = &
      'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._'

   !> Upper limit of the length of a list. The check for duplicates compares all pairs
   integer, parameter :: longest_list = 9999

contains

   !> Read the settings of a bench from a file.
   subroutine read_bench(file, overrides, bench, error)
      !> Path of the namelist file
      character(len=*), intent(in) :: file
      !> Overrides of the command line, each 'bench.key=value'; the last override of an entry applies
      character(len=*), intent(in) :: overrides(:)
      !> Complete, checked settings
      type(bench_settings_t), intent(out) :: bench
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
      !> Text with the namelist group &bench
      character(len=*), intent(in) :: text
      !> Overrides of the command line, each 'bench.key=value'; the last override of an entry applies
      character(len=*), intent(in) :: overrides(:)
      !> Complete, checked settings
      type(bench_settings_t), intent(out) :: bench
      !> Error in the text or an override
      type(error_t), allocatable, intent(inout) :: error
      type(source_t) :: source
      type(value_t), allocatable :: values(:)

      source%name = trim(file_name)
      source%text = text
      call resolve_entries(source, .true., overrides, values, error)
      if (allocated(error)) return
      bench%file = trim(file_name)
      bench%text = normalise_line_ends(text)
      bench%resolved = resolved_text(values)
      call fill_bench(values, bench%bench_group_t)
      bench%scenes_place = values(first_row(bench_group, 'scenes'))%place
      bench%prepare_place = values(first_row(bench_group, 'prepare'))%place
      call check_bench(bench, values, error)
   end subroutine read_bench_text

   !> Check the lengths of the lists against each other, and the lists for invalid and duplicate values.
   pure subroutine check_bench(bench, values, error)
      type(bench_settings_t), intent(in) :: bench
      type(value_t), intent(in) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (size(bench%names) /= size(bench%scenes)) then
         call raise_at('names', 'has '//to_text(size(bench%names))//' values, but there are '// &
            to_text(size(bench%scenes))//' scenes', values, error)
      end if
      if (max(size(bench%names), size(bench%finders), size(bench%threads)) > longest_list) then
         call raise_at('names', 'and other lists cannot have more than '//to_text(longest_list)//' values', &
            values, error)
      end if
      if (allocated(error)) return
      do k = 1, size(bench%names)
         if (verify(bench%names(k)%text, safe_letters) > 0 .or. bench%names(k)%text == '') call raise_at('names', &
            'contains '//quoted(bench%names(k)%text)//', but a name may contain only letters, digits, . and _', &
            values, error)
      end do
      do k = 1, size(bench%scenes)
         if (bench%scenes(k)%text == '') call raise_at('scenes', 'contains an empty scene', values, error)
      end do
      do k = 1, size(bench%prepare)
         if (bench%prepare(k)%text == '') call raise_at('prepare', 'contains an empty text', values, error)
      end do
      if (allocated(error)) return
      call refuse_duplicates('names', bench%names, values, error)
      call refuse_duplicates('finders', bench%finders, values, error)
      do k = 2, size(bench%threads)
         if (all(bench%threads(:k - 1) /= bench%threads(k))) cycle
         call raise_at('threads', 'contains '//to_text(bench%threads(k))//' twice', values, error)
         return
      end do
   end subroutine check_bench

   !> Reject a list that contains the same text twice.
   pure subroutine refuse_duplicates(key, texts, values, error)
      character(len=*), intent(in) :: key
      type(text_t), intent(in) :: texts(:)
      type(value_t), intent(in) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: j, k

      do k = 2, size(texts)
         do j = 1, k - 1
            if (texts(j)%text /= texts(k)%text) cycle
            call raise_at(key, 'contains '//quoted(texts(k)%text)//' twice', values, error)
            return
         end do
      end do
   end subroutine refuse_duplicates

   !> Raise an error at the place where an entry is given.
   pure subroutine raise_at(key, problem, values, error)
      character(len=*), intent(in) :: key, problem
      type(value_t), intent(in) :: values(:)
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, values(first_row(bench_group, key))%place//': '''//key//''' in &bench '//problem)
   end subroutine raise_at

end module polydem_read_bench
