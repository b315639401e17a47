!> Copies the value of an entry to a component of the settings types.
module polydem_take_entry
   use polydem_kinds, only: ip, wp
   use polydem_namelist_entries, only: entries, first_row
   use polydem_namelist_values, only: value_t
   use polydem_strings, only: text_t
   implicit none
   private
   public :: take

   !> Copy the value of an entry, named 'group.key', to a component.
   interface take
      module procedure take_real, take_reals, take_integer, take_integers, take_logical, take_text, take_texts
   end interface take

contains

   !> Copy one real number; the other procedures do the same for other types.
   pure subroutine take_real(values, name, component)
      !> Values, (row of the table)
      type(value_t), intent(in) :: values(:)
      !> Entry, 'group.key'
      character(len=*), intent(in) :: name
      !> Component to fill
      real(wp), intent(inout) :: component

      component = values(row_of(values, name))%reals(1)
   end subroutine take_real

   pure subroutine take_reals(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: component(:)

      component = values(row_of(values, name))%reals
   end subroutine take_reals

   pure subroutine take_integer(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      integer(ip), intent(inout) :: component

      component = values(row_of(values, name))%integers(1)
   end subroutine take_integer

   pure subroutine take_integers(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      integer(ip), allocatable, intent(inout) :: component(:)

      component = values(row_of(values, name))%integers
   end subroutine take_integers

   pure subroutine take_logical(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      logical, intent(inout) :: component

      component = values(row_of(values, name))%flag
   end subroutine take_logical

   pure subroutine take_text(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(inout) :: component

      component = values(row_of(values, name))%text
   end subroutine take_text

   pure subroutine take_texts(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      type(text_t), allocatable, intent(inout) :: component(:)

      component = values(row_of(values, name))%texts
   end subroutine take_texts

   !> Row of the entry that is in use; the first row of the entry if none is in use
   pure integer function row_of(values, name) result(row)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      integer :: dot, first

      dot = index(name, '.')
      first = first_row(name(:dot - 1), name(dot + 1:))
      do row = first, size(entries)
         if (values(row)%is_active .and. entries(row)%group == name(:dot - 1) &
            .and. entries(row)%key == name(dot + 1:)) return
      end do
      row = first
   end function row_of

end module polydem_take_entry
