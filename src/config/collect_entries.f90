!> Collects what is given of each namelist group: the statements of the file, and the overrides of the command line.
module polydem_collect_entries
   use polydem_errors, only: error_t, input_error, raise
   use polydem_group_instances, only: first_row_of, index_of_instance, instance_t, names_of, new_instances
   use polydem_missing_entries, only: missing_text
   use polydem_namelist_entries, only: entries, entry_t, group_length, groups, is_repeatable, keys_of, row_in
   use polydem_namelist_statements, only: read_statements, statement_t
   use polydem_namelist_tokens, only: source_t
   use polydem_namelist_values, only: is_text, read_value, value_t
   use polydem_strings, only: lower_case, quoted, suggestion, to_text
   implicit none
   private
   public :: collect_entries

   !> Greatest number of characters of an override in a message
   integer, parameter :: longest_override = 200
   !> Greatest number of characters of the name of an instance. Names of columns of the series begin with one
   integer, parameter :: longest_name = 64

contains

   !> Make the instances of all groups with the statements of the file and, in their place, the overrides.
   pure subroutine collect_entries(source, table, statements, overrides, instances, error)
      !> Namelist text
      type(source_t), intent(in) :: source
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      !> Statements of the text
      type(statement_t), intent(in) :: statements(:)
      !> Overrides; the last override of an entry applies
      character(len=*), intent(in) :: overrides(:)
      !> Instances with their names, without values
      type(instance_t), allocatable, intent(out) :: instances(:)
      !> First group or entry that is unknown, is given twice or has no valid name
      type(error_t), allocatable, intent(inout) :: error
      integer :: current, k, opened(size(statements))

      call new_instances(source%name, table, statements, instances, opened, error)
      if (allocated(error)) return
      do k = 1, size(statements)
         call check_names(statements(k), table, error)
         if (allocated(error)) return
         if (statements(k)%key == '') then
            current = opened(k)
            call open_instance(statements(k), is_repeatable(table, statements(k)%group), instances(current), error)
         else
            call store_statement(statements(k), instances(current), error)
         end if
         if (allocated(error)) return
      end do
      call name_instances(table, instances, error)
      do k = 1, size(overrides)
         if (allocated(error)) return
         call apply_override(trim(overrides(k)), table, instances, error)
      end do
   end subroutine collect_entries

   !> Open an instance; a single group can be opened once.
   pure subroutine open_instance(opening, is_one_of_several, instance, error)
      type(statement_t), intent(in) :: opening
      logical, intent(in) :: is_one_of_several
      type(instance_t), intent(inout) :: instance
      type(error_t), allocatable, intent(inout) :: error

      if (instance%line > 0) then
         call raise_twice(opening, instance%line, error)
         return
      end if
      instance%line = opening%line
      instance%is_given = .true.
      if (is_one_of_several) instance%place = opening%place
   end subroutine open_instance

   !> Store a statement of the file under the first row of its entry.
   pure subroutine store_statement(statement, instance, error)
      type(statement_t), intent(in) :: statement
      type(instance_t), intent(inout) :: instance
      type(error_t), allocatable, intent(inout) :: error

      associate (given => instance%given(first_row_of(instance, statement%key)))
         if (allocated(given%values)) then
            call raise_twice(statement, given%line, error)
         else
            given = statement
         end if
      end associate
   end subroutine store_statement

   !> Raise an error about a group or an entry that is given twice.
   pure subroutine raise_twice(statement, line, error)
      type(statement_t), intent(in) :: statement
      !> Line where it is given first
      integer, intent(in) :: line
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name

      name = 'group &'//statement%group
      if (statement%key /= '') name = quoted(statement%key)//' in &'//statement%group
      call raise(error, input_error, statement%place//': '//name//' is given twice (first on line '//to_text(line)//')')
   end subroutine raise_twice

   !> Set the names of the instances of repeatable groups, which the file must give and which must differ in a group.
   pure subroutine name_instances(table, instances, error)
      type(entry_t), intent(in) :: table(:)
      type(instance_t), intent(inout) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error
      type(value_t) :: value
      integer :: k, row, same

      do k = 1, size(instances)
         if (.not. is_repeatable(table, instances(k)%group)) cycle
         row = first_row_of(instances(k), 'name')
         associate (instance => instances(k), given => instances(k)%given(row))
            if (allocated(given%values)) then
               call read_value(table(row), given, value, error)
            else
               call raise(error, input_error, instance%place//': '//missing_text(table(row), instance))
            end if
            if (len(value%text) > longest_name .and. .not. allocated(error)) call raise(error, input_error, &
               given%place//': ''name'' in &'//trim(instance%group)//' is a name of '//to_text(len(value%text))// &
               ' characters, but a name has at most '//to_text(longest_name))
            if (allocated(error)) return
            same = index_of_instance(instances(:k - 1), instance%group, value%text)
            if (same > 0) then
               call raise(error, input_error, given%place//': the name '//quoted(value%text)//' of a group &'// &
                  trim(instance%group)//' is given twice (first on line '// &
                  to_text(instances(same)%given(row)%line)//')')
               return
            end if
            instance%name = value%text
         end associate
      end do
   end subroutine name_instances

   !> Check that the table contains the group and the key.
   pure subroutine check_names(statement, table, error)
      type(statement_t), intent(in) :: statement
      type(entry_t), intent(in) :: table(:)
      type(error_t), allocatable, intent(inout) :: error

      if (all(table%group /= statement%group)) then
         call raise_unknown_group(statement, table, error)
      else if (statement%key /= '' .and. row_in(table, statement%group, statement%key) == 0) then
         call raise_unknown_key(statement, table, error)
      end if
   end subroutine check_names

   !> Raise an error about a group that the table does not have. That of a bench and those of runs are known.
   pure subroutine raise_unknown_group(statement, table, error)
      type(statement_t), intent(in) :: statement
      type(entry_t), intent(in) :: table(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: own

      if (statement%group == 'bench') then
         call raise(error, input_error, statement%place// &
            ': group &bench belongs to a bench; use ./polydem bench FILE.nml, or polydem_lab bench FILE.nml')
      else if (any(entries%group == statement%group)) then
         own = trim(table(1)%group)
         call raise(error, input_error, statement%place//': group &'//statement%group//' belongs to a run; a '//own// &
            ' has only the group &'//own)
      else
         call raise(error, input_error, statement%place//': unknown group &'//statement%group// &
            suggestion(statement%group, groups(table)))
      end if
   end subroutine raise_unknown_group

   !> Raise an error about a key that the group does not have. The message names the groups that have it.
   pure subroutine raise_unknown_key(statement, table, error)
      type(statement_t), intent(in) :: statement
      type(entry_t), intent(in) :: table(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=group_length), allocatable :: names(:)
      character(len=:), allocatable :: owners
      integer :: k

      names = groups(table)
      owners = ''
      do k = 1, size(names)
         if (row_in(table, names(k), statement%key) == 0) cycle
         if (owners /= '') owners = owners//' and '
         owners = owners//'&'//trim(names(k))
      end do
      if (new_name(statement) /= '') then
         call raise(error, input_error, statement%place//': '//quoted(statement%key)//' in &'//statement%group// &
            ' is '//new_name(statement)//' today')
      else if (owners /= '') then
         call raise(error, input_error, statement%place//': '//quoted(statement%key)//' is a key of '//owners// &
            ', not of &'//statement%group)
      else
         call raise(error, input_error, statement%place//': unknown key '//quoted(statement%key)//' in &'// &
            statement%group//suggestion(statement%key, keys_of(table, statement%group)))
      end if
   end subroutine raise_unknown_key

   !> Clause about a key that has another name today; empty for others
   pure function new_name(statement) result(clause)
      type(statement_t), intent(in) :: statement
      character(len=:), allocatable :: clause

      select case (statement%group//'.'//statement%key)
      case ('scene.fraction')
         clause = 'solid_fraction in &scene'
      case ('scene.motion')
         clause = 'kind in a group &motion'
      case ('scene.motion_bodies', 'scene.motion_pivot', 'scene.motion_rate', 'scene.motion_velocity', &
            'scene.motion_amplitude', 'scene.motion_frequency', 'scene.motion_start', 'scene.motion_ramp')
         clause = statement%key(len('motion_') + 1:)//' in a group &motion'
      case ('scene.corners_min', 'scene.corners_max', 'scene.long_axis_min', 'scene.long_axis_max')
         clause = 'one of the two values of '//statement%key(:len(statement%key) - len('_min'))//' in &scene'
      case ('integrate.fraction')
         clause = 'safety_factor in &integrate'
      case ('guards.passing')
         clause = 'tunnelling in &guards'
      case ('guards.relaxed_depth')
         clause = 'remove_overlap in &scene'
      case ('cell.obeys')
         clause = 'stress_controlled in &cell'
      case ('checkpoint.elapsed')
         clause = 'wall_interval in &checkpoint'
      case default
         clause = ''
      end select
   end function new_name

   !> Put an override in the place of a statement of the file.
   pure subroutine apply_override(override, table, instances, error)
      !> 'group.key=value', or 'group.name.key=value' of a repeatable group. Words, paths and names need no quotes
      character(len=*), intent(in) :: override
      type(entry_t), intent(in) :: table(:)
      type(instance_t), intent(inout) :: instances(:)
      type(error_t), allocatable, intent(inout) :: error
      type(statement_t) :: statement
      character(len=:), allocatable :: name
      integer :: place

      call read_override(override, table, statement, name, error)
      if (allocated(error)) return
      if (is_repeatable(table, statement%group)) then
         place = index_of_instance(instances, statement%group, name)
         if (place == 0) call raise_unknown_instance(statement, name, names_of(instances, statement%group), error)
         if (place > 0 .and. statement%key == 'name') call raise(error, input_error, statement%place// &
            ': ''name'' in &'//statement%group//' cannot be overridden')
         if (allocated(error)) return
      else
         place = index_of_instance(instances, statement%group)
      end if
      instances(place)%given(first_row_of(instances(place), statement%key)) = statement
      instances(place)%is_given = .true.
   end subroutine apply_override

   !> Read 'group.key=value' as the statement '&group key = value', and the name in 'group.name.key=value'.
   pure subroutine read_override(override, table, statement, name, error)
      character(len=*), intent(in) :: override
      type(entry_t), intent(in) :: table(:)
      type(statement_t), intent(out) :: statement
      !> Name of the instance of a repeatable group; empty if it is not given
      character(len=:), allocatable, intent(out) :: name
      type(error_t), allocatable, intent(inout) :: error
      type(statement_t), allocatable :: statements(:)
      type(source_t) :: source
      character(len=*), parameter :: line_end = new_line('a')
      integer :: dot, equals, last

      ! Every statement stores the name, so long overrides are shortened.
      source%name = '--set '//override(:min(len(override), longest_override))
      if (len(override) > longest_override) source%name = source%name//' ...'
      source%has_lines = .false.
      equals = index(override, '=')
      dot = index(override(:max(0, equals - 1)), '.')
      last = dot
      if (is_repeatable(table, lower_case(override(:max(0, dot - 1))))) &
         last = index(override(:equals - 1), '.', back=.true.)
      if (dot < 2 .or. equals < last + 2) then
         call raise(error, input_error, source%name//': group.key=value is expected')
         return
      end if
      name = override(dot + 1:last - 1)
      associate (group => override(:dot - 1), key => override(last + 1:equals - 1), &
                 value => override(equals + 1:))
         source%text = '&'//group//line_end//key//'='//value_of_override(table, group, key, value)//line_end//'/'
      end associate
      call read_statements(source, statements, error)
      if (allocated(error)) return
      if (size(statements) /= 2) then
         call raise(error, input_error, source%name//': exactly one entry, group.key=value, is expected')
         return
      end if
      statement = statements(2)
      statement%is_override = .true.
      call check_names(statement, table, error)
   end subroutine read_override

   !> Value of an override; quotes are added if the entry is a text without quotes
   pure function value_of_override(table, group, key, given) result(text)
      type(entry_t), intent(in) :: table(:)
      character(len=*), intent(in) :: group, key, given
      character(len=:), allocatable :: text
      integer :: row

      text = given
      row = row_in(table, group, key)
      if (row == 0) return
      if (.not. is_text(table(row))) return
      if (scan(adjustl(given)//' ', '''"') == 1) return
      text = quoted(trim(adjustl(given)))
   end function value_of_override

   !> Raise an error about an override of a repeatable group that names no instance of the file.
   pure subroutine raise_unknown_instance(statement, name, names, error)
      type(statement_t), intent(in) :: statement
      !> Name in the override, possibly empty, and the names that exist
      character(len=*), intent(in) :: name, names(:)
      type(error_t), allocatable, intent(inout) :: error

      if (size(names) == 0) then
         call raise(error, input_error, statement%place//': the file has no group &'//statement%group)
      else if (name == '') then
         call raise(error, input_error, statement%place//': '//statement%group//'.name.'//statement%key// &
            '=value is expected'//suggestion(name, names))
      else
         call raise(error, input_error, statement%place//': there is no &'//statement%group//' '//quoted(name)// &
            suggestion(name, names))
      end if
   end subroutine raise_unknown_instance

end module polydem_collect_entries
