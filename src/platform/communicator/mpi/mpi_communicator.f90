!> The ranks of an MPI run. In this layer only this module and `world_communicator.f90` use MPI.
!>
!> Buffers are contiguous. Real rows are sent as bytes, so one code serves every working precision. Open MPI does not
!> copy array sections and does not use the asynchronous attribute. A compiler may therefore keep values of a buffer
!> only until the next call that has the buffer as an argument. Both procedures of an exchange have them as arguments.
module polydem_mpi_communicator
   use mpi_f08, only: mpi_allgather, mpi_allgatherv, mpi_allreduce, mpi_alltoall, mpi_bcast, mpi_byte, mpi_comm, &
      mpi_finalize, mpi_in_place, mpi_integer, mpi_integer8, mpi_irecv, mpi_isend, mpi_max, &
      mpi_recv, mpi_request, mpi_request_null, mpi_send, mpi_statuses_ignore, mpi_status_ignore, mpi_sum, mpi_waitall
   use polydem_communicator, only: neighbour_ranks_t, communicator_t
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: mpi_communicator_t

   !> The ranks of a communicator of MPI
   type, extends(communicator_t) :: mpi_communicator_t
      !> That communicator
      type(mpi_comm) :: handle
      !> Unfinished messages of an exchange
      type(mpi_request), allocatable, private :: requests(:)
   contains
      procedure :: all_reduce_sum
      procedure :: all_reduce_max_longs
      procedure :: broadcast_longs
      procedure :: gather_longs
      procedure :: all_to_all_longs
      procedure :: begin_exchange
      procedure :: finish_exchange
      procedure :: receive_from_previous
      procedure :: send_to_next
      procedure :: finalize
   end type mpi_communicator_t

   !> Tag of all messages. One tag is enough because MPI keeps the order of messages between two ranks
   integer, parameter :: tag = 1

