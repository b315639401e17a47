!> Manual of the namelist entries: the table of entries as a Markdown table.
module polydem_entries_manual
   use polydem_namelist_entries, only: entries, entry_t, required
   use polydem_namelist_values, only: is_text
   use polydem_strings, only: join, to_text, quoted, split_words
   implicit none
   private
   public :: entries_as_markdown

   character(len=*), parameter :: line_end = new_line('a')

contains

   !> Markdown table with one row for each row of the table of entries
   pure function entries_as_markdown() result(text)
      character(len=:), allocatable :: text
      integer :: k

      text = '| group | key | type | unit | default | range | used with | meaning |'//line_end// &
         '|---|---|---|---|---|---|---|---|'//line_end
      do k = 1, size(entries)
         associate (entry => entries(k))
            text = text//'|'//cell('&'//entry%group)//cell('`'//trim(entry%key)//'`')// &
               cell(type_of(entry))//cell(entry%unit)//cell(default_of(entry))//cell(range_of(entry))// &
               cell(use_of(entry))//cell(entry%meaning)//line_end
         end associate
      end do
   end function entries_as_markdown

   !> One cell with its closing bar
   pure function cell(content) result(text)
      character(len=*), intent(in) :: content
      character(len=:), allocatable :: text

      text = ' '//trim(content)//' |'
      if (content == '') text = ' |'
   end function cell

   !> Type and number of values
   pure function type_of(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text

      text = trim(entry%type)
      if (entry%count == 0) text = text//' list'
      if (entry%count > 1) text = to_text(entry%count)//' '//text//'s'
   end function type_of

   !> Default; texts are in quotes and backticks
   pure function default_of(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text

      if (entry%default == required) then
         text = 'required'
      else if (is_text(entry) .and. entry%count > 0) then
         text = '`'//quoted(trim(entry%default))//'`'
      else
         text = trim(entry%default)
      end if
   end function default_of

   !> Bounds of a number, or choices of a word separated by commas
   pure function range_of(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text

      text = trim(entry%allowed)
      if (entry%type == 'word') text = join(split_words(entry%allowed), ', ')
   end function range_of

   !> Condition under which the entry is used: 'drum, gas' for scenes, 'motion = rotation' for other entries
   pure function use_of(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text
      integer :: colon

      colon = index(entry%needs, ':')
      text = join(split_words(entry%needs(colon + 1:)), ', ')
      if (colon > 0 .and. entry%needs(:colon - 1) /= 'name') text = entry%needs(:colon - 1)//' = '//text
   end function use_of

end module polydem_entries_manual
