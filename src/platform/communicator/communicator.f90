!> Communication between the ranks of a run.
!>
!> `communicator_t` is the communicator of one process: its calls are copies or no-ops. `mpi_communicator_t` of builds
!> with MPI overrides what needs messages. Callers use one interface.
!>
!> All procedures are collective except the exchange with neighbour ranks, `receive_from_previous` and `send_to_next`:
!> every rank of the communicator must call them in the same order. Only integers are summed, so a sum does not depend
!> on the distribution of its terms over the ranks.
module polydem_communicator
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip, lp, wp
   implicit none
   private
   public :: communicator_t, neighbour_ranks_t, choose_communicator

   !> Neighbour ranks of a halo exchange, and the rows sent to and received from each; constant between redistributions
   type :: neighbour_ranks_t
      !> Neighbour ranks, ascending
      integer(ip), allocatable :: rank(:)
      !> First row to send to each neighbour; the last entry is the number of rows plus 1, (neighbours + 1)
      integer(ip), allocatable :: sent(:)
      !> First row received from each neighbour; the last entry is the number of rows plus 1, (neighbours + 1)
      integer(ip), allocatable :: received(:)
   end type neighbour_ranks_t

   !> The ranks of a run
   type :: communicator_t
      !> Rank of this process, from 0; rank 0 is the root rank
      integer(ip) :: rank = 0_ip
      !> Number of ranks
      integer(ip) :: size = 1_ip
      !> Number of messages that this rank has sent by `exchange` and `all_to_all`
      integer(lp) :: messages = 0_lp
      !> Size of these messages [B]
      integer(lp) :: bytes = 0_lp
   contains
      !> Replace numbers by their sums over all ranks, element by element
      procedure :: all_reduce_sum => unchanged_longs
      !> Replace numbers by their maxima over all ranks, element by element
      generic :: all_reduce_max => all_reduce_max_longs, all_reduce_max_doubles
      procedure :: all_reduce_max_longs => unchanged_longs
      procedure, private :: all_reduce_max_doubles
      !> Copy values of the root rank to all ranks
      generic :: broadcast => broadcast_longs, broadcast_doubles, broadcast_text
      procedure :: broadcast_longs => unchanged_longs
      procedure, private :: broadcast_doubles
      procedure :: broadcast_text
      !> Collect the lists of all ranks on every rank
      generic :: gather => gather_longs, gather_doubles
      procedure :: gather_longs
      procedure, private :: gather_doubles
      !> Send rows to all ranks and receive rows from all ranks
      generic :: all_to_all => all_to_all_longs, all_to_all_reals
      procedure :: all_to_all_longs
      procedure, private :: all_to_all_reals
      procedure, non_overridable :: exchange
      procedure :: begin_exchange
      procedure :: finish_exchange
      !> Receive numbers from rank - 1, or send them to rank + 1. Nothing happens if that rank does not exist
      procedure :: receive_from_previous => unchanged_longs
      procedure :: send_to_next => unchanged_longs
      procedure :: finalize
      procedure :: is_root
      procedure :: all_reduce_error
      procedure :: all_reduce_text
   end type communicator_t

