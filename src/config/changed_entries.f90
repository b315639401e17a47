!> Comparison of the settings of two runs: a text that lists the entries that differ.
module polydem_changed_entries
   use polydem_kinds, only: wp
   use polydem_namelist_entries, only: entries, is_repeatable
   use polydem_strings, only: text_t
   implicit none
   private
   public :: changed_entries, is_extension

   !> Entries that do not affect the computed result
   character(len=*), parameter :: harmless(*) = [character(len=24) :: 'output.folder', 'checkpoint.steps', &
                                                 'checkpoint.interval', 'checkpoint.wall_interval', &
                                                 'checkpoint.at_end', 'decomposition.margin', &
                                                 'decomposition.balance', 'decomposition.imbalance']
   !> Entry that a run may increase while it goes on
   character(len=*), parameter :: duration = 'integrate.duration'
   !> Beginning of the names of entries of stages, which may follow those of the earlier run
   character(len=*), parameter :: stage = 'stage.'

contains

   !> List of the entries that differ, such as 'forces.stiffness was 1.0e7 and is 2.0e7; ...'; empty if none differs.
   pure function changed_entries(former, present) result(text)
      !> Resolved settings of the earlier run, one entry per line, as in `settings_t`
      character(len=*), intent(in) :: former
      !> Resolved settings of the present run, likewise
      character(len=*), intent(in) :: present
      character(len=:), allocatable :: text
      type(text_t), allocatable :: old_name(:), old_value(:), new_name(:), new_value(:)
      integer :: j, k

      call list_entries(former, old_name, old_value)
      call list_entries(present, new_name, new_value)
      text = ''
      do k = 1, size(old_name)
         j = place_of(old_name(k)%text, new_name)
         if (j == 0) then
            call add(old_name(k)%text//' was '//old_value(k)%text//' and is not used now', text)
         else if (new_value(j)%text /= old_value(k)%text) then
            call add(old_name(k)%text//' was '//old_value(k)%text//' and is '//new_value(j)%text, text)
         end if
      end do
      do k = 1, size(new_name)
         if (place_of(new_name(k)%text, old_name) > 0) cycle
         call add(new_name(k)%text//' was not used and is '//new_value(k)%text, text)
      end do
   end function changed_entries

   !> Whether the present settings are those of the earlier run but for a longer duration, or for more stages. At the
   !> same time step both runs then have the same states as long as both last
   pure logical function is_extension(former, present)
      !> Resolved settings of the earlier run, one entry per line, as in `settings_t`
      character(len=*), intent(in) :: former
      !> Resolved settings of the present run, likewise
      character(len=*), intent(in) :: present
      type(text_t), allocatable :: old_name(:), old_value(:), new_name(:), new_value(:)
      integer :: j, k

      call list_entries(former, old_name, old_value)
      call list_entries(present, new_name, new_value)
      is_extension = .false.
      do k = 1, size(new_name)
         if (place_of(new_name(k)%text, old_name) > 0) cycle
         ! Entries of a stage that follows the former ones
         if (index(new_name(k)%text, stage) /= 1) return
         if (any([(index(old_name(j)%text, group_of(new_name(k)%text)) == 1, j=1, size(old_name))])) return
      end do
      do k = 1, size(old_name)
         j = place_of(old_name(k)%text, new_name)
         if (j == 0) return
         if (new_value(j)%text == old_value(k)%text) cycle
         if (old_name(k)%text == duration) then
            if (.not. number(new_value(j)%text) > number(old_value(k)%text)) return
         else if (old_name(k)%text /= stage//'name' .or. index(new_value(j)%text, old_value(k)%text//', ') /= 1) then
            return
         end if
         is_extension = .true.
      end do
   end function is_extension

   !> Beginning of a name with the group and the name of the instance, with the dot behind it
   pure function group_of(name) result(group)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: group

      group = name(:index(name, '.', back=.true.))
   end function group_of

   !> Value of a resolved entry with one number
   pure real(wp) function number(text)
      character(len=*), intent(in) :: text
      integer :: status

      read (text, *, iostat=status) number
      if (status /= 0) number = 0.0_wp
   end function number

   !> Append a sentence; '; ' separates sentences.
   pure subroutine add(sentence, text)
      character(len=*), intent(in) :: sentence
      character(len=:), allocatable, intent(inout) :: text

      if (text /= '') text = text//'; '
      text = text//sentence
   end subroutine add

   !> Split resolved settings into names and values, without the entries that do not affect the result. Names are
   !> 'group.key', or 'group.instance.key' of a repeatable group; 'group.name' has the names of all its instances, since
   !> their order affects the result.
   pure subroutine list_entries(settings, names, values)
      character(len=*), intent(in) :: settings
      type(text_t), allocatable, intent(out) :: names(:), values(:)
      character(len=:), allocatable :: group, line, name
      integer :: equals, first, last, place

      allocate (names(0), values(0))
      group = ''
      first = 1
      do while (first <= len(settings))
         last = index(settings(first:)//new_line('a'), new_line('a')) + first - 2
         line = trim(adjustl(settings(first:last)))
         first = last + 2
         equals = index(line, ' = ')
         if (index(line, '&') == 1) then
            group = line(2:)
         else if (equals > 0) then
            name = group//'.'//line(:equals - 1)
            if (any(harmless == name)) cycle
            if (is_repeatable(entries, group)) then
               ! The first entry of a repeatable group is its name.
               group = group//'.'//line(equals + 4:len(line) - 1)
               place = place_of(name, names)
               if (place > 0) then
                  values(place)%text = values(place)%text//', '//line(equals + 3:)
                  cycle
               end if
            end if
            names = [names, text_t(name)]
            values = [values, text_t(line(equals + 3:))]
         end if
      end do
   end subroutine list_entries

   !> Index of a name in a list; 0 if the list does not contain it
   pure integer function place_of(name, names)
      character(len=*), intent(in) :: name
      type(text_t), intent(in) :: names(:)

      do place_of = 1, size(names)
         if (names(place_of)%text == name) return
      end do
      place_of = 0
   end function place_of

end module polydem_changed_entries
