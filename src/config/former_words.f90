!> Former words of the namelist: groups, keys and values that have other names now. The reader refuses a former word and
!> names the present one, and `polydem convert` replaces it.
!>
!> A renaming is one row of the table. If the row of a renamed group or key is missing, the reader calls the former word
!> unknown.
module polydem_former_words
   use polydem_strings, only: quoted
   implicit none
   private
   public :: former_word_t, former_words, present_name, renaming

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

   !> Present name of a group, a key or a value: of the last word that is given. The word itself if it was not renamed
   pure function present_name(group, key, value) result(name)
      !> Group in lower case; the present name if a key is given
      character(len=*), intent(in) :: group
      !> Key in lower case; the present name if a value is given
      character(len=*), intent(in), optional :: key
      !> Value without quotes
      character(len=*), intent(in), optional :: value
      character(len=:), allocatable :: name, wanted_key, wanted_value
      integer :: k

      name = group
      wanted_key = ''
      wanted_value = ''
      if (present(key)) wanted_key = key
      if (present(key)) name = key
      if (present(value)) wanted_value = value
      if (present(value)) name = value
      if (name == '') return
      do k = 1, size(former_words)
         if (former_words(k)%group /= group .or. former_words(k)%key /= wanted_key) cycle
         if (former_words(k)%value == wanted_value) name = trim(former_words(k)%present)
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
