!> Small helpers for words: lower case, quotes, lists, and the word somebody probably meant.
module polydem_words
   implicit none
   private
   public :: text_t, lower_case, quoted, count_words, split_words, suggestion

   !> A text of its own length, for lists of texts
   type :: text_t
      !> The text
      character(len=:), allocatable :: text
   end type text_t

contains

   !> The text with the letters A to Z made small
   pure function lower_case(text) result(small)
      !> Text of any length
      character(len=*), intent(in) :: text
      character(len=len(text)) :: small
      integer, parameter :: shift = iachar('a') - iachar('A')
      integer :: k

      small = text
      do k = 1, len(text)
         if (text(k:k) >= 'A' .and. text(k:k) <= 'Z') small(k:k) = achar(iachar(text(k:k)) + shift)
      end do
   end function lower_case

   !> The text in single quotes as a namelist wants it, quotes inside doubled
   pure function quoted(text) result(literal)
      !> Text of any length
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: literal
      integer :: k, n

      allocate (character(len=2*len(text) + 2) :: literal)
      literal(1:1) = "'"
      n = 1
      do k = 1, len(text)
         if (text(k:k) == "'") then
            n = n + 1
            literal(n:n) = "'"
         end if
         n = n + 1
         literal(n:n) = text(k:k)
      end do
      literal = literal(:n)//"'"
   end function quoted

   !> Number of words in a text; blanks and commas stand between them
   pure integer function count_words(text)
      !> Text of any length
      character(len=*), intent(in) :: text
      integer :: k

      count_words = 0
      do k = 1, len(text)
         if (scan(text(k:k), ' ,') > 0) cycle
         if (scan(text(k + 1:)//' ', ' ,') == 1) count_words = count_words + 1
      end do
   end function count_words

   !> The words of a text; blanks and commas stand between them
   pure function split_words(text) result(words)
      !> Text of any length
      character(len=*), intent(in) :: text
      character(len=len(text)) :: words(count_words(text))
      integer :: first, k, last

      last = 0
      do k = 1, size(words)
         first = last + verify(text(last + 1:), ' ,')
         last = scan(text(first:)//' ', ' ,') + first - 2
         words(k) = text(first:last)
      end do
   end function split_words

   !> The end of a message about an unknown word: the candidate that was probably meant, or else all.
   !>
   !> A candidate is near if at most a third of the letters differ (one letter left out, added or changed, or
   !> two neighbours swapped, count once) or if the word is a part of it.
   pure function suggestion(word, candidates) result(text)
      !> What was written
      character(len=*), intent(in) :: word
      !> What could have been written
      character(len=*), intent(in) :: candidates(:)
      character(len=:), allocatable :: text
      character(len=len_trim(word)) :: small
      integer :: best, distance, k, near

      small = lower_case(trim(word))
      near = (len(small) + 2)/3 + 1
      best = 0
      do k = 1, size(candidates)
         ! The distance is at least the difference of the lengths, and its table may be large.
         distance = abs(len(small) - len_trim(candidates(k)))
         if (distance < near) distance = edit_distance(small, trim(candidates(k)))
         if (len(small) > 2 .and. index(candidates(k), small) > 0) distance = min(distance, 1)
         if (distance < near) then
            near = distance
            best = k
         end if
      end do
      if (best > 0) then
         text = '; did you mean '//quoted(trim(candidates(best)))//'?'
      else
         text = '; choose from '//listed(candidates)
      end if
   end function suggestion

   pure function listed(words) result(text)
      character(len=*), intent(in) :: words(:)
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      do k = 1, size(words)
         if (k > 1) text = text//', '
         text = text//trim(words(k))
      end do
   end function listed

   !> Fewest single-letter changes and swaps of neighbours that turn one word into the other
   pure integer function edit_distance(a, b)
      character(len=*), intent(in) :: a, b
      integer :: d(-1:len(a), -1:len(b)), i, j

      d = len(a) + len(b)
      d(0:, 0) = [(i, i=0, len(a))]
      d(0, 0:) = [(j, j=0, len(b))]
      do j = 1, len(b)
         do i = 1, len(a)
            d(i, j) = min(d(i - 1, j) + 1, d(i, j - 1) + 1, &
               d(i - 1, j - 1) + merge(0, 1, a(i:i) == b(j:j)))
            if (i > 1 .and. j > 1) then
               if (a(i - 1:i) == b(j:j)//b(j - 1:j - 1)) d(i, j) = min(d(i, j), d(i - 2, j - 2) + 1)
            end if
         end do
      end do
      edit_distance = d(len(a), len(b))
   end function edit_distance

end module polydem_words