contains

   !> Replace numbers by their sums over all ranks.
   subroutine all_reduce_sum(self, values)
      class(mpi_communicator_t), intent(inout) :: self
      integer(lp), intent(inout), contiguous :: values(:)

      if (self%size == 1_ip) return
      call mpi_allreduce(mpi_in_place, values, size(values), mpi_integer8, mpi_sum, self%handle)
   end subroutine all_reduce_sum

   !> Replace numbers by their maxima over all ranks.
   subroutine all_reduce_max_longs(self, values)
      class(mpi_communicator_t), intent(inout) :: self
      integer(lp), intent(inout), contiguous :: values(:)

      if (self%size == 1_ip) return
      call mpi_allreduce(mpi_in_place, values, size(values), mpi_integer8, mpi_max, self%handle)
   end subroutine all_reduce_max_longs

   !> Broadcast numbers of the root rank.
   subroutine broadcast_longs(self, values)
      class(mpi_communicator_t), intent(inout) :: self
      integer(lp), intent(inout), contiguous :: values(:)

      if (self%size == 1_ip) return
      call mpi_bcast(values, size(values), mpi_integer8, 0, self%handle)
   end subroutine broadcast_longs

   !> Collect the lists of all ranks on every rank.
   subroutine gather_longs(self, mine, all_of_them, counts)
      class(mpi_communicator_t), intent(inout) :: self
      integer(lp), intent(in), contiguous :: mine(:)
      integer(lp), allocatable, intent(out) :: all_of_them(:)
      integer(ip), allocatable, intent(out) :: counts(:)
      integer :: lengths(0:self%size - 1_ip), starts(0:self%size - 1_ip)

      call mpi_allgather(size(mine), 1, mpi_integer, lengths, 1, mpi_integer, self%handle)
      starts = starts_of(lengths)
      allocate (all_of_them(sum(lengths)), counts(0:self%size - 1_ip))
      counts = int(lengths, ip)
      call mpi_allgatherv(mine, size(mine), mpi_integer8, all_of_them, lengths, starts, mpi_integer8, self%handle)
   end subroutine gather_longs

   !> Send rows to all ranks and receive rows from all ranks.
   subroutine all_to_all_longs(self, rows, counts, received, counts_received)
      class(mpi_communicator_t), intent(inout) :: self
      integer(lp), intent(in), contiguous :: rows(:, :)
      integer(ip), intent(in) :: counts(0:)
      integer(lp), allocatable, intent(out) :: received(:, :)
      integer(ip), allocatable, intent(out) :: counts_received(:)
      type(mpi_request) :: requests(2*self%size)
      integer :: n_out(0:self%size - 1_ip), n_in(0:self%size - 1_ip), from(0:self%size - 1_ip), to(0:self%size - 1_ip)
      integer :: k, n, width

      width = size(rows, 1)
      n_out = int(counts)
      call mpi_alltoall(n_out, 1, mpi_integer, n_in, 1, mpi_integer, self%handle)
      from = starts_of(n_in)
      to = starts_of(n_out)
      allocate (received(width, sum(n_in)), counts_received(0:self%size - 1_ip))
      counts_received = int(n_in, ip)
      n = 0
      do k = 0, int(self%size) - 1
         if (n_in(k) == 0 .or. k == self%rank) cycle
         n = n + 1
         call mpi_irecv(received(1, from(k) + 1), width*n_in(k), mpi_integer8, k, tag, self%handle, requests(n))
      end do
      do k = 0, int(self%size) - 1
         if (n_out(k) == 0 .or. k == self%rank) cycle
         n = n + 1
         call mpi_isend(rows(1, to(k) + 1), width*n_out(k), mpi_integer8, k, tag, self%handle, requests(n))
         self%messages = self%messages + 1_lp
         self%bytes = self%bytes + int(width, lp)*int(n_out(k), lp)*int(storage_size(rows)/8, lp)
      end do
      k = int(self%rank)
      received(:, from(k) + 1:from(k) + n_in(k)) = rows(:, to(k) + 1:to(k) + n_out(k))
      call mpi_waitall(n, requests, mpi_statuses_ignore)
   end subroutine all_to_all_longs

   !> Begin an exchange of rows with neighbour ranks.
   subroutine begin_exchange(self, route, sent, received)
      class(mpi_communicator_t), intent(inout) :: self
      type(neighbour_ranks_t), intent(in) :: route
      real(wp), intent(in), contiguous, target :: sent(:, :)
      real(wp), intent(inout), contiguous, target :: received(:, :)
      integer :: k, n, bytes, row_bytes

      n = 2*size(route%rank)
      if (allocated(self%requests)) then
         if (size(self%requests) /= n) deallocate (self%requests)
      end if
      if (.not. allocated(self%requests)) allocate (self%requests(n))
      self%requests = mpi_request_null
      row_bytes = size(sent, 1)*(storage_size(sent)/8)
      do k = 1, size(route%rank)
         bytes = row_bytes*int(route%received(k + 1) - route%received(k))
         if (bytes > 0) call mpi_irecv(received(1, route%received(k)), bytes, mpi_byte, int(route%rank(k)), tag, &
                                       self%handle, self%requests(2*k - 1))
      end do
      do k = 1, size(route%rank)
         bytes = row_bytes*int(route%sent(k + 1) - route%sent(k))
         if (bytes == 0) cycle
         call mpi_isend(sent(1, route%sent(k)), bytes, mpi_byte, int(route%rank(k)), tag, self%handle, &
                        self%requests(2*k))
         self%messages = self%messages + 1_lp
         self%bytes = self%bytes + int(bytes, lp)
      end do
   end subroutine begin_exchange

   !> Finish the exchange that was begun with the same buffers.
   subroutine finish_exchange(self, sent, received)
      class(mpi_communicator_t), intent(inout) :: self
      real(wp), intent(in), contiguous, target :: sent(:, :)
      real(wp), intent(inout), contiguous, target :: received(:, :)

      associate (unused_rows => sent, unused_values => received)
      end associate
      call mpi_waitall(size(self%requests), self%requests, mpi_statuses_ignore)
   end subroutine finish_exchange

   !> Receive numbers from rank - 1. Nothing happens on rank 0.
   subroutine receive_from_previous(self, values)
      class(mpi_communicator_t), intent(inout) :: self
      integer(lp), intent(inout), contiguous :: values(:)

      if (self%rank == 0_ip) return
      call mpi_recv(values, size(values), mpi_integer8, int(self%rank) - 1, tag, self%handle, mpi_status_ignore)
   end subroutine receive_from_previous

   !> Send numbers to rank + 1. Nothing happens on the last rank.
   subroutine send_to_next(self, values)
      class(mpi_communicator_t), intent(inout) :: self
      integer(lp), intent(inout), contiguous :: values(:)

      if (self%rank == self%size - 1_ip) return
      call mpi_send(values, size(values), mpi_integer8, int(self%rank) + 1, tag, self%handle)
   end subroutine send_to_next

   !> End MPI.
   subroutine finalize(self)
      class(mpi_communicator_t), intent(inout) :: self

      self%size = 1_ip
      call mpi_finalize()
   end subroutine finalize

   !> Start of each list, counted from 0, if lists of these lengths are stored one after the other
   pure function starts_of(lengths) result(starts)
      integer, intent(in) :: lengths(0:)
      integer :: starts(0:size(lengths) - 1)
      integer :: k

      starts = 0
      do k = 1, size(lengths) - 1
         starts(k) = starts(k - 1) + lengths(k - 1)
      end do
   end function starts_of

end module polydem_mpi_communicator
