!> Former words of the namelist: groups, keys and values that have other names now. The reader refuses a former word and
!> names the present one, and `polydem convert` replaces it.
!>
!> A renaming is one row of the table. If the row of a renamed group or key is missing, the reader calls the former word
!> unknown.
module polydem_former_words
   use polydem_strings, only: quoted
   implicit none
   private
   public :: former_word_t, former_words, present_group, present_key, present_value, renaming

   !> A word that has another name now
   type :: former_word_t
      !> Group: the former name if the group was renamed, otherwise the present name
      character(len=13) :: group
      !> Key: the former name if the key was renamed, otherwise the present name; blank: the group was renamed
      character(len=24) :: key
      !> Former value; blank: the group or the key was renamed
      character(len=24) :: value
      !> Present name
      character(len=24) :: present
   end type former_word_t

   !> The table
   type(former_word_t), parameter :: former_words(*) = [ &
      former_word_t('exchange', '', '', 'decomposition'), &
      former_word_t('decomposition', 'cut', '', 'partition'), &
      former_word_t('output', 'ledger', '', 'energy_balance'), &
      former_word_t('forces', 'damping', 'book', 'matuttis_chen'), &
      former_word_t('scene', 'movers', '', 'moving_grains')]

contains

   !> Present name of a group; the group itself if it was not renamed
   pure function present_group(group) result(name)
      !> Group in lower case
      character(len=*), intent(in) :: group
      character(len=:), allocatable :: name

      name = present_name(group, '', '', group)
   end function present_group

   !> Present name of a key; the key itself if it was not renamed
   pure function present_key(group, key) result(name)
      !> Present group
      character(len=*), intent(in) :: group
      !> Key in lower case
      character(len=*), intent(in) :: key
      character(len=:), allocatable :: name

      name = present_name(group, key, '', key)
   end function present_key

   !> Present name of a value; the value itself if it was not renamed
   pure function present_value(group, key, value) result(name)
      !> Present group and key
      character(len=*), intent(in) :: group, key
      !> Value without quotes
      character(len=*), intent(in) :: value
      character(len=:), allocatable :: name

      name = present_name(group, key, value, value)
   end function present_value

   !> Present name of a word; the word itself if the table does not contain it
   pure function present_name(group, key, value, word) result(name)
      character(len=*), intent(in) :: group, key, value, word
      character(len=:), allocatable :: name
      integer :: k

      name = word
      if (word == '') return
      do k = 1, size(former_words)
         if (former_words(k)%group /= group .or. former_words(k)%key /= key) cycle
         if (former_words(k)%value == value) name = trim(former_words(k)%present)
      end do
   end function present_name

   !> Sentence about a renamed word, such as 'the key 'ledger' of &output is now 'energy_balance''
   pure function renaming(group, key, value, present) result(text)
      !> Group
      character(len=*), intent(in) :: group
      !> Key; blank: the group was renamed
      character(len=*), intent(in) :: key
      !> Value; blank: the group or the key was renamed
      character(len=*), intent(in) :: value
      !> Present name of the group, key or value
      character(len=*), intent(in) :: present
      character(len=:), allocatable :: text

      if (key == '') then
         text = 'the group &'//group//' is now &'//present
      else if (value == '') then
         text = 'the key '//quoted(key)//' of &'//group//' is now '//quoted(present)
      else
         text = 'the value '//quoted(value)//' of '//quoted(key)//' in &'//group//' is now '//quoted(present)
      end if
   end function renaming

end module polydem_former_words
