!> One row of the energy and momentum ledger: names, values, units and meanings, in the order in which they
!> were first set.
module polydem_ledger_row
   use polydem_kinds, only: dp, wp
   implicit none
   private
   public :: ledger_row_t

   !> Longest name of an entry
   integer, parameter :: name_length = 32
   !> Longest unit of an entry
   integer, parameter :: unit_length = 16
   !> Longest meaning of an entry
   integer, parameter :: meaning_length = 96

   !> The entries of one frame; the driver says what is in it
   type :: ledger_row_t
      !> Name of each entry, and of its data set in /ledger
      character(len=name_length), allocatable :: name(:)
      !> Unit of each entry, 1 for none
      character(len=unit_length), allocatable :: unit(:)
      !> Meaning of each entry
      character(len=meaning_length), allocatable :: meaning(:)
      !> Value of each entry
      real(dp), allocatable :: value(:)
   contains
      procedure :: set
   end type ledger_row_t

contains

   !> Set an entry, appending it if it is new.
   subroutine set(self, name, value, unit, meaning)
      class(ledger_row_t), intent(inout) :: self
      !> Its name, at most name_length characters without '/'
      character(len=*), intent(in) :: name
      !> Its value
      real(wp), intent(in) :: value
      !> Its unit, 1 for none
      character(len=*), intent(in) :: unit
      !> Its meaning in a few words
      character(len=*), intent(in) :: meaning
      character(len=name_length) :: padded_name
      character(len=unit_length) :: padded_unit
      character(len=meaning_length) :: padded_meaning
      integer :: k

      if (.not. allocated(self%name)) allocate (self%name(0), self%unit(0), self%meaning(0), self%value(0))
      padded_name = name
      padded_unit = unit
      padded_meaning = meaning
      do k = 1, size(self%name)
         if (self%name(k) == padded_name) then
            self%value(k) = real(value, dp)
            return
         end if
      end do
      self%name = [self%name, padded_name]
      self%unit = [self%unit, padded_unit]
      self%meaning = [self%meaning, padded_meaning]
      self%value = [self%value, real(value, dp)]
   end subroutine set

end module polydem_ledger_row
