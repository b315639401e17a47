!> One record of the energy and momentum balance: names, values, units and meanings of its entries, in the order in
!> which they were first set.
module polydem_named_values
   use polydem_kinds, only: dp, wp
   use polydem_strings, only: index_of
   implicit none
   private
   public :: named_values_t

   !> Maximum length of the name of an entry: a name of the namelist, a dot and a word
   integer, parameter :: name_length = 80
   !> Maximum length of the unit of an entry
   integer, parameter :: unit_length = 16
   !> Maximum length of the meaning of an entry
   integer, parameter :: meaning_length = 96

   !> The entries of one frame; the caller chooses them
   type :: named_values_t
      !> Name of each entry, which is also the name of its data set in /energy_balance
      character(len=name_length), allocatable :: name(:)
      !> Unit of each entry; 1 if it is dimensionless
      character(len=unit_length), allocatable :: unit(:)
      !> Meaning of each entry
      character(len=meaning_length), allocatable :: meaning(:)
      !> Value of each entry
      real(dp), allocatable :: value(:)
   contains
      procedure :: set
   end type named_values_t

contains

   !> Set an entry. A new name is appended with its unit and meaning.
   subroutine set(self, name, value, unit, meaning)
      class(named_values_t), intent(inout) :: self
      !> Name of the entry, at most name_length characters without '/'
      character(len=*), intent(in) :: name
      !> Value of the entry, in its unit
      real(wp), intent(in) :: value
      !> Unit; 1 if the value is dimensionless
      character(len=*), intent(in) :: unit
      !> Meaning in a few words
      character(len=*), intent(in) :: meaning
      integer :: k

      if (.not. allocated(self%name)) allocate (self%name(0), self%unit(0), self%meaning(0), self%value(0))
      k = index_of(name, self%name)
      if (k == 0) then
         self%name = [character(len=name_length) :: self%name, name]
         self%unit = [character(len=unit_length) :: self%unit, unit]
         self%meaning = [character(len=meaning_length) :: self%meaning, meaning]
         self%value = [self%value, 0.0_dp]
         k = size(self%name)
      end if
      self%value(k) = real(value, dp)
   end subroutine set

end module polydem_named_values