contains

   !> Combine lists of the same length, broadcast or relay numbers: unchanged, as there is only one rank.
   subroutine unchanged_longs(self, values)
      class(communicator_t), intent(inout) :: self
      !> Numbers of this rank; afterwards the same on all ranks
      integer(lp), intent(inout), contiguous :: values(:)

      associate (unused => self%size, unused_values => values)
      end associate
   end subroutine unchanged_longs

   !> Collect the lists of all ranks, in the order of ranks, on every rank.
   subroutine gather_longs(self, mine, all_of_them, counts)
      class(communicator_t), intent(inout) :: self
      !> List of this rank, of any length
      integer(lp), intent(in), contiguous :: mine(:)
      !> The lists of all ranks, one after the other
      integer(lp), allocatable, intent(out) :: all_of_them(:)
      !> Lengths of the lists, (0:size - 1)
      integer(ip), allocatable, intent(out) :: counts(:)

      all_of_them = mine
      allocate (counts(0:self%size - 1_ip))
      counts = size(mine, kind=ip)
   end subroutine gather_longs

   !> Send rows to all ranks and receive rows from all ranks.
   subroutine all_to_all_longs(self, rows, counts, received, counts_received)
      class(communicator_t), intent(inout) :: self
      !> Rows to send, in the order of their destination ranks, (width, row)
      integer(lp), intent(in), contiguous :: rows(:, :)
      !> Number of rows to send to each rank, including this one, (0:size - 1)
      integer(ip), intent(in) :: counts(0:)
      !> Received rows, in the order of their source ranks, (width, row)
      integer(lp), allocatable, intent(out) :: received(:, :)
      !> Number of rows received from each rank, (0:size - 1)
      integer(ip), allocatable, intent(out) :: counts_received(:)

      received = rows
      allocate (counts_received(0:self%size - 1_ip))
      counts_received = counts
   end subroutine all_to_all_longs

   !> Exchange rows with neighbour ranks. Both sides must have matching routes; other ranks take no part.
   subroutine exchange(self, route, sent, received)
      class(communicator_t), intent(inout) :: self
      !> Neighbour ranks, and the rows sent to and received from each
      type(neighbour_ranks_t), intent(in) :: route
      !> Rows to send, in the order of the route, (width, row)
      real(wp), intent(in), contiguous, target :: sent(:, :)
      !> Received rows, in the order of the route, (width, row)
      real(wp), intent(inout), contiguous, target :: received(:, :)

      call self%begin_exchange(route, sent, received)
      call self%finish_exchange(sent, received)
   end subroutine exchange

   !> Begin an exchange of rows with neighbour ranks. The caller must leave both buffers alone until it is finished.
   subroutine begin_exchange(self, route, sent, received)
      class(communicator_t), intent(inout) :: self
      !> Neighbour ranks
      type(neighbour_ranks_t), intent(in) :: route
      !> Rows to send, (width, row)
      real(wp), intent(in), contiguous, target :: sent(:, :)
      !> Received rows, (width, row)
      real(wp), intent(inout), contiguous, target :: received(:, :)

      associate (unused => self%size, unused_route => route, unused_rows => sent, unused_values => received)
      end associate
   end subroutine begin_exchange

   !> Finish the exchange that was begun with the same buffers.
   subroutine finish_exchange(self, sent, received)
      class(communicator_t), intent(inout) :: self
      !> Rows to send, (width, row)
      real(wp), intent(in), contiguous, target :: sent(:, :)
      !> Received rows, (width, row)
      real(wp), intent(inout), contiguous, target :: received(:, :)

      associate (unused => self%size, unused_rows => sent, unused_values => received)
      end associate
   end subroutine finish_exchange

   !> End the communication. No other call is allowed afterwards.
   subroutine finalize(self)
      class(communicator_t), intent(inout) :: self

      associate (unused => self%size)
      end associate
   end subroutine finalize

   !> Copy a communicator, or make that of one process.
   subroutine choose_communicator(chosen, comm)
      !> The copy
      class(communicator_t), allocatable, intent(out) :: chosen
      !> Communicator of the ranks that work together; absent: this rank works alone
      class(communicator_t), intent(in), optional :: comm

      if (present(comm)) then
         allocate (chosen, source=comm)
      else
         allocate (communicator_t :: chosen)
      end if
   end subroutine choose_communicator

   !> Whether this is the root rank. The root rank writes to the screen and manages the result folder.
   pure logical function is_root(self)
      class(communicator_t), intent(in) :: self

      is_root = self%rank == 0_ip
   end function is_root

   !> All-reduce of errors: afterwards all ranks have the same error if any rank has one. The error with the smallest
   !> place is chosen, and among equal places that of the lowest rank. Flags are replaced by their maxima over all ranks
   !> in the same call.
   subroutine all_reduce_error(self, error, flags)
      class(communicator_t), intent(inout) :: self
      !> Error of this rank, if any; afterwards the same on all ranks
      type(error_t), allocatable, intent(inout) :: error
      !> Numbers that are replaced by their maxima over all ranks
      integer(lp), intent(inout), optional :: flags(:)
      integer(lp), allocatable :: values(:)
      character(len=:), allocatable :: text
      logical :: is_source

      if (self%size == 1_ip) return
      allocate (values(1))
      values(1) = merge(1_lp, 0_lp, allocated(error))
      if (present(flags)) values = [values, flags]
      call self%all_reduce_max(values)
      if (present(flags)) flags = values(2:)
      if (values(1) == 0_lp) return
      values = [-huge(0_lp)]
      if (allocated(error)) values(1) = -error%place
      call self%all_reduce_max(values)
      is_source = allocated(error)
      if (is_source) is_source = -error%place == values(1)
      values = [0_lp]
      if (is_source) then
         values(1) = 2_lp*int(error%code, lp) + merge(1_lp, 0_lp, error%is_unread)
         text = error%message
      end if
      call self%all_reduce_text(text)
      if (.not. allocated(error)) allocate (error)
      if (is_source) then
         if (error%message /= text) values(1) = 0_lp
      end if
      call self%all_reduce_max(values)
      error%code = int(values(1)/2_lp)
      error%is_unread = modulo(values(1), 2_lp) == 1_lp
      error%message = text
   end subroutine all_reduce_error

   !> Give all ranks the text with the largest weight, if any rank has a text. Among equal weights, the text of the
   !> lowest rank is chosen. Collective.
   subroutine all_reduce_text(self, text, weight)
      class(communicator_t), intent(inout) :: self
      !> The text; unallocated if this rank has none
      character(len=:), allocatable, intent(inout) :: text
      !> Weight of the text, larger than -huge; all weights are equal if absent
      real(dp), intent(in), optional :: weight
      integer(lp) :: first(2)
      real(dp) :: weights(1)
      integer(lp), allocatable :: codes(:)

      if (self%size == 1_ip) return
      if (present(weight)) then
         weights = -huge(0.0_dp)
         if (allocated(text)) weights = weight
         call self%all_reduce_max(weights)
         if (weights(1) <= -huge(0.0_dp)) return
         if (allocated(text) .and. weight < weights(1)) deallocate (text)
      end if
      first = 0_lp
      if (allocated(text)) first(1) = int(self%size - self%rank, lp)
      call self%all_reduce_max(first(:1))
      if (first(1) == 0_lp) return
      if (int(self%size - self%rank, lp) == first(1)) first(2) = len(text, lp)
      if (int(self%size - self%rank, lp) /= first(1)) text = ''
      call self%all_reduce_max(first(2:))
      allocate (codes(first(2)))
      codes = 0_lp
      if (len(text) > 0) codes = codes_of(text)
      call self%all_reduce_max(codes)
      text = text_of(codes)
   end subroutine all_reduce_text

   !> Broadcast the text of the root rank.
   subroutine broadcast_text(self, text)
      class(communicator_t), intent(inout) :: self
      !> The text
      character(len=:), allocatable, intent(inout) :: text
      integer(lp) :: length(1)
      integer(lp), allocatable :: codes(:)

      if (self%size == 1_ip) return
      length = len(text, lp)
      call self%broadcast(length)
      if (self%is_root()) then
         codes = codes_of(text)
      else
         allocate (codes(length(1)))
         codes = 0_lp
      end if
      call self%broadcast(codes)
      text = text_of(codes)
   end subroutine broadcast_text

   !> Maxima of real numbers over all ranks, element by element. Numbers have the order of the integers that have their
   !> bits, if the bits behind the sign are inverted in negative ones.
   subroutine all_reduce_max_doubles(self, values)
      class(communicator_t), intent(inout) :: self
      !> Numbers of this rank; afterwards the same on all ranks
      real(dp), intent(inout), contiguous :: values(:)
      integer(lp), allocatable :: words(:)

      if (self%size == 1_ip) return
      words = transfer(values, [0_lp])
      where (words < 0_lp) words = ieor(words, huge(0_lp))
      call self%all_reduce_max(words)
      where (words < 0_lp) words = ieor(words, huge(0_lp))
      values = transfer(words, values)
   end subroutine all_reduce_max_doubles

   !> Broadcast numbers of the root rank.
   subroutine broadcast_doubles(self, values)
      class(communicator_t), intent(inout) :: self
      !> The numbers
      real(dp), intent(inout), contiguous :: values(:)
      integer(lp), allocatable :: words(:)

      if (self%size == 1_ip) return
      words = transfer(values, [0_lp])
      call self%broadcast(words)
      values = transfer(words, values)
   end subroutine broadcast_doubles

   !> Collect the lists of all ranks: `gather_longs` for real numbers.
   subroutine gather_doubles(self, mine, all_of_them, counts)
      class(communicator_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: mine(:)
      real(dp), allocatable, intent(out) :: all_of_them(:)
      integer(ip), allocatable, intent(out) :: counts(:)
      integer(lp), allocatable :: words(:)

      call self%gather(transfer(mine, [0_lp], size(mine)), words, counts)
      allocate (all_of_them(size(words)))
      all_of_them = transfer(words, all_of_them, size(words))
   end subroutine gather_doubles

   !> Send rows to all ranks and receive rows from all ranks: `all_to_all_longs` for real numbers.
   subroutine all_to_all_reals(self, rows, counts, received, counts_received)
      class(communicator_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: rows(:, :)
      integer(ip), intent(in) :: counts(0:)
      real(wp), allocatable, intent(out) :: received(:, :)
      integer(ip), allocatable, intent(out) :: counts_received(:)
      integer(lp), allocatable :: words(:, :), words_received(:, :)
      integer :: k, width

      width = (size(rows, 1)*storage_size(rows) + storage_size(0_lp) - 1)/storage_size(0_lp)
      allocate (words(width, size(rows, 2)))
      do k = 1, size(rows, 2)
         words(:, k) = transfer(rows(:, k), 0_lp, width)
      end do
      call self%all_to_all(words, counts, words_received, counts_received)
      allocate (received(size(rows, 1), size(words_received, 2)))
      do k = 1, size(received, 2)
         received(:, k) = transfer(words_received(:, k), received, size(received, 1))
      end do
   end subroutine all_to_all_reals

   !> Character codes of a text
   pure function codes_of(text) result(codes)
      character(len=*), intent(in) :: text
      integer(lp) :: codes(len(text))
      integer :: k

      do k = 1, len(text)
         codes(k) = int(iachar(text(k:k)), lp)
      end do
   end function codes_of

   !> Text of character codes
   pure function text_of(codes) result(text)
      integer(lp), intent(in) :: codes(:)
      character(len=size(codes)) :: text
      integer :: k

      do k = 1, size(codes)
         text(k:k) = achar(int(codes(k)))
      end do
   end function text_of

end module polydem_communicator
