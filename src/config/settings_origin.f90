!> Where settings come from: fills `source_locations_t` from the values of a text.
module polydem_settings_origin
   use polydem_group_instances, only: full_name, instance_t, row_of
   use polydem_namelist_entries, only: entry_t, key_length, keys_of
   use polydem_namelist_tokens, only: source_t
   use polydem_resolve_entries, only: resolved_text
   use polydem_source_locations, only: source_locations_t
   use polydem_unusual_values, only: list_unusual
   implicit none
   private
   public :: store_origin

contains

   !> Store the text, all entries in use, where each was given, and warnings about unusual values.
   pure subroutine store_origin(source, table, instances, origin)
      !> The text
      type(source_t), intent(in) :: source
      !> Table of entries
      type(entry_t), intent(in) :: table(:)
      !> Instances of all groups with their values
      type(instance_t), intent(in) :: instances(:)
      !> Where the settings come from; all of it is replaced
      type(source_locations_t), intent(inout) :: origin

      origin%file = source%name
      origin%text = normalise_line_ends(source%text)
      origin%resolved = resolved_text(table, instances)
      origin%given = resolved_text(table, instances, given_only=.true.)
      call list_places(table, instances, origin)
      call list_unusual(table, instances, origin%unusual)
   end subroutine store_origin

   !> List where the entries were given.
   pure subroutine list_places(table, instances, origin)
      type(entry_t), intent(in) :: table(:)
      type(instance_t), intent(in) :: instances(:)
      type(source_locations_t), intent(inout) :: origin
      character(len=key_length), allocatable :: keys(:)
      integer :: i, k, n

      if (allocated(origin%places)) deallocate (origin%places)
      allocate (origin%places(sum([(size(keys_of(table, instances(i)%group)), i=1, size(instances))])))
      n = 0
      do i = 1, size(instances)
         keys = keys_of(table, instances(i)%group)
         do k = 1, size(keys)
            n = n + 1
            associate (entry => origin%places(n), value => instances(i)%values(row_of(instances(i), trim(keys(k)))))
               entry%group = full_name(instances(i))
               entry%key = trim(keys(k))
               entry%place = origin%file
               if (allocated(value%place)) entry%place = value%place
            end associate
         end do
      end do
   end subroutine list_places

   !> Text without carriage returns and with a line end after the last line
   pure function normalise_line_ends(text) result(plain)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: plain
      character(len=*), parameter :: line_feed = achar(10), carriage_return = achar(13)
      integer :: k, n

      allocate (character(len=len(text) + 1) :: plain)
      n = 0
      do k = 1, len(text)
         if (text(k:k) == carriage_return) cycle
         n = n + 1
         plain(n:n) = text(k:k)
      end do
      if (n > 0) then
         if (plain(n:n) /= line_feed) n = n + 1
         plain(n:n) = line_feed
      end if
      plain = plain(:n)
   end function normalise_line_ends

end module polydem_settings_origin
