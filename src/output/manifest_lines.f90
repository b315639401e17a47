!> The lines of a manifest, as text: what they say, and the chain of hashes that holds them together.
!>
!> A line is a text, a blank, and 16 hexadecimal digits: the hash of the line before (0 for the first), mixed with the
!> length of the text and then with its bytes in words of eight, the last one filled up with zeros.
module polydem_manifest_lines
   use polydem_hash, only: hexadecimal, mix_word
   use polydem_kinds, only: bp, lp
   use polydem_strings, only: to_text
   use polydem_result_folder, only: segment_number
   implicit none
   private
   public :: entry_t, longest_name, chain_line, closing_text, read_line

   !> Longest name of a file of a result
   integer, parameter :: longest_name = 64

   !> A file of a result
   type :: entry_t
      !> Its name, without folder
      character(len=longest_name) :: name = ''
      !> Whether it will not change any more, so that the following is known
      logical :: is_closed = .false.
      !> Its length [B] and the hash of all its bytes
      integer(lp) :: bytes = 0_lp, hash = 0_lp
      !> Of a segment: how many frames it has, and the steps of the first and the last one
      integer(lp) :: frames(3) = 0_lp
   end type entry_t

   !> Digits of a hash
   integer, parameter :: n_digits = 16

contains

   !> Write a line, and let the next one hang on it.
   pure subroutine chain_line(text, chain, line)
      !> What it says
      character(len=*), intent(in) :: text
      !> Hash of the line before; afterwards that of this one
      integer(lp), intent(inout) :: chain
      !> The line, without its end
      character(len=:), allocatable, intent(out) :: line

      chain = next_hash(text, chain)
      line = text//' '//hexadecimal(chain)
   end subroutine chain_line

   !> What a manifest says of a file that will not change any more
   pure function closing_text(entry) result(text)
      !> The file
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text

      text = 'closed '//trim(entry%name)//' '//to_text(entry%bytes)//' '//hexadecimal(entry%hash)
      if (segment_number(entry%name) > 0) text = text//' '//to_text(entry%frames(1))//' '// &
         to_text(entry%frames(2))//' '//to_text(entry%frames(3))
   end function closing_text

   !> Understand a line, if it hangs on the one before.
   pure subroutine read_line(line, chain, verb, entry, good)
      !> The line, without its end
      character(len=*), intent(in) :: line
      !> Hash of the line before; afterwards that of this one if it is good
      integer(lp), intent(inout) :: chain
      !> Its first word
      character(len=:), allocatable, intent(out) :: verb
      !> What the other words say
      type(entry_t), intent(out) :: entry
      !> Whether it is a line of a manifest, every bit of it as it was written
      logical, intent(out) :: good
      character(len=:), allocatable :: rest, word
      integer(lp) :: hash
      integer :: k, n

      n = len(line) - n_digits - 1
      good = n > 0
      if (.not. good) return
      hash = next_hash(line(:n), chain)
      good = line(n + 1:) == ' '//hexadecimal(hash)
      if (.not. good) return
      chain = hash
      rest = line(:n)
      call take_word(rest, verb)
      call take_word(rest, word)
      entry%name = word
      good = index(word, '/') == 0 .and. word /= '' .and. len(word) <= longest_name
      if (verb /= 'closed') then
         good = good .and. rest == ''
         return
      end if
      entry%is_closed = .true.
      call take_word(rest, word)
      call read_count(word, entry%bytes, good)
      call take_word(rest, word)
      call read_hash(word, entry%hash, good)
      if (segment_number(entry%name) > 0) then
         do k = 1, 3
            call take_word(rest, word)
            call read_count(word, entry%frames(k), good)
         end do
      end if
      good = good .and. rest == ''
   end subroutine read_line

   !> Hash of a text behind what was before
   pure integer(lp) function next_hash(text, before)
      character(len=*), intent(in) :: text
      integer(lp), intent(in) :: before
      integer(bp) :: bytes(8)
      integer :: k, j

      next_hash = mix_word(before, len(text, lp))
      do k = 1, len(text), 8
         bytes = 0_bp
         do j = k, min(k + 7, len(text))
            bytes(j - k + 1) = transfer(text(j:j), 0_bp)
         end do
         next_hash = mix_word(next_hash, transfer(bytes, 0_lp))
      end do
   end function next_hash

   pure subroutine take_word(rest, word)
      character(len=:), allocatable, intent(inout) :: rest
      character(len=:), allocatable, intent(out) :: word
      integer :: blank

      blank = index(rest//' ', ' ')
      word = rest(:blank - 1)
      rest = rest(min(blank + 1, len(rest) + 1):)
   end subroutine take_word

   pure subroutine read_count(word, number, good)
      character(len=*), intent(in) :: word
      integer(lp), intent(inout) :: number
      logical, intent(inout) :: good
      integer :: status

      good = good .and. len(word) > 0 .and. len(word) < 19 .and. verify(word, '0123456789') == 0
      if (.not. good) return
      read (word, *, iostat=status) number
      good = status == 0
   end subroutine read_count

   pure subroutine read_hash(word, number, good)
      character(len=*), intent(in) :: word
      integer(lp), intent(inout) :: number
      logical, intent(inout) :: good
      integer :: status

      good = good .and. len(word) == n_digits .and. verify(word, '0123456789abcdef') == 0
      if (.not. good) return
      read (word, '(z16)', iostat=status) number
      good = status == 0
   end subroutine read_hash

end module polydem_manifest_lines
