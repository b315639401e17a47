!> Migration buffer: transfers fields of bodies between ranks.
!>
!> The buffer is a serializer and is used in three steps. First it stores the rows of some slots of all columns over
!> /bodies. Then `move` sends them to their new ranks, all-to-all, if necessary; rows that stay on this rank are not
!> sent. Finally, after `restore_to` and called with the same columns in the same order, it restores the rows to other
!> slots. Values of the whole run are ignored.
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
      !> The columns, and room for more
      type(column_t), allocatable, private :: columns(:)
      !> Number of columns
      integer, private :: n_columns = 0
      !> Index of the column that was restored last
      integer, private :: last = 0
   contains
      procedure :: move
      procedure :: append
      procedure :: n_rows
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
      integer(lp), allocatable :: sent(:, :), received(:, :), word(:, :)
      integer(ip) :: counts_sent(0:size(counts) - 1), before, own, n, n_lower
      integer :: k, first, width(self%n_columns)

      do k = 1, self%n_columns
         width(k) = size(self%columns(k)%word, 1)
      end do
      own = counts(comm%rank)
      before = sum(counts(:comm%rank - 1_ip))
      counts_sent = counts
      counts_sent(comm%rank) = 0_ip
      allocate (sent(sum(width), sum(counts_sent)))
      first = 1
      do k = 1, self%n_columns
         associate (rows => sent(first:first + width(k) - 1, :), stored => self%columns(k)%word)
            rows(:, :before) = stored(:, :before)
            rows(:, before + 1_ip:) = stored(:, before + own + 1_ip:)
         end associate
         first = first + width(k)
      end do
      call comm%all_to_all(sent, counts_sent, received, counts_received)
      n_lower = sum(counts_received(:comm%rank - 1_ip))
      counts_received(comm%rank) = own
      n = sum(counts_received)
      first = 1
      do k = 1, self%n_columns
         allocate (word(width(k), n))
         associate (rows => received(first:first + width(k) - 1, :))
            word(:, :n_lower) = rows(:, :n_lower)
            word(:, n_lower + 1_ip:n_lower + own) = self%columns(k)%word(:, before + 1_ip:before + own)
            word(:, n_lower + own + 1_ip:) = rows(:, n_lower + 1_ip:)
         end associate
         call move_alloc(word, self%columns(k)%word)
         first = first + width(k)
      end do
   end subroutine move

   !> Append the rows of another buffer with the same columns.
   subroutine append(self, other)
      class(migration_buffer_t), intent(inout) :: self
      !> The other buffer
      type(migration_buffer_t), intent(in) :: other
      integer(lp), allocatable :: word(:, :)
      integer :: k, n

      do k = 1, self%n_columns
         n = size(self%columns(k)%word, 2)
         allocate (word(size(self%columns(k)%word, 1), n + size(other%columns(k)%word, 2)))
         word(:, :n) = self%columns(k)%word
         word(:, n + 1:) = other%columns(k)%word
         call move_alloc(word, self%columns(k)%word)
      end do
   end subroutine append

   !> Number of rows of each column; 0 if there is no column
   pure integer(ip) function n_rows(self)
      class(migration_buffer_t), intent(in) :: self

      n_rows = 0_ip
      if (self%n_columns > 0) n_rows = size(self%columns(1)%word, 2, kind=ip)
   end function n_rows

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
      if (index(name, of_bodies) /= 1) return
      call next_column(self, width)
      associate (word => self%columns(self%last)%word)
         do k = 1_ip, size(self%slots, kind=ip)
            first = (self%slots(k) - 1_ip)*int(width, ip)
            do j = 1_ip, int(width, ip)
               if (self%is_reading) then
                  values(first + j) = transfer(word(j, k), 1.0_dp)
               else
                  word(j, k) = transfer(values(first + j), 1_lp)
               end if
            end do
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
      if (index(name, of_bodies) /= 1) return
      call next_column(self, width)
      associate (word => self%columns(self%last)%word)
         do k = 1_ip, size(self%slots, kind=ip)
            first = (self%slots(k) - 1_ip)*int(width, ip)
            do j = 1_ip, int(width, ip)
               if (self%is_reading) then
                  values(first + j) = word(j, k)
               else
                  word(j, k) = values(first + j)
               end if
            end do
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
      allocate (self%columns(self%last)%word(width, size(self%slots)))
   end subroutine next_column

end module polydem_migration_buffer
