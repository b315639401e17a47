!> One record of the energy and momentum balance, or of a series: labels and values of its entries, in the order in
!> which they were first set.
module polydem_named_values
   use polydem_kinds, only: dp, wp
   use polydem_label, only: label_t
   use polydem_strings, only: index_of
   implicit none
   private
   public :: named_values_t

   !> The entries of one frame; the caller chooses them
   type :: named_values_t
      !> Label of each entry; its name is also that of its data set in /energy_balance
      type(label_t), allocatable :: label(:)
      !> Value of each entry
      real(dp), allocatable :: value(:)
   contains
      procedure :: set
   end type named_values_t

contains

   !> Set an entry. A new name is appended with its unit and meaning.
   subroutine set(self, name, value, unit, meaning)
      class(named_values_t), intent(inout) :: self
      !> Name of the entry
      character(len=*), intent(in) :: name
      !> Value of the entry, in its unit
      real(wp), intent(in) :: value
      !> Unit; 1 if the value is dimensionless
      character(len=*), intent(in) :: unit
      !> Meaning in a few words
      character(len=*), intent(in) :: meaning
      integer :: k

      if (.not. allocated(self%label)) allocate (self%label(0), self%value(0))
      k = index_of(name, self%label%name)
      if (k == 0) then
         self%label = [self%label, label_t(name, unit, meaning)]
         self%value = [self%value, 0.0_dp]
         k = size(self%label)
      end if
      self%value(k) = real(value, dp)
   end subroutine set

end module polydem_named_values
