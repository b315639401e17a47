!> Texts that were sound: bytes and words of them replaced, left out, doubled, swapped, repeated.
module damaged_text
   use polydem_kinds, only: ip
   use polydem_namelist_entries, only: entries
   use polydem_random, only: random_t
   implicit none
   private
   public :: damage, damage_bytes

   !> What bytes of namelists are replaced by
   character(len=*), parameter :: debris = '&/=,.''"!()%*+-0123456789eEdDtfnaN _$'// &
      achar(9)//achar(10)//achar(13)//achar(0)//achar(127)//char(200)
   !> Values at the edge of what can be read
   character(len=*), parameter :: edges(*) = [character(len=24) :: '0', '-0', '1', '-1', '2147483647', '-2147483648', &
      '2147483648', '99999999999999999999', '1e308', '-1e308', '1e309', '1e-308', '4.9e-324', '1e-99999', '1e999999', &
      '.5', '5.', '.', '1e', '1d3', 'nan', '-inf', 'infinity', '.true.', 'f', '''''', '""', '''a', '3*1', '(1)', &
      '0x10', '1_8', 'null', '1,', ',', '1 2 3', '&end', '/', '!', '!!', '&', '''it''''s''']

contains

   !> Damage a namelist text in up to four places.
   subroutine damage(random, text)
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> The text
      character(len=:), allocatable, intent(inout) :: text
      integer :: k

      do k = 1, random%whole(0_ip, 4_ip)
         select case (random%whole(1_ip, 9_ip))
         case (1, 2)
            call damage_letters(random, text)
         case (3, 4, 5)
            call replace_word(random, text)
         case (6)
            call swap_stretches(random, text)
         case (7)
            call replace_range(random, text, stretch_of(random, text)//stretch_of(random, text))
         case (8)
            call insert_entry(random, text)
         case default
            if (random%whole(1_ip, 40_ip) == 1_ip) call repeat_stretch(random, text)
         end select
      end do
   end subroutine damage

   !> Replace, invert, double or leave out some bytes of any text.
   subroutine damage_bytes(random, text)
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> The text
      character(len=:), allocatable, intent(inout) :: text
      integer :: k, kind_of_damage, n, place

      kind_of_damage = random%whole(1_ip, 12_ip)
      if (kind_of_damage == 1) then
         text = text(:random%whole(0_ip, len(text, kind=ip)))
         return
      else if (kind_of_damage == 2) then
         call swap_stretches(random, text)
         return
      end if
      do k = 1, random%whole(1_ip, 8_ip)
         if (len(text) == 0) return
         place = random%whole(1_ip, len(text, kind=ip))
         select case (random%whole(1_ip, 4_ip))
         case (1)
            text(place:place) = char(random%whole(0_ip, 255_ip))
         case (2)
            n = ieor(ichar(text(place:place)), shiftl(1, random%whole(0_ip, 7_ip)))
            text(place:place) = char(n)
         case (3)
            n = min(len(text), place + random%whole(0_ip, 7_ip))
            text(place:n) = repeat(char(255*random%whole(0_ip, 1_ip)), n - place + 1)
         case default
            n = random%whole(1_ip, len(text, kind=ip))
            text(place:place) = text(n:n)
         end select
      end do
   end subroutine damage_bytes

   subroutine damage_letters(random, text)
      type(random_t), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      integer :: first, last, place

      call choose_range(random, text, 10_ip, first, last)
      place = random%whole(1_ip, len(debris, kind=ip))
      select case (random%whole(1_ip, 4_ip))
      case (1)
         text = text(:first - 1)//debris(place:place)//text(min(first, last) + 1:)
      case (2)
         text = text(:first - 1)//text(last + 1:)
      case (3)
         text = text(:first - 1)//debris(place:place)//text(first:)
      case default
         text = text(:last)//text(first:)
      end select
   end subroutine damage_letters

   !> Put a value from the edge, or the word of another entry, in the place of a word.
   subroutine replace_word(random, text)
      type(random_t), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable :: word
      integer :: first, last

      if (len(text) == 0) return
      first = random%whole(1_ip, len(text, kind=ip))
      first = first + verify(text(first:)//'x', ' =,'//new_line('a')) - 1
      last = min(len(text), first + scan(text(first:)//' ', ' =,'//new_line('a')) - 2)
      word = trim(edges(random%whole(1_ip, size(edges, kind=ip))))
      if (random%whole(1_ip, 3_ip) == 1_ip) word = any_key(random)
      text = text(:first - 1)//word//text(last + 1:)
   end subroutine replace_word

   !> Put an entry of the table, with any value, in the place of a line end.
   subroutine insert_entry(random, text)
      type(random_t), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      integer :: first, last

      call choose_range(random, text, 1_ip, first, last)
      first = first + scan(text(first:)//new_line('a'), new_line('a')) - 1
      text = text(:first - 1)//new_line('a')//any_key(random)//' = '// &
         trim(edges(random%whole(1_ip, size(edges, kind=ip))))//new_line('a')//text(first:)
   end subroutine insert_entry

   function any_key(random) result(key)
      type(random_t), intent(inout) :: random
      character(len=:), allocatable :: key

      associate (entry => entries(random%whole(1_ip, size(entries, kind=ip))))
         key = trim(entry%key)
         if (random%whole(1_ip, 4_ip) == 1_ip) key = '&'//trim(entry%group)
      end associate
   end function any_key

   !> Repeat a stretch until the text has up to a million bytes.
   subroutine repeat_stretch(random, text)
      type(random_t), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      integer :: first, last, n

      call choose_range(random, text, 30_ip, first, last)
      n = max(1, 2**random%whole(4_ip, 20_ip)/max(1, last - first + 1))
      if (n*(last - first + 1) + len(text) > 1048576) n = 16
      text = text(:first - 1)//repeat(text(first:last), n)//text(last + 1:)
   end subroutine repeat_stretch

   subroutine swap_stretches(random, text)
      type(random_t), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable :: stretch

      stretch = stretch_of(random, text)
      call replace_range(random, text, stretch)
   end subroutine swap_stretches

   function stretch_of(random, text) result(stretch)
      type(random_t), intent(inout) :: random
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: stretch
      integer :: first, last

      call choose_range(random, text, 60_ip, first, last)
      stretch = text(first:last)
   end function stretch_of

   subroutine replace_range(random, text, stretch)
      type(random_t), intent(inout) :: random
      character(len=:), allocatable, intent(inout) :: text
      character(len=*), intent(in) :: stretch
      integer :: first, last

      call choose_range(random, text, 60_ip, first, last)
      text = text(:first - 1)//stretch//text(last + 1:)
   end subroutine replace_range

   !> Bounds of a stretch of the text of at most n bytes; empty (1, 0) if the text is
   subroutine choose_range(random, text, n, first, last)
      type(random_t), intent(inout) :: random
      character(len=*), intent(in) :: text
      integer(ip), intent(in) :: n
      integer, intent(out) :: first, last

      first = 1
      last = 0
      if (len(text) == 0) return
      first = random%whole(1_ip, len(text, kind=ip))
      last = min(len(text), first + random%whole(0_ip, n - 1_ip))
   end subroutine choose_range

end module damaged_text
