!> Finds the value of every entry from the statements of the namelist. Each statement must name a known entry, be
!> unique, be used by the chosen options and hold a valid value.
!>
!> Overrides of the command line replace statements of the file. An override can make an entry of the file unused
!> (friction_coefficient after --set forces.friction=none); such an entry is ignored. Any other unused entry is an
!> error.
module polydem_resolve_entries
   use polydem_collect_entries, only: collect_entries
   use polydem_errors, only: error_t, input_error, raise
   use polydem_group_instances, only: first_row_of, instance_t, names_of, row_of
   use polydem_kinds, only: ip, wp
   use polydem_missing_entries, only: missing_group, missing_text
   use polydem_namelist_entries, only: entries, entry_t, required
   use polydem_namelist_statements, only: read_statements, statement_t
   use polydem_namelist_tokens, only: source_t
   use polydem_namelist_values, only: is_text, label, read_value, value_t, value_text
   use polydem_strings, only: join, count_words, quoted, split_words, suggestion
   implicit none
   private
   public :: resolve_entries, resolved_text, write_group, check_reference

contains

   !> Find the values of all instances of groups.
   pure subroutine resolve_entries(source, table, example, overrides, instances, error)
      !> Namelist text
      type(source_t), intent(in) :: source
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      !> A short text with the groups that must be there, for messages
      character(len=*), intent(in) :: example
      !> Overrides 'group.key=value' or 'group.name.key=value'; the last override of an entry applies
      character(len=*), intent(in) :: overrides(:)
      !> Instances with values, in the order of the table; those of a repeatable group in the order of the file
      type(instance_t), allocatable, intent(out) :: instances(:)
      !> First error found
      type(error_t), allocatable, intent(inout) :: error
      type(statement_t), allocatable :: statements(:)
      integer :: k, row

      call read_statements(source, statements, error)
      if (allocated(error)) return
      if (size(statements) == 0) then
         call raise(error, input_error, source%name//': the file contains no namelist group; for example: '//example)
         return
      end if
      call collect_entries(source, table, statements, overrides, instances, error)
      if (allocated(error)) return
      do k = 1, size(instances)
         do row = lbound(instances(k)%values, 1), ubound(instances(k)%values, 1)
            call resolve_row(table(row), row, example, any(instances%group == 'stage'), instances(k), error)
            if (allocated(error)) return
         end do
      end do
      do k = 1, size(instances)
         do row = lbound(instances(k)%values, 1), ubound(instances(k)%values, 1)
            call check_use(table, row, instances(k), error)
            if (.not. allocated(error) .and. table(row)%type == 'name' .and. table(row)%allowed /= '') &
               call check_reference(table(row), instances(k)%values(row), instances, error)
            if (allocated(error)) return
         end do
      end do
   end subroutine resolve_entries

   !> Find the value of a row: the given value, or the default.
   pure subroutine resolve_row(entry, row, example, has_stages, instance, error)
      type(entry_t), intent(in) :: entry
      integer, intent(in) :: row
      !> A short text with the groups that must be there
      character(len=*), intent(in) :: example
      !> Whether there are groups &stage, which have durations of their own
      logical, intent(in) :: has_stages
      type(instance_t), intent(inout) :: instance
      type(error_t), allocatable, intent(inout) :: error
      integer :: home

      home = first_row_of(instance, trim(entry%key))
      associate (value => instance%values(row))
         value%is_active = is_needed(entry, instance)
         if (value%is_active .and. has_stages .and. entry%group == 'integrate' .and. entry%key == 'duration') then
            value%is_active = .false.
            if (allocated(instance%given(home)%values)) then
               call raise(error, input_error, instance%given(home)%place//': ''duration'' in &integrate cannot be '// &
                  'combined with groups &stage, which have durations of their own; omit it')
               return
            end if
         end if
         if (value%is_active .and. allocated(instance%given(home)%values)) then
            call read_value(entry, instance%given(home), value, error)
         else if (is_optional(entry)) then
            call set_unused(instance%place, 0, entry, value)
         else if (entry%default /= required) then
            call read_value(entry, default_statement(instance%place, entry), value, error)
         else if (.not. instance%is_given .and. value%is_active) then
            call raise(error, input_error, instance%place//': '//missing_group(entry%group, example))
         else if (value%is_active) then
            call raise(error, input_error, instance%place//': '//missing_text(entry, instance))
         else
            call set_unused(instance%place, entry%count, entry, value)
         end if
      end associate
   end subroutine resolve_row

   !> Whether an entry is in use, from the values of earlier rows
   pure logical function is_needed(entry, instance)
      type(entry_t), intent(in) :: entry
      type(instance_t), intent(in) :: instance
      integer :: colon

      is_needed = entry%needs == ''
      if (is_needed) return
      colon = index(entry%needs, ':')
      associate (decider => instance%values(row_of(instance, entry%needs(:colon - 1))))
         if (decider%is_active) is_needed = any(split_words(entry%needs(colon + 1:)) == decider%text)
      end associate
   end function is_needed

   !> Default of a row in the form of a statement
   pure function default_statement(place, entry) result(statement)
      !> Place of the group, for messages
      character(len=*), intent(in) :: place
      type(entry_t), intent(in) :: entry
      type(statement_t) :: statement
      character(len=len(entry%default)) :: words(count_words(entry%default))
      integer :: k

      statement%place = place
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

   !> Whether an entry is a single number without a default
   pure logical function is_optional(entry)
      type(entry_t), intent(in) :: entry

      is_optional = (entry%type == 'real' .or. entry%type == 'integer') .and. entry%count == 1 .and. entry%default == ''
   end function is_optional

   !> Set zeros and an empty text for an entry without default that is not in use, or no number if it is optional.
   pure subroutine set_unused(place, n, entry, value)
      !> Place of the group, for messages
      character(len=*), intent(in) :: place
      !> Number of zeros
      integer, intent(in) :: n
      type(entry_t), intent(in) :: entry
      type(value_t), intent(inout) :: value
      integer :: k

      value%place = place
      value%text = ''
      value%reals = [(0.0_wp, k=1, merge(n, 0, entry%type == 'real'))]
      value%integers = [(0_ip, k=1, merge(n, 0, entry%type == 'integer'))]
      allocate (value%texts(0))
   end subroutine set_unused

   !> Check that the entry of a row is in use if it is given. An entry of the file may be unused because of an override.
   pure subroutine check_use(table, home, instance, error)
      type(entry_t), intent(in) :: table(:)
      !> First row of an entry; nothing is given under other rows
      integer, intent(in) :: home
      type(instance_t), intent(in) :: instance
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: key, needs
      integer :: row

      associate (given => instance%given(home))
         if (.not. allocated(given%values)) return
         needs = ''
         do row = home, ubound(instance%values, 1)
            if (table(row)%key /= given%key) cycle
            if (instance%values(row)%is_active) return
            needs = needs//table(row)%needs(index(table(row)%needs, ':') + 1:)
         end do
         key = table(home)%needs(:index(table(home)%needs, ':') - 1)
         associate (decider => instance%values(row_of(instance, key)))
            if (decider%is_override .and. .not. given%is_override) return
            call raise(error, input_error, given%place//': '//label(table(home))//' is used only with '//key// &
               ' = '//join(split_words(needs), ' or ')//', not with '//decider%text// &
               remedy(instance%group, key, given%key))
         end associate
      end associate
   end subroutine check_use

   !> What else to use in place of an entry that is not in use; empty if nothing is known
   pure function remedy(group, decider, key) result(text)
      !> Group, entry that decides, and entry that is not in use
      character(len=*), intent(in) :: group, decider, key
      character(len=:), allocatable :: text

      text = ''
      if (group == 'cell' .and. decider == 'periodic' .and. key == 'stress_controlled') &
         text = '; a stress controls a wall with a group &load'
   end function remedy

   !> Check that each name in an entry is that of a group which the entry refers to. An empty name refers to none.
   pure subroutine check_reference(entry, value, instances, error)
      !> Row of an entry of type name; `allowed` is the group
      type(entry_t), intent(in) :: entry
      !> Names
      type(value_t), intent(in) :: value
      !> Instances of all groups
      type(instance_t), intent(in) :: instances(:)
      !> First name that no group has
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: names(:), place
      integer :: k

      if (.not. value%is_active) return
      names = names_of(instances, trim(entry%allowed))
      place = ' in &'//trim(entry%group)
      if (entry%key /= entry%allowed) place = ' in '//label(entry)
      do k = 1, size(value%texts)
         if (value%texts(k)%text == '' .or. any(names == value%texts(k)%text)) cycle
         if (size(names) == 0) then
            call raise(error, input_error, value%place//': '//label(entry)//' is '//quoted(value%texts(k)%text)// &
               ', but the file has no group &'//trim(entry%allowed))
         else
            call raise(error, input_error, value%place//': unknown '//trim(entry%allowed)//' '// &
               quoted(value%texts(k)%text)//place//suggestion(value%texts(k)%text, names))
         end if
         return
      end do
   end subroutine check_reference

   !> All entries in use as namelist text that can be read again, one entry per line, without empty lists and groups
   pure function resolved_text(table, instances, given_only) result(text)
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      !> Instances with values
      type(instance_t), intent(in) :: instances(:)
      !> Whether entries that are not given are left out; default: no
      logical, intent(in), optional :: given_only
      character(len=:), allocatable :: text
      logical, allocatable :: chosen(:)
      integer :: k

      text = ''
      do k = 1, size(instances)
         chosen = instances(k)%values%is_active
         if (present(given_only)) chosen = chosen .and. (instances(k)%values%is_given .or. .not. given_only)
         if (any(chosen)) text = text//chosen_text(table, instances(k), chosen)
      end do
   end function resolved_text

   !> Write the entries of a group of a run that are in use and differ from their defaults as namelist text.
   pure subroutine write_group(instance, text)
      !> Group with values; which of them are in use is set
      type(instance_t), intent(inout) :: instance
      !> The text
      character(len=:), allocatable, intent(out) :: text
      type(value_t) :: default
      type(error_t), allocatable :: error
      logical, allocatable :: chosen(:)
      integer :: row

      allocate (chosen(size(instance%values)))
      do row = lbound(instance%values, 1), ubound(instance%values, 1)
         associate (entry => entries(row), value => instance%values(row), &
                    place => row - lbound(instance%values, 1) + 1)
            value%is_active = is_needed(entry, instance)
            chosen(place) = value%is_active
            if (value%is_active .and. entry%default /= required .and. .not. is_optional(entry)) then
               call read_value(entry, default_statement('', entry), default, error)
               chosen(place) = value_text(entry, value) /= value_text(entry, default)
            end if
         end associate
      end do
      text = chosen_text(entries, instance, chosen)
   end subroutine write_group

   !> Some entries of a group as namelist text, without empty lists
   pure function chosen_text(table, instance, chosen) result(text)
      type(entry_t), intent(in) :: table(:)
      type(instance_t), intent(in) :: instance
      !> Whether an entry is among them, (row of the group)
      logical, intent(in) :: chosen(:)
      character(len=:), allocatable :: text, value
      character(len=*), parameter :: line_end = new_line('a')
      integer :: row

      text = '&'//trim(instance%group)//line_end
      do row = lbound(instance%values, 1), ubound(instance%values, 1)
         if (.not. chosen(row - lbound(instance%values, 1) + 1)) cycle
         value = value_text(table(row), instance%values(row))
         if (value /= '') text = text//'   '//trim(table(row)%key)//' = '//value//line_end
      end do
      text = text//'/'//line_end
   end function chosen_text

end module polydem_resolve_entries
