!> Format of the lines of a manifest, with a hash chain that links each line to the previous one.
!>
!> A line consists of a text, a blank and a hash of 16 hexadecimal digits. The hash starts from the hash of the previous
!> line (0 for the first line). It is mixed with the length of the text and then with the bytes of the text in words of
!> eight bytes; the last word is padded with zeros.
module polydem_manifest_lines
   use polydem_hash, only: hexadecimal, mix_word
   use polydem_kinds, only: bp, lp
   use polydem_result_files, only: segment_number
   use polydem_strings, only: to_text
   implicit none
   private
   public :: entry_t, longest_name, chain_line, closing_text, read_line

   !> Maximum length of the name of a file of a result
   integer, parameter :: longest_name = 64

   !> Entry of the manifest: a file of a result
   type :: entry_t
      !> Name of the file, without folder
      character(len=longest_name) :: name = ''
      !> Whether the file is final; only then are the following components set
      logical :: is_closed = .false.
      !> Length of the file [B] and hash of all its bytes
      integer(lp) :: bytes = 0_lp, hash = 0_lp
      !> For a segment: number of frames, step of the first frame, step of the last frame
      integer(lp) :: frames(3) = 0_lp
   end type entry_t

   !> Number of hexadecimal digits of a hash
   integer, parameter :: n_digits = 16

contains

   !> Append the hash to the text of a line, and advance the hash chain.
   pure subroutine chain_line(text, chain, line)
      !> Text of the line
      character(len=*), intent(in) :: text
      !> On entry the hash of the previous line, on return the hash of this line
      integer(lp), intent(inout) :: chain
      !> The line, without line end
      character(len=:), allocatable, intent(out) :: line

      chain = next_hash(text, chain)
      line = text//' '//hexadecimal(chain)
   end subroutine chain_line

   !> Text of the line that declares a file closed
   pure function closing_text(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text

      text = 'closed '//trim(entry%name)//' '//to_text(entry%bytes)//' '//hexadecimal(entry%hash)
      if (segment_number(entry%name) > 0) text = text//' '//to_text(entry%frames(1))//' '// &
         to_text(entry%frames(2))//' '//to_text(entry%frames(3))
   end function closing_text

   !> Parse a line and verify its hash.
   pure subroutine read_line(line, chain, verb, entry, is_valid)
      !> The line, without line end
      character(len=*), intent(in) :: line
      !> On entry the hash of the previous line, on return the hash of this line if it is valid
      integer(lp), intent(inout) :: chain
      !> First word of the line
      character(len=:), allocatable, intent(out) :: verb
      !> Entry made of the other words
      type(entry_t), intent(out) :: entry
      !> Whether the hash and the syntax of the line are correct
      logical, intent(out) :: is_valid
      character(len=:), allocatable :: rest, word
      integer(lp) :: hash
      integer :: k, n

      n = len(line) - n_digits - 1
      is_valid = n > 0
      if (.not. is_valid) return
      hash = next_hash(line(:n), chain)
      is_valid = line(n + 1:) == ' '//hexadecimal(hash)
      if (.not. is_valid) return
      chain = hash
      rest = line(:n)
      call take_word(rest, verb)
      call take_word(rest, word)
      entry%name = word
      is_valid = index(word, '/') == 0 .and. word /= '' .and. len(word) <= longest_name
      if (verb /= 'closed') then
         is_valid = is_valid .and. rest == ''
         return
      end if
      entry%is_closed = .true.
      call take_word(rest, word)
      call read_count(word, entry%bytes, is_valid)
      call take_word(rest, word)
      call read_hash(word, entry%hash, is_valid)
      if (segment_number(entry%name) > 0) then
         do k = 1, 3
            call take_word(rest, word)
            call read_count(word, entry%frames(k), is_valid)
         end do
      end if
      is_valid = is_valid .and. rest == ''
   end subroutine read_line

   !> Hash of a text, chained to the hash of the previous line
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

   !> Remove the first word from a text.
   pure subroutine take_word(rest, word)
      character(len=:), allocatable, intent(inout) :: rest
      character(len=:), allocatable, intent(out) :: word
      integer :: blank

      blank = index(rest//' ', ' ')
      word = rest(:blank - 1)
      rest = rest(min(blank + 1, len(rest) + 1):)
   end subroutine take_word

   !> Read a non-negative decimal integer.
   pure subroutine read_count(word, number, is_valid)
      character(len=*), intent(in) :: word
      integer(lp), intent(inout) :: number
      logical, intent(inout) :: is_valid
      integer :: status

      is_valid = is_valid .and. len(word) > 0 .and. len(word) < 19 .and. verify(word, '0123456789') == 0
      if (.not. is_valid) return
      read (word, *, iostat=status) number
      is_valid = status == 0
   end subroutine read_count

   !> Read a hash of 16 hexadecimal digits.
   pure subroutine read_hash(word, number, is_valid)
      character(len=*), intent(in) :: word
      integer(lp), intent(inout) :: number
      logical, intent(inout) :: is_valid
      integer :: status

      is_valid = is_valid .and. len(word) == n_digits .and. verify(word, '0123456789abcdef') == 0
      if (.not. is_valid) return
      read (word, '(z16)', iostat=status) number
      is_valid = status == 0
   end subroutine read_hash

end module polydem_manifest_lines
