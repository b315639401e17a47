!> What is said of a required entry that is not given, or of its group.
module polydem_missing_entries
   use polydem_namelist_entries, only: bench_group, entry_t, first_row, group_length
   use polydem_namelist_statements, only: statement_t
   use polydem_namelist_values, only: label, value_t
   use polydem_strings, only: quoted, split_words, suggestion
   implicit none
   private
   public :: example_of, list_groups, missing_text

contains

   !> Message about a required entry that is not given, without the name of the file
   pure function missing_text(entry, values, present_groups) result(text)
      type(entry_t), intent(in) :: entry
      !> Values of the rows before this one, (row of the table)
      type(value_t), intent(in) :: values(:)
      !> Groups that are given, (any)
      character(len=*), intent(in) :: present_groups(:)
      character(len=:), allocatable :: text

      if (all(present_groups /= entry%group)) then
         text = 'the group &'//trim(entry%group)//' is missing; for example: '//example_of(entry%group)
      else
         text = label(entry)//' is required'//reason(entry, values)//expected(entry)
      end if
   end function missing_text

   !> List the groups of the file and of overrides.
   pure subroutine list_groups(statements, given, present_groups)
      !> Statements of the file, (any), and statements of entries, unallocated values if an entry is not given, (row)
      type(statement_t), intent(in) :: statements(:), given(:)
      !> Their groups, (any)
      character(len=group_length), allocatable, intent(out) :: present_groups(:)
      integer :: k, n

      allocate (present_groups(size(statements) + size(given)))
      n = 0
      do k = 1, size(statements)
         n = n + 1
         present_groups(n) = statements(k)%group
      end do
      do k = 1, size(given)
         if (.not. allocated(given(k)%values)) cycle
         n = n + 1
         present_groups(n) = given(k)%group
      end do
      present_groups = present_groups(:n)
   end subroutine list_groups

   !> A short example of a group with required entries, for a message
   pure function example_of(group) result(text)
      !> Name of the group
      character(len=*), intent(in) :: group
      character(len=:), allocatable :: text

      select case (group)
      case ('scene')
         text = "&scene name = 'bed' bodies = 100 /"
      case (bench_group)
         text = "&bench scenes = 'inputs/gas.nml' names = 'gas' finders = 'two_level' /"
      case default
         text = '&integrate duration = 1.0 /'
      end select
   end function example_of

   !> Condition under which an entry is required, such as ' with name = 'hopper''; empty if it is always required
   pure function reason(entry, values) result(text)
      type(entry_t), intent(in) :: entry
      type(value_t), intent(in) :: values(:)
      character(len=:), allocatable :: text, key

      text = ''
      if (entry%needs == '') return
      key = entry%needs(:index(entry%needs, ':') - 1)
      text = ' with '//key//' = '//quoted(values(first_row(entry%group, key))%text)
   end function reason

   !> Description of a required entry: choices, or meaning, bounds and unit; for the end of a message
   pure function expected(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text

      select case (entry%type)
      case ('word')
         text = suggestion('', split_words(entry%allowed))
      case default
         text = ' ('//trim(entry%meaning)
         if (entry%allowed /= '') text = text//', '//trim(entry%allowed)
         if (entry%unit /= '') text = text//' ['//trim(entry%unit)//']'
         text = text//')'
      end select
   end function expected

end module polydem_missing_entries
