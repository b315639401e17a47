!> Migration buffer: transfers fields of bodies between ranks, or to other slots.
!>
!> The buffer is a serializer and is used in three steps. First it stores the rows of some slots of all columns over
!> bodies, or over vertices. Then `move` sends them to their new ranks, all-to-all, `copy_rows` takes some of them, and
!> `append` joins those of several buffers, if necessary. Finally, after `restore_to` and called with the same columns
!> in the same order, it restores the rows to other slots. Values of the whole run are ignored.
module polydem_migration_buffer
   use polydem_communicator, only: communicator_t
   use polydem_grow, only: grow
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
      !> Number of rows of each column for which there is room beside those to store
      integer(ip) :: room = 0_ip
      !> Number of rows of each column
      integer(ip) :: n_rows = 0_ip
      !> The columns, and room for more
      type(column_t), allocatable, private :: columns(:)
      !> Number of columns
      integer, private :: n_columns = 0
      !> Index of the column that was restored last
      integer, private :: last = 0
   contains
      procedure :: move
      procedure :: copy_rows
      procedure :: append
      procedure :: restore_to
      procedure :: transfer_reals
      procedure :: transfer_longs
   end type migration_buffer_t

   !> Prefix of the names of values of the whole run
   character(len=*), parameter :: of_run = '/run/'

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
      integer :: k, first(self%n_columns + 1)

      first(1) = 1
      do k = 1, self%n_columns
         first(k + 1) = first(k) + size(self%columns(k)%word, 1)
      end do
      allocate (sent(first(self%n_columns + 1) - 1, self%n_rows))
      do k = 1, self%n_columns
         sent(first(k):first(k + 1) - 1, :) = self%columns(k)%word(:, :self%n_rows)
      end do
      call comm%all_to_all(sent, counts, received, counts_received)
      self%n_rows = sum(counts_received)
      do k = 1, self%n_columns
         self%columns(k)%word = received(first(k):first(k + 1) - 1, :)
      end do
   end subroutine move

   !> Copy some rows to another buffer.
   subroutine copy_rows(self, rows, other)
      class(migration_buffer_t), intent(in) :: self
      !> Indices of the rows
      integer(ip), intent(in) :: rows(:)
      !> The other buffer; it has these rows in their order
      type(migration_buffer_t), intent(out) :: other
      integer :: k

      other%n_rows = size(rows, kind=ip)
      other%n_columns = self%n_columns
      allocate (other%columns(other%n_columns))
      do k = 1, self%n_columns
         other%columns(k)%word = self%columns(k)%word(:, rows)
      end do
   end subroutine copy_rows

   !> Append the rows of another buffer with the same columns.
   subroutine append(self, other)
      class(migration_buffer_t), intent(inout) :: self
      !> The other buffer
      type(migration_buffer_t), intent(in) :: other
      integer(ip) :: n
      integer :: k

      n = self%n_rows + other%n_rows
      do k = 1, self%n_columns
         if (size(self%columns(k)%word, 2) < n) call grow(self%columns(k)%word, self%n_rows, n)
         self%columns(k)%word(:, self%n_rows + 1_ip:n) = other%columns(k)%word(:, :other%n_rows)
      end do
      self%n_rows = n
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
      integer(ip) :: k, first, j

      associate (unused => unit//meaning)
      end associate
      if (index(name, of_run) == 1) return
      call next_column(self, width)
      associate (word => self%columns(self%last)%word)
         do k = 1_ip, size(self%slots, kind=ip)
            first = (self%slots(k) - 1_ip)*int(width, ip)
            if (self%is_reading) then
               do j = 1_ip, int(width, ip)
                  values(first + j) = transfer(word(j, k), 1.0_dp)
               end do
            else
               do j = 1_ip, int(width, ip)
                  word(j, k) = transfer(values(first + j), 1_lp)
               end do
            end if
         end do
      end associate
   end subroutine transfer_reals

   !> Store a column of integers, or restore it.
   subroutine transfer_longs(self, name, width, values, unit, meaning)
      class(migration_buffer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer(ip) :: k, first, j

      associate (unused => unit//meaning)
      end associate
      if (index(name, of_run) == 1) return
      call next_column(self, width)
      associate (word => self%columns(self%last)%word)
         do k = 1_ip, size(self%slots, kind=ip)
            first = (self%slots(k) - 1_ip)*int(width, ip)
            if (self%is_reading) then
               do j = 1_ip, int(width, ip)
                  values(first + j) = word(j, k)
               end do
            else
               do j = 1_ip, int(width, ip)
                  word(j, k) = values(first + j)
               end do
            end if
         end do
      end associate
   end subroutine transfer_longs

   !> Go to the next column. When the buffer stores, this is a new one.
   subroutine next_column(self, width)
      class(migration_buffer_t), intent(inout) :: self
      !> Words per row
      integer, intent(in) :: width
      type(column_t), allocatable :: longer(:)
      integer :: k

      self%last = self%last + 1
      if (self%is_reading) return
      if (.not. allocated(self%columns)) allocate (self%columns(8))
      if (self%last > size(self%columns)) then
         allocate (longer(2*self%last))
         do k = 1, self%n_columns
            call move_alloc(self%columns(k)%word, longer(k)%word)
         end do
         call move_alloc(longer, self%columns)
      end if
      self%n_columns = self%last
      self%n_rows = size(self%slots, kind=ip)
      allocate (self%columns(self%last)%word(width, self%n_rows + self%room))
   end subroutine next_column

end module polydem_migration_buffer
