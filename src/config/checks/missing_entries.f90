!> What is said of a required entry that is not given, or of its group.
module polydem_missing_entries
   use polydem_group_instances, only: instance_t, row_of
   use polydem_namelist_entries, only: entry_t
   use polydem_namelist_values, only: label
   use polydem_strings, only: quoted, split_words, suggestion
   implicit none
   private
   public :: missing_group, missing_text

   !> A short text of a run
   character(len=*), parameter, public :: run_example = "&scene name = 'bed' bodies = 100 / &integrate duration = 1.0 /"

contains

   !> Message about a required entry that is not given, without the name of the file
   pure function missing_text(entry, instance) result(text)
      type(entry_t), intent(in) :: entry
      !> Its group, with the values of the rows before this one
      type(instance_t), intent(in) :: instance
      character(len=:), allocatable :: text

      text = label(entry)//' is required'//reason(entry, instance)//expected(entry)
   end function missing_text

   !> Message about a group that is missing, without the name of the file
   pure function missing_group(group, example) result(text)
      !> Name of the group
      character(len=*), intent(in) :: group
      !> A short text that has the group
      character(len=*), intent(in) :: example
      character(len=:), allocatable :: text

      text = 'the group &'//trim(group)//' is missing; for example: '//example_of(group, example)
   end function missing_group

   !> A group of an example
   pure function example_of(group, example) result(text)
      !> Name of the group
      character(len=*), intent(in) :: group
      !> A short text that has the group
      character(len=*), intent(in) :: example
      character(len=:), allocatable :: text

      text = example(max(1, index(example, '&'//trim(group)//' ')):)
      text = text(:index(text, ' /') + 1)
   end function example_of

   !> Condition under which an entry is required, such as ' with name = 'hopper''; empty if it is always required
   pure function reason(entry, instance) result(text)
      type(entry_t), intent(in) :: entry
      type(instance_t), intent(in) :: instance
      character(len=:), allocatable :: text, key

      text = ''
      if (entry%needs == '') return
      key = entry%needs(:index(entry%needs, ':') - 1)
      text = ' with '//key//' = '//quoted(instance%values(row_of(instance, key))%text)
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
