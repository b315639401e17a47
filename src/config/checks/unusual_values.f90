!> Values that are allowed, but hardly meant: numbers in another unit, and angles in radian. The table of entries has
!> the usual range of each entry.
module polydem_unusual_values
   use polydem_group_instances, only: instance_t
   use polydem_kinds, only: wp
   use polydem_namelist_entries, only: entry_t
   use polydem_namelist_values, only: list_text
   use polydem_strings, only: quoted, split_words, text_t
   implicit none
   private
   public :: list_unusual, is_usual

   !> Relative length of rounding errors
   real(wp), parameter :: rounding = 1.0e-6_wp

contains

   !> List a warning about the first unusual value of each entry that is given and in use.
   pure subroutine list_unusual(table, instances, warnings)
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      !> Instances of all groups with their values
      type(instance_t), intent(in) :: instances(:)
      !> The warnings
      type(text_t), allocatable, intent(out) :: warnings(:)
      integer :: i, k, row

      allocate (warnings(0))
      do i = 1, size(instances)
         do row = lbound(instances(i)%values, 1), ubound(instances(i)%values, 1)
            associate (entry => table(row), value => instances(i)%values(row))
               if (entry%usual == '' .or. .not. (value%is_given .and. value%is_active)) cycle
               do k = 1, size(value%reals)
                  if (is_usual(entry, k, value%reals(k))) cycle
                  warnings = [warnings, text_t(value%place//': '//quoted(trim(entry%key))//' in &'// &
                              name_of(instances(i))//' is '//trim(list_text([value%reals(k)])//' '//entry%unit)// &
                              '; usual is '//trim(range_of(entry, k))//': '//trim(entry%meant))]
                  exit
               end do
            end associate
         end do
      end do
   end subroutine list_unusual

   !> Whether a value of an entry is usual
   pure logical function is_usual(entry, k, value)
      !> Row of an entry with a usual range
      type(entry_t), intent(in) :: entry
      !> Number of the value among those of the entry
      integer, intent(in) :: k
      !> The value
      real(wp), intent(in) :: value
      character(len=len(entry%usual)), allocatable :: words(:)
      real(wp) :: bound
      logical :: holds
      integer :: j

      is_usual = .not. abs(value) > 0.0_wp
      words = split_words(range_of(entry, k))
      holds = .true.
      j = 1
      do while (j < size(words))
         if (words(j) == 'or') then
            is_usual = is_usual .or. holds
            holds = .true.
            j = j + 1
         end if
         read (words(j + 1), *) bound
         select case (words(j))
         case ('>')
            holds = holds .and. value > bound
         case ('>=')
            holds = holds .and. value >= bound
         case ('<')
            holds = holds .and. value < bound
         case ('<=')
            holds = holds .and. value <= bound
         case default
            holds = holds .and. abs(value/bound - anint(value/bound)) < rounding
         end select
         j = j + 2
      end do
      is_usual = is_usual .or. holds
   end function is_usual

   !> Usual range of a value of an entry: the last one is that of all further values
   pure function range_of(entry, k) result(text)
      type(entry_t), intent(in) :: entry
      !> Number of the value
      integer, intent(in) :: k
      character(len=:), allocatable :: text
      character(len=*), parameter :: mark = ' / '
      integer :: j

      text = trim(entry%usual)
      do j = 2, k
         text = text(merge(1, index(text, mark) + len(mark), index(text, mark) == 0):)
      end do
      if (index(text, mark) > 0) text = text(:index(text, mark) - 1)
   end function range_of

   !> Group and name, as in 'motion turn'
   pure function name_of(instance) result(text)
      type(instance_t), intent(in) :: instance
      character(len=:), allocatable :: text

      text = trim(trim(instance%group)//' '//instance%name)
   end function name_of

end module polydem_unusual_values
