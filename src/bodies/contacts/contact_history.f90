!> Contact history: the values that force parts, the search for contacts and the guards store per pair of pieces.
!>
!> The history follows the list of pairs: entry `p` belongs to pair `p`, moves with it when the list changes, and is set
!> to zero when the polygons separate. Force parts and guards declare the columns that they need; there are no others.
module polydem_contact_history
   use polydem_kinds, only: ip, wp
   use polydem_label, only: label_t
   implicit none
   private
   public :: contact_history_t, history_kind_t, add_column, column_of

   !> Description of a column of the contact history; its name is that in checkpoints
   type, extends(label_t) :: history_kind_t
      !> Whether zero marks a new contact. A scheme that does not use the forces at time 0 clears such a column after it
      !> has computed them
      logical :: zero_is_new = .false.
   end type history_kind_t

   !> Column of the contact history
   type :: history_column_t
      !> Description
      type(history_kind_t) :: kind
      !> Value of each pair, zero if its pieces do not overlap, (pair)
      real(wp), allocatable :: value(:)
   end type history_column_t

   !> Contact history of all pairs
   type :: contact_history_t
      !> What the search for overlaps remembers of each pair, 0 nothing. It saves time and changes no result
      integer(ip), allocatable :: features(:)
      !> Columns: those of the force law in the order of its parts, then those of the guards; not allocated if there is
      !> none
      type(history_column_t), allocatable :: column(:)
   end type contact_history_t

contains

   !> Add a column of zeros behind the others.
   subroutine add_column(history, kind, n_pairs)
      type(contact_history_t), intent(inout) :: history
      type(history_kind_t), intent(in) :: kind
      !> Number of pairs
      integer(ip), intent(in) :: n_pairs
      type(history_column_t), allocatable :: longer(:)
      integer :: k, n

      n = 0
      if (allocated(history%column)) n = size(history%column)
      allocate (longer(n + 1))
      do k = 1, n
         longer(k)%kind = history%column(k)%kind
         call move_alloc(history%column(k)%value, longer(k)%value)
      end do
      longer(n + 1)%kind = kind
      allocate (longer(n + 1)%value(n_pairs), source=0.0_wp)
      call move_alloc(longer, history%column)
   end subroutine add_column

   !> Index of a column, 0 if there is none of that name
   pure integer function column_of(history, name)
      type(contact_history_t), intent(in) :: history
      !> Name of the column, as in its description
      character(len=*), intent(in) :: name
      integer :: k

      column_of = 0
      if (.not. allocated(history%column)) return
      do k = 1, size(history%column)
         if (history%column(k)%kind%name == name) column_of = k
      end do
   end function column_of

end module polydem_contact_history
