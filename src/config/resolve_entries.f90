!> Finds the value of every entry from the statements of the namelist. Each statement must name a known entry, be
!> unique, be used by the chosen options and hold a valid value.
!>
!> Overrides of the command line replace statements of the file. An override can make an entry of the file unused
!> (friction_coefficient after --set forces.friction=none); such an entry is ignored. Any other unused entry is an
!> error.
module polydem_resolve_entries
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, wp
   use polydem_missing_entries, only: example_of, list_groups, missing_text
   use polydem_namelist_entries, only: bench_group, entries, entry_t, first_row, group_length, groups, keys_of, required
   use polydem_namelist_statements, only: read_statements, statement_t
   use polydem_namelist_tokens, only: source_t
   use polydem_namelist_values, only: is_text, label, read_value, value_t, value_text
   use polydem_strings, only: join, to_text, count_words, quoted, split_words, suggestion
   implicit none
   private
   public :: resolve_entries, resolved_text

   !> Greatest number of characters of an override in a message
   integer, parameter :: longest_name = 200

contains

   !> Find the value of every row of the table.
   pure subroutine resolve_entries(source, of_bench, overrides, values, error)
      !> Namelist text
      type(source_t), intent(in) :: source
      !> Whether the text describes a bench (group &bench) or a run (all other groups)
      logical, intent(in) :: of_bench
      !> Overrides 'group.key=value'; the last override of an entry applies
      character(len=*), intent(in) :: overrides(:)
      !> Values, (row of the table)
      type(value_t), allocatable, intent(out) :: values(:)
      !> First error found
      type(error_t), allocatable, intent(inout) :: error
      type(statement_t), allocatable :: statements(:)
      type(statement_t) :: given(size(entries))
      character(len=group_length), allocatable :: present_groups(:)
      character(len=:), allocatable :: text
      integer :: row

      call read_statements(source, statements, error)
      if (allocated(error)) return
      if (size(statements) == 0) then
         text = example_of('scene')//' '//example_of('integrate')
         if (of_bench) text = example_of(bench_group)
         call raise(error, input_error, source%name//': the file contains no namelist group; for example: '//text)
         return
      end if
      call collect_statements(statements, of_bench, given, error)
      if (allocated(error)) return
      call collect_overrides(overrides, of_bench, given, error)
      if (allocated(error)) return

      allocate (values(size(entries)))
      call list_groups(statements, given, present_groups)
      do row = 1, size(entries)
         call resolve_row(source, of_bench, present_groups, given, row, values, error)
         if (allocated(error)) return
      end do
      do row = 1, size(entries)
         call check_use(given(row), row, values, error)
         if (allocated(error)) return
      end do
   end subroutine resolve_entries

   !> Store each statement of the file under the first row of its entry.
   pure subroutine collect_statements(statements, of_bench, given, error)
      type(statement_t), intent(in) :: statements(:)
      logical, intent(in) :: of_bench
      type(statement_t), intent(inout) :: given(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: earlier, k, row

      do k = 1, size(statements)
         call check_names(statements(k), of_bench, error)
         if (allocated(error)) return
         do earlier = 1, k - 1
            if (statements(earlier)%group /= statements(k)%group) cycle
            if (statements(earlier)%key /= statements(k)%key) cycle
            call raise(error, input_error, statements(k)%place//': '//name_of(statements(k))// &
               ' is given twice (first on line '//to_text(statements(earlier)%line)//')')
            return
         end do
         row = first_row(statements(k)%group, statements(k)%key)
         if (row > 0) given(row) = statements(k)
      end do
   end subroutine collect_statements

   !> Name of a group or entry in messages
   pure function name_of(statement) result(text)
      type(statement_t), intent(in) :: statement
      character(len=:), allocatable :: text

      text = 'group &'//statement%group
      if (statement%key /= '') text = quoted(statement%key)//' in &'//statement%group
   end function name_of

   !> Check that the table contains the group and the key, and that the group fits a bench or a run.
   pure subroutine check_names(statement, of_bench, error)
      type(statement_t), intent(in) :: statement
      logical, intent(in) :: of_bench
      type(error_t), allocatable, intent(inout) :: error

      if (all(groups() /= statement%group)) then
         call raise(error, input_error, statement%place//': unknown group &'//statement%group// &
            suggestion(statement%group, pack(groups(), (groups() == bench_group) .eqv. of_bench)))
      else if (of_bench .and. statement%group /= bench_group) then
         call raise(error, input_error, statement%place//': group &'//statement%group//' belongs to a run; a bench '// &
            'has only the group &bench')
      else if (statement%group == bench_group .and. .not. of_bench) then
         call raise(error, input_error, statement%place// &
            ': group &bench belongs to a bench; use polydem bench FILE.nml')
      else if (statement%key /= '' .and. first_row(statement%group, statement%key) == 0) then
         call raise_unknown_key(statement, error)
      end if
   end subroutine check_names

   !> Raise an error about a key that the group does not have. The message names the groups that have it.
   pure subroutine raise_unknown_key(statement, error)
      type(statement_t), intent(in) :: statement
      type(error_t), allocatable, intent(inout) :: error
      character(len=group_length), allocatable :: names(:)
      character(len=:), allocatable :: owners
      integer :: k

      names = groups()
      owners = ''
      do k = 1, size(names)
         if ((names(k) == bench_group) .neqv. (statement%group == bench_group)) cycle
         if (first_row(names(k), statement%key) == 0) cycle
         if (owners /= '') owners = owners//' and '
         owners = owners//'&'//trim(names(k))
      end do
      if (owners /= '') then
         call raise(error, input_error, statement%place//': '//quoted(statement%key)//' is a key of '//owners// &
            ', not of &'//statement%group)
      else
         call raise(error, input_error, statement%place//': unknown key '//quoted(statement%key)//' in &'// &
            statement%group//suggestion(statement%key, keys_of(statement%group)))
      end if
   end subroutine raise_unknown_key

   !> Replace statements of the file by the overrides of the command line.
   pure subroutine collect_overrides(overrides, of_bench, given, error)
      character(len=*), intent(in) :: overrides(:)
      logical, intent(in) :: of_bench
      type(statement_t), intent(inout) :: given(:)
      type(error_t), allocatable, intent(inout) :: error
      type(statement_t) :: statement
      integer :: k

      do k = 1, size(overrides)
         call read_override(trim(overrides(k)), of_bench, statement, error)
         if (allocated(error)) return
         given(first_row(statement%group, statement%key)) = statement
      end do
   end subroutine collect_overrides

   !> Read 'group.key=value' as the statement '&group key = value'. Words and paths need no quotes.
   pure subroutine read_override(override, of_bench, statement, error)
      character(len=*), intent(in) :: override
      logical, intent(in) :: of_bench
      type(statement_t), intent(out) :: statement
      type(error_t), allocatable, intent(inout) :: error
      type(statement_t), allocatable :: statements(:)
      type(source_t) :: source
      character(len=*), parameter :: line_end = new_line('a')
      integer :: dot, equals

      ! Every statement stores the name, so long overrides are shortened.
      source%name = '--set '//override(:min(len(override), longest_name))
      if (len(override) > longest_name) source%name = source%name//' ...'
      source%has_lines = .false.
      equals = index(override, '=')
      dot = index(override(:max(0, equals - 1)), '.')
      if (dot < 2 .or. equals < dot + 2) then
         call raise(error, input_error, source%name//': group.key=value is expected')
         return
      end if
      associate (group => override(:dot - 1), key => override(dot + 1:equals - 1), &
                 value => override(equals + 1:))
         source%text = '&'//group//line_end//key//'='//value_of_override(group, key, value)//line_end//'/'
      end associate
      call read_statements(source, statements, error)
      if (allocated(error)) return
      if (size(statements) /= 2) then
         call raise(error, input_error, source%name//': exactly one entry, group.key=value, is expected')
         return
      end if
      statement = statements(2)
      statement%is_override = .true.
      call check_names(statement, of_bench, error)
   end subroutine read_override

   !> Value of an override; quotes are added if the entry is a text without quotes
   pure function value_of_override(group, key, given) result(text)
      character(len=*), intent(in) :: group, key, given
      character(len=:), allocatable :: text
      integer :: row

      text = given
      row = first_row(group, key)
      if (row == 0) return
      if (.not. is_text(entries(row))) return
      if (scan(adjustl(given)//' ', '''"') == 1) return
      text = quoted(trim(adjustl(given)))
   end function value_of_override

   !> Find the value of a row: the given value, or the default.
   pure subroutine resolve_row(source, of_bench, present_groups, given, row, values, error)
      type(source_t), intent(in) :: source
      logical, intent(in) :: of_bench
      !> Groups of the file and of overrides, (any)
      character(len=*), intent(in) :: present_groups(:)
      type(statement_t), intent(in) :: given(:)
      integer, intent(in) :: row
      type(value_t), intent(inout) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: home

      associate (entry => entries(row))
         home = first_row(entry%group, entry%key)
         values(row)%is_active = (entry%group == bench_group) .eqv. of_bench
         if (values(row)%is_active) values(row)%is_active = is_needed(entry, values)
         if (values(row)%is_active .and. allocated(given(home)%values)) then
            call read_value(entry, given(home), values(row), error)
         else if (entry%default /= required) then
            call read_value(entry, default_statement(source, entry), values(row), error)
         else if (values(row)%is_active) then
            call raise(error, input_error, source%name//': '//missing_text(entry, values, present_groups))
         else
            call set_unused(source, entry, values(row))
         end if
      end associate
   end subroutine resolve_row

   !> Whether an entry is in use, from the values of earlier rows
   pure logical function is_needed(entry, values)
      type(entry_t), intent(in) :: entry
      type(value_t), intent(in) :: values(:)
      integer :: colon, row

      is_needed = entry%needs == ''
      if (is_needed) return
      colon = index(entry%needs, ':')
      row = first_row(entry%group, entry%needs(:colon - 1))
      if (values(row)%is_active) is_needed = any(split_words(entry%needs(colon + 1:)) == values(row)%text)
   end function is_needed

   !> Default of a row in the form of a statement
   pure function default_statement(source, entry) result(statement)
      type(source_t), intent(in) :: source
      type(entry_t), intent(in) :: entry
      type(statement_t) :: statement
      character(len=len(entry%default)) :: words(count_words(entry%default))
      integer :: k

      statement%place = source%name
      if (is_text(entry) .and. entry%count > 0) then
         allocate (statement%values(1))
         statement%values(1)%text = trim(entry%default)
         statement%values(1)%has_quotes = .true.
      else
         words = split_words(entry%default)
         allocate (statement%values(size(words)))
         do k = 1, size(words)
            statement%values(k)%text = trim(words(k))
         end do
      end if
   end function default_statement

   !> Set zeros and an empty text for an entry without default that is not in use.
   pure subroutine set_unused(source, entry, value)
      type(source_t), intent(in) :: source
      type(entry_t), intent(in) :: entry
      type(value_t), intent(inout) :: value
      integer :: k

      value%place = source%name
      value%text = ''
      value%reals = [(0.0_wp, k=1, merge(entry%count, 0, entry%type == 'real'))]
      value%integers = [(0_ip, k=1, merge(entry%count, 0, entry%type == 'integer'))]
      allocate (value%texts(0))
   end subroutine set_unused

   !> Check that a given entry is in use. An entry of the file may be unused because of an override.
   pure subroutine check_use(given, home, values, error)
      type(statement_t), intent(in) :: given
      integer, intent(in) :: home
      type(value_t), intent(in) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: key, needs
      integer :: decider, row

      if (.not. allocated(given%values)) return
      needs = ''
      do row = home, size(entries)
         if (entries(row)%group /= given%group .or. entries(row)%key /= given%key) cycle
         if (values(row)%is_active) return
         needs = needs//entries(row)%needs(index(entries(row)%needs, ':') + 1:)
      end do
      key = entries(home)%needs(:index(entries(home)%needs, ':') - 1)
      decider = first_row(given%group, key)
      if (values(decider)%is_override .and. .not. given%is_override) return
      call raise(error, input_error, given%place//': '//label(entries(home))//' is used only with '//key// &
         ' = '//join(split_words(needs), ' or ')//', not with '//values(decider)%text)
   end subroutine check_use

   !> All entries in use as namelist text that can be read again, one entry per line, without empty lists and groups
   pure function resolved_text(values) result(text)
      !> Values, (row of the table)
      type(value_t), intent(in) :: values(:)
      character(len=:), allocatable :: text, value
      character(len=*), parameter :: line_end = new_line('a')
      character(len=group_length) :: group
      integer :: row

      text = ''
      group = ''
      do row = 1, size(entries)
         if (.not. values(row)%is_active) cycle
         if (entries(row)%group /= group) then
            if (text /= '') text = text//'/'//line_end
            group = entries(row)%group
            text = text//'&'//trim(group)//line_end
         end if
         value = value_text(entries(row), values(row))
         if (value /= '') text = text//'   '//trim(entries(row)%key)//' = '//value//line_end
      end do
      text = text//'/'//line_end
   end function resolved_text

end module polydem_resolve_entries
