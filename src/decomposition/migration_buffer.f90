!> Migration buffer: transfers fields of bodies between ranks.
!>
!> The buffer is a serializer and is used in three steps. First it stores the rows of some slots of all columns over
!> /bodies. Then `move` sends them to their new ranks, all-to-all, if necessary. Finally, after `restore_to` and called
!> with the same columns in the same order, it restores the rows to other slots. Values of the whole run are ignored.
module polydem_migration_buffer
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_serializer, only: serializer_t
   implicit none
   private
   public :: migration_buffer_t

   !> One column as rows of 64-bit words
   type :: column_t
      !> The words, (width, row)
      integer(lp), allocatable :: word(:, :)
   end type column_t

   !> Migration buffer
   type, extends(serializer_t) :: migration_buffer_t
      !> Slots of the rows to store, in the order of the destination ranks; later the slots to which they are restored
      integer(ip), allocatable :: slots(:)
      !> All columns so far
      type(column_t), allocatable, private :: columns(:)
      !> Index of the column that was restored last
      integer, private :: last = 0
   contains
      procedure :: move
      procedure :: append
      procedure :: restore_to
      procedure :: transfer_reals
      procedure :: transfer_longs
   end type migration_buffer_t

   !> Prefix of the names of columns over bodies
   character(len=*), parameter :: of_bodies = '/bodies/'

contains

   !> Exchange the rows between ranks. Collective.
   subroutine move(self, comm, counts, counts_received)
      class(migration_buffer_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      !> Number of rows for each rank, (0:size - 1)
      integer(ip), intent(in) :: counts(0:)
      !> Number of rows from each rank, (0:size - 1); the rows are in the order of these ranks
      integer(ip), allocatable, intent(out) :: counts_received(:)
      integer(lp), allocatable :: sent(:, :), received(:, :)
      integer :: k, first, width(size(self%columns))

      do k = 1, size(self%columns)
         width(k) = size(self%columns(k)%word, 1)
      end do
      allocate (sent(sum(width), size(self%slots)))
      first = 1
      do k = 1, size(self%columns)
         sent(first:first + width(k) - 1, :) = self%columns(k)%word
         first = first + width(k)
      end do
      call comm%all_to_all(sent, counts, received, counts_received)
      first = 1
      do k = 1, size(self%columns)
         self%columns(k)%word = received(first:first + width(k) - 1, :)
         first = first + width(k)
      end do
   end subroutine move

   !> Append the rows of another buffer with the same columns.
   subroutine append(self, other)
      class(migration_buffer_t), intent(inout) :: self
      !> The other buffer
      type(migration_buffer_t), intent(in) :: other
      integer :: k

      do k = 1, size(self%columns)
         associate (word => self%columns(k)%word, more => other%columns(k)%word)
            self%columns(k)%word = reshape([word, more], [size(word, 1), size(word, 2) + size(more, 2)])
         end associate
      end do
   end subroutine append

   !> Switch to restoring, from the first column on.
   subroutine restore_to(self, slots)
      class(migration_buffer_t), intent(inout) :: self
      !> Slot of each row
      integer(ip), intent(in) :: slots(:)

      self%slots = slots
      self%is_reading = .true.
      self%last = 0
   end subroutine restore_to

   !> Store a column of real numbers, or restore it.
   subroutine transfer_reals(self, name, width, values, unit, meaning)
      class(migration_buffer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: words(:)

      if (index(name, of_bodies) /= 1) return
      words = transfer(values, [0_lp], size(values))
      call transfer_words(self, width, words)
      if (self%is_reading) values = transfer(words, values, size(values))
      associate (unused => unit//meaning)
      end associate
   end subroutine transfer_reals

   !> Store a column of integers, or restore it.
   subroutine transfer_longs(self, name, width, values, unit, meaning)
      class(migration_buffer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      if (index(name, of_bodies) /= 1) return
      call transfer_words(self, width, values)
      associate (unused => unit//meaning)
      end associate
   end subroutine transfer_longs

   !> Store the rows of the slots as a new column, or restore them from the next column.
   subroutine transfer_words(self, width, words)
      class(migration_buffer_t), intent(inout) :: self
      integer, intent(in) :: width
      !> All rows of the column, one after the other
      integer(lp), intent(inout) :: words(:)
      type(column_t) :: column
      integer(ip) :: k, first

      if (self%is_reading) then
         self%last = self%last + 1
         do k = 1_ip, size(self%slots, kind=ip)
            first = (self%slots(k) - 1_ip)*int(width, ip)
            words(first + 1_ip:first + int(width, ip)) = self%columns(self%last)%word(:, k)
         end do
      else
         if (.not. allocated(self%columns)) allocate (self%columns(0))
         allocate (column%word(width, size(self%slots)))
         do k = 1_ip, size(self%slots, kind=ip)
            first = (self%slots(k) - 1_ip)*int(width, ip)
            column%word(:, k) = words(first + 1_ip:first + int(width, ip))
         end do
         self%columns = [self%columns, column]
      end if
   end subroutine transfer_words

end module polydem_migration_buffer
