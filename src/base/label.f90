!> What a column of numbers is called, in all tables: contacts in frames, the contact history, the energy balance and
!> series.
module polydem_label
   implicit none
   private
   public :: label_t

   !> Label of a column
   type :: label_t
      !> Name, without '/': often a word, at most a name of the namelist, a dot and a word
      character(len=80) :: name
      !> Unit; 1 if the values are dimensionless
      character(len=16) :: unit
      !> Meaning in a few words
      character(len=96) :: meaning
   end type label_t

end module polydem_label
