!> Replaces the former words of a namelist by the present ones. Comments, order and layout do not change.
module polydem_convert_namelist
   use polydem_errors, only: error_t
   use polydem_former_words, only: present_name, renaming
   use polydem_namelist_tokens, only: bare_token, end_token, equals_token, group_token, quoted_token, source_t, &
      split_tokens, token_t
   use polydem_strings, only: lower_case, text_t
   implicit none
   private
   public :: convert_namelist

contains

   !> Replace every former word in its place.
   pure subroutine convert_namelist(file_name, text, converted, changes, error)
      !> Name of the source in messages
      character(len=*), intent(in) :: file_name
      !> Namelist text
      character(len=*), intent(in) :: text
      !> The text with the present words; equal to `text` if it contains no former word
      character(len=:), allocatable, intent(out) :: converted
      !> One line per changed word, such as 't.nml:3: the group &exchange is now &decomposition'
      type(text_t), allocatable, intent(out) :: changes(:)
      !> First character or quote that a namelist cannot contain
      type(error_t), allocatable, intent(inout) :: error
      type(source_t) :: source
      type(token_t), allocatable :: tokens(:)
      character(len=:), allocatable :: group, key, word, present, change
      integer :: first, k, written

      source%name = trim(file_name)
      source%text = text
      allocate (changes(0))
      converted = ''
      written = 0
      group = ''
      key = ''
      call split_tokens(source, tokens, error)
      if (allocated(error)) return
      do k = 1, size(tokens)
         ! The quotes of a text stay.
         first = tokens(k)%first + merge(1, 0, tokens(k)%kind == quoted_token)
         word = text(first:tokens(k)%last - (first - tokens(k)%first))
         present = word
         select case (tokens(k)%kind)
         case (group_token)
            present = present_name(lower_case(word))
            group = present
            key = ''
            change = renaming(lower_case(word), '', '', present)
         case (end_token)
            group = ''
         case (bare_token, quoted_token)
            if (group == '') cycle
            if (tokens(k)%kind == bare_token .and. is_key(tokens, k)) then
               present = present_name(group, lower_case(word))
               key = present
               change = renaming(group, lower_case(word), '', present)
            else
               present = present_name(group, key, word)
               change = renaming(group, key, trim(word), present)
            end if
         case default
            cycle
         end select
         if (tokens(k)%kind == end_token .or. lower_case(present) == lower_case(word)) cycle
         converted = converted//text(written + 1:first - 1)//present
         written = first + len(word) - 1
         change = source%place(tokens(k)%line)//': '//change
         changes = [changes, text_t(change)]
      end do
      converted = converted//text(written + 1:)
   end subroutine convert_namelist

   !> Whether a token is a key: `=` follows
   pure logical function is_key(tokens, k)
      type(token_t), intent(in) :: tokens(:)
      integer, intent(in) :: k

      is_key = .false.
      if (k < size(tokens)) is_key = tokens(k + 1)%kind == equals_token
   end function is_key

end module polydem_convert_namelist
