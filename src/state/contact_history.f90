!> Contact history: values that force models and the search for contacts store per pair from step to step.
module polydem_contact_history
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: contact_memory_t, memory_kinds, at_tangential, at_area, at_direction

   !> Description of a column of the contact history
   type :: memory_kind_t
      !> Name in checkpoints, and unit
      character(len=16) :: name, unit
      !> Its meaning, for the reader of a checkpoint
      character(len=48) :: meaning
   end type memory_kind_t

   !> A column of the contact history
   type :: memory_column_t
      !> Value of each pair, zero if its bodies do not overlap; not allocated if no model needs it, (pair)
      real(wp), allocatable :: value(:)
   end type memory_column_t

   !> Indices of the columns
   integer, parameter :: at_tangential = 1, at_area = 2, at_direction = 3
   !> All columns. The tangential force is that of the spring or of exact friction. The area is for the backward
   !> difference of Matuttis & Chen and for the detection of new contacts. The direction, packed in one number, is for a
   !> monitor.
   type(memory_kind_t), parameter :: memory_kinds(*) = [ &
      memory_kind_t('tangential', 'N/m', 'tangential force remembered'), &
      memory_kind_t('area', 'm2', 'area of the overlap at the last step'), &
      memory_kind_t('direction', '1', 'direction at the last step, packed')]

   !> Contact history of all pairs: the columns have the order of the pair list and follow its changes
   type :: contact_memory_t
      !> Edge that separated the pair last: +k of the first body, -k of the second, 0 unknown
      integer(ip), allocatable :: separating_edge(:)
      !> Columns in the order of `memory_kinds`
      type(memory_column_t) :: column(size(memory_kinds))
   end type contact_memory_t

end module polydem_contact_history
