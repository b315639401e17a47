!> Instances of namelist groups. A single group has one instance in every run. Of a repeatable group, each one that the
!> file contains is an instance; they follow each other in the order of the file, and their names differ.
module polydem_group_instances
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, wp
   use polydem_namelist_entries, only: entry_t, group_length, groups, is_repeatable, key_length
   use polydem_namelist_statements, only: statement_t
   use polydem_namelist_values, only: value_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: instance_t, new_instances, new_instance, store_value, row_of, first_row_of, index_of_instance, &
      names_of, full_name

   !> Greatest number of instances of a group. Names and parts are compared in pairs
   integer, parameter :: most_instances = 2000
   !> Greatest number of materials, for each pair of which the stable time step is searched
   integer, parameter :: most_materials = 500

   !> An instance of a group: what is given, and the resulting values
   type :: instance_t
      !> Namelist group
      character(len=group_length) :: group = ''
      !> Name of an instance of a repeatable group; empty for a single group
      character(len=:), allocatable :: name
      !> Number in the group, from 1
      integer :: number = 1
      !> For messages: file:line where a repeatable group opens; the file of a single group
      character(len=:), allocatable :: place
      !> Line of the file where the group opens; 0 if the file does not contain it
      integer :: line = 0
      !> Whether the file or an override contains the group
      logical :: is_given = .false.
      !> Key of each entry, (row of the table)
      character(len=key_length), allocatable :: keys(:)
      !> Statement of each entry, under its first row; unallocated values if it is not given, (row of the table)
      type(statement_t), allocatable :: given(:)
      !> Values, (row of the table)
      type(value_t), allocatable :: values(:)
   end type instance_t

contains

   !> Make the instances of all groups, in the order of the table of entries, without their names and entries.
   pure subroutine new_instances(file, table, statements, instances, opened, error)
      !> Name of the source in messages
      character(len=*), intent(in) :: file
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      !> Statements of the file
      type(statement_t), intent(in) :: statements(:)
      !> Instances
      type(instance_t), allocatable, intent(out) :: instances(:)
      !> Index of the instance that a statement opens; 0 if it opens no known group, (statement)
      integer, intent(out) :: opened(:)
      !> A group has too many instances
      type(error_t), allocatable, intent(inout) :: error
      character(len=group_length), allocatable :: names(:)
      integer :: counts(size(groups(table))), g, k, most, n

      names = groups(table)
      opened = 0
      n = 0
      do g = 1, size(names)
         counts(g) = 0
         do k = 1, size(statements)
            if (statements(k)%key /= '' .or. statements(k)%group /= names(g)) cycle
            if (is_repeatable(table, names(g)) .or. counts(g) == 0) counts(g) = counts(g) + 1
            opened(k) = n + counts(g)
         end do
         most = merge(most_materials, most_instances, names(g) == 'material')
         if (counts(g) > most) call raise(error, input_error, file//': there are '//to_text(counts(g))// &
            ' groups &'//trim(names(g))//', but at most '//to_text(most)//' are possible')
         if (.not. is_repeatable(table, names(g))) counts(g) = 1
         n = n + counts(g)
      end do
      if (allocated(error)) return
      allocate (instances(n))
      n = 0
      do g = 1, size(names)
         do k = 1, counts(g)
            n = n + 1
            call new_instance(table, names(g), instances(n))
            instances(n)%number = k
            instances(n)%place = file
         end do
      end do
   end subroutine new_instances

   !> Make an instance of a group without a name and without values.
   pure subroutine new_instance(table, group, instance)
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      !> Namelist group
      character(len=*), intent(in) :: group
      type(instance_t), intent(out) :: instance
      integer :: first

      instance%group = group
      instance%name = ''
      instance%place = ''
      do first = 1, size(table)
         if (table(first)%group == group) exit
      end do
      associate (last => first + count(table%group == group) - 1)
         allocate (instance%given(first:last), instance%values(first:last), instance%keys(first:last))
         instance%keys(:) = table(first:last)%key
      end associate
   end subroutine new_instance

   !> Store the value of an entry in all its rows.
   pure subroutine store_value(instance, key, reals, integers, flag, text)
      type(instance_t), intent(inout) :: instance
      !> Name of the entry in the group
      character(len=*), intent(in) :: key
      !> Its values, of which one kind is present
      real(wp), intent(in), optional :: reals(:)
      !> As `reals`
      integer(ip), intent(in), optional :: integers(:)
      !> As `reals`
      logical, intent(in), optional :: flag
      !> As `reals`
      character(len=*), intent(in), optional :: text
      integer :: row

      do row = lbound(instance%values, 1), ubound(instance%values, 1)
         if (instance%keys(row) /= key) cycle
         associate (value => instance%values(row))
            if (present(reals)) value%reals = reals
            if (present(integers)) value%integers = integers
            if (present(flag)) value%flag = flag
            if (.not. present(text)) cycle
            value%text = text
            if (allocated(value%texts)) deallocate (value%texts)
            allocate (value%texts(1))
            value%texts(1)%text = text
         end associate
      end do
   end subroutine store_value

   !> Row of an entry that is in use; the first row of the entry if none is in use
   pure integer function row_of(instance, key) result(row)
      !> Instance of a group
      type(instance_t), intent(in) :: instance
      !> Name in the group; the entry must exist
      character(len=*), intent(in) :: key

      do row = lbound(instance%values, 1), ubound(instance%values, 1)
         if (instance%values(row)%is_active .and. instance%keys(row) == key) return
      end do
      row = first_row_of(instance, key)
   end function row_of

   !> First row of an entry; 0 if the group does not have it
   pure integer function first_row_of(instance, key) result(row)
      !> Instance of a group
      type(instance_t), intent(in) :: instance
      !> Name in the group
      character(len=*), intent(in) :: key

      do row = lbound(instance%keys, 1), ubound(instance%keys, 1)
         if (instance%keys(row) == key) return
      end do
      row = 0
   end function first_row_of

   !> Index of an instance; 0 if there is none
   pure integer function index_of_instance(instances, group, name) result(place)
      !> Instances of all groups
      type(instance_t), intent(in) :: instances(:)
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Name of the instance of a repeatable group; default: the instance of a single group
      character(len=*), intent(in), optional :: name

      do place = 1, size(instances)
         if (instances(place)%group /= group) cycle
         if (.not. present(name)) return
         if (instances(place)%name == name) return
      end do
      place = 0
   end function index_of_instance

   !> Names of the instances of a repeatable group, in their order
   pure function names_of(instances, group) result(names)
      !> Instances of all groups
      type(instance_t), intent(in) :: instances(:)
      !> Namelist group
      character(len=*), intent(in) :: group
      character(len=:), allocatable :: names(:)
      integer :: k, n, width

      width = 0
      do k = 1, size(instances)
         if (instances(k)%group == group) width = max(width, len(instances(k)%name))
      end do
      allocate (character(len=width) :: names(count(instances%group == group)))
      n = 0
      do k = 1, size(instances)
         if (instances(k)%group /= group) cycle
         n = n + 1
         names(n) = instances(k)%name
      end do
   end function names_of

   !> Group and name as overrides give them, such as 'forces' or 'motion.turn'
   pure function full_name(instance) result(text)
      !> Instance of a group
      type(instance_t), intent(in) :: instance
      character(len=:), allocatable :: text

      text = trim(instance%group)
      if (instance%name /= '') text = text//'.'//instance%name
   end function full_name

end module polydem_group_instances
