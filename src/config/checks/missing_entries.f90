!> What is said of a required entry that is not given, or of its group.
module polydem_missing_entries
   use polydem_group_instances, only: instance_t
   use polydem_namelist_entries, only: bench_group, entry_t, first_row
   use polydem_namelist_values, only: label
   use polydem_strings, only: quoted, split_words, suggestion
   implicit none
   private
   public :: example_of, missing_text

contains

   !> Message about a required entry that is not given, without the name of the file
   pure function missing_text(entry, instance) result(text)
      type(entry_t), intent(in) :: entry
      !> Its group, with the values of the rows before this one
      type(instance_t), intent(in) :: instance
      character(len=:), allocatable :: text

      if (.not. instance%is_given) then
         text = 'the group &'//trim(entry%group)//' is missing; for example: '//example_of(entry%group)
      else
         text = label(entry)//' is required'//reason(entry, instance)//expected(entry)
      end if
   end function missing_text

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
   pure function reason(entry, instance) result(text)
      type(entry_t), intent(in) :: entry
      type(instance_t), intent(in) :: instance
      character(len=:), allocatable :: text, key

      text = ''
      if (entry%needs == '') return
      key = entry%needs(:index(entry%needs, ':') - 1)
      text = ' with '//key//' = '//quoted(instance%values(first_row(entry%group, key))%text)
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
