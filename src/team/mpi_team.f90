!> The ranks of an MPI run: the only module, besides that which joins them, that uses MPI.
!>
!> Buffers are contiguous and bytes are sent, so that one code serves every working precision. Open MPI neither copies
!> array sections nor knows the asynchronous attribute; so every non-blocking call is completed in the procedure that
!> began it.
module polydem_mpi_team
   use mpi_f08, only: mpi_allgather, mpi_allgatherv, mpi_allreduce, mpi_alltoall, mpi_bcast, mpi_byte, mpi_comm_world, &
      mpi_double_precision, mpi_finalize, mpi_in_place, mpi_integer, mpi_integer8, mpi_irecv, mpi_isend, mpi_max, &
      mpi_recv, mpi_request, mpi_send, mpi_statuses_ignore, mpi_status_ignore, mpi_sum, mpi_waitall
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_team, only: route_t, team_t
   implicit none
   private
   public :: mpi_team_t

   !> All ranks of MPI_COMM_WORLD
   type, extends(team_t) :: mpi_team_t
   contains
      procedure :: add_up
      procedure :: maximise_longs
      procedure :: maximise_doubles
      procedure :: share_longs
      procedure :: gather_longs
      procedure :: trade_longs
      procedure :: pass
      procedure :: take_over
      procedure :: hand_on
      procedure :: leave
   end type mpi_team_t

   !> Tags of messages, which need not be told apart: they are received in the order in which they were sent
   integer, parameter :: tag = 1

contains

   !> Replace numbers by their sums over all ranks.
   subroutine add_up(self, values)
      class(mpi_team_t), intent(inout) :: self
      !> Numbers of this rank; afterwards the same on all
      integer(lp), intent(inout), contiguous :: values(:)

      if (self%size == 1_ip) return
      call mpi_allreduce(mpi_in_place, values, size(values), mpi_integer8, mpi_sum, mpi_comm_world)
   end subroutine add_up

   !> Replace numbers by their greatest over all ranks.
   subroutine maximise_longs(self, values)
      class(mpi_team_t), intent(inout) :: self
      !> Numbers of this rank; afterwards the same on all
      integer(lp), intent(inout), contiguous :: values(:)

      if (self%size == 1_ip) return
      call mpi_allreduce(mpi_in_place, values, size(values), mpi_integer8, mpi_max, mpi_comm_world)
   end subroutine maximise_longs

   !> Replace numbers by their greatest over all ranks.
   subroutine maximise_doubles(self, values)
      class(mpi_team_t), intent(inout) :: self
      !> Numbers of this rank; afterwards the same on all
      real(dp), intent(inout), contiguous :: values(:)

      if (self%size == 1_ip) return
      call mpi_allreduce(mpi_in_place, values, size(values), mpi_double_precision, mpi_max, mpi_comm_world)
   end subroutine maximise_doubles

   !> Give all ranks the numbers of rank 0.
   subroutine share_longs(self, values)
      class(mpi_team_t), intent(inout) :: self
      !> Numbers of rank 0; afterwards the same on all
      integer(lp), intent(inout), contiguous :: values(:)

      if (self%size == 1_ip) return
      call mpi_bcast(values, size(values), mpi_integer8, 0, mpi_comm_world)
   end subroutine share_longs

   !> Give all ranks the lists of all.
   subroutine gather_longs(self, mine, all_of_them, counts)
      class(mpi_team_t), intent(inout) :: self
      !> List of this rank
      integer(lp), intent(in), contiguous :: mine(:)
      !> All lists, in the order of ranks
      integer(lp), allocatable, intent(out) :: all_of_them(:)
      !> Their lengths, (0:size - 1)
      integer(ip), allocatable, intent(out) :: counts(:)
      integer :: lengths(0:self%size - 1_ip), starts(0:self%size - 1_ip)

      call mpi_allgather(size(mine), 1, mpi_integer, lengths, 1, mpi_integer, mpi_comm_world)
      starts = starts_of(lengths)
      allocate (all_of_them(sum(lengths)), counts(0:self%size - 1_ip))
      counts = int(lengths, ip)
      call mpi_allgatherv(mine, size(mine), mpi_integer8, all_of_them, lengths, starts, mpi_integer8, mpi_comm_world)
   end subroutine gather_longs

   !> Give rows to other ranks, and get theirs.
   subroutine trade_longs(self, rows, counts, received, counts_received)
      class(mpi_team_t), intent(inout) :: self
      !> Rows in the order of the ranks they go to, (width, row)
      integer(lp), intent(in), contiguous :: rows(:, :)
      !> Rows for each rank, (0:size - 1)
      integer(ip), intent(in) :: counts(0:)
      !> Rows from all ranks in order, (width, row)
      integer(lp), allocatable, intent(out) :: received(:, :)
      !> Rows from each rank, (0:size - 1)
      integer(ip), allocatable, intent(out) :: counts_received(:)
      type(mpi_request) :: requests(2*self%size)
      integer :: given(0:self%size - 1_ip), taken(0:self%size - 1_ip), from(0:self%size - 1_ip), to(0:self%size - 1_ip)
      integer :: k, n, width

      width = size(rows, 1)
      given = int(counts)
      call mpi_alltoall(given, 1, mpi_integer, taken, 1, mpi_integer, mpi_comm_world)
      from = starts_of(taken)
      to = starts_of(given)
      allocate (received(width, sum(taken)), counts_received(0:self%size - 1_ip))
      counts_received = int(taken, ip)
      n = 0
      do k = 0, int(self%size) - 1
         if (taken(k) == 0 .or. k == self%rank) cycle
         n = n + 1
         call mpi_irecv(received(1, from(k) + 1), width*taken(k), mpi_integer8, k, tag, mpi_comm_world, requests(n))
      end do
      do k = 0, int(self%size) - 1
         if (given(k) == 0 .or. k == self%rank) cycle
         n = n + 1
         call mpi_isend(rows(1, to(k) + 1), width*given(k), mpi_integer8, k, tag, mpi_comm_world, requests(n))
         self%messages = self%messages + 1_lp
         self%bytes = self%bytes + int(width, lp)*int(given(k), lp)*int(storage_size(rows)/8, lp)
      end do
      k = int(self%rank)
      received(:, from(k) + 1:from(k) + taken(k)) = rows(:, to(k) + 1:to(k) + given(k))
      call mpi_waitall(n, requests, mpi_statuses_ignore)
   end subroutine trade_longs

   !> Pass rows along a route.
   subroutine pass(self, route, sent, received)
      class(mpi_team_t), intent(inout) :: self
      !> Whom to send to and to receive from
      type(route_t), intent(in) :: route
      !> Rows in the order of the route, (width, row)
      real(wp), intent(in), contiguous, target :: sent(:, :)
      !> Room for the rows from the others, (width, row)
      real(wp), intent(inout), contiguous, target :: received(:, :)
      type(mpi_request) :: requests(2*size(route%rank))
      integer :: k, n, bytes, row_bytes

      row_bytes = size(sent, 1)*(storage_size(sent)/8)
      n = 0
      do k = 1, size(route%rank)
         bytes = row_bytes*int(route%received(k + 1) - route%received(k))
         if (bytes == 0) cycle
         n = n + 1
         call mpi_irecv(received(1, route%received(k)), bytes, mpi_byte, int(route%rank(k)), tag, mpi_comm_world, &
                        requests(n))
      end do
      do k = 1, size(route%rank)
         bytes = row_bytes*int(route%sent(k + 1) - route%sent(k))
         if (bytes == 0) cycle
         n = n + 1
         call mpi_isend(sent(1, route%sent(k)), bytes, mpi_byte, int(route%rank(k)), tag, mpi_comm_world, requests(n))
         self%messages = self%messages + 1_lp
         self%bytes = self%bytes + int(bytes, lp)
      end do
      call mpi_waitall(n, requests, mpi_statuses_ignore)
   end subroutine pass

   !> Take numbers over from the rank below.
   subroutine take_over(self, values)
      class(mpi_team_t), intent(inout) :: self
      !> Numbers of the rank below; on rank 0 they stay as they are
      integer(lp), intent(inout), contiguous :: values(:)

      if (self%rank == 0_ip) return
      call mpi_recv(values, size(values), mpi_integer8, int(self%rank) - 1, tag, mpi_comm_world, mpi_status_ignore)
   end subroutine take_over

   !> Hand numbers on to the rank above.
   subroutine hand_on(self, values)
      class(mpi_team_t), intent(inout) :: self
      !> The numbers, which stay as they are
      integer(lp), intent(inout), contiguous :: values(:)

      if (self%rank == self%size - 1_ip) return
      call mpi_send(values, size(values), mpi_integer8, int(self%rank) + 1, tag, mpi_comm_world)
   end subroutine hand_on

   !> End MPI.
   subroutine leave(self)
      class(mpi_team_t), intent(inout) :: self

      self%size = 1_ip
      call mpi_finalize()
   end subroutine leave

   pure function starts_of(lengths) result(starts)
      integer, intent(in) :: lengths(0:)
      integer :: starts(0:size(lengths) - 1)
      integer :: k

      starts = 0
      do k = 1, size(lengths) - 1
         starts(k) = starts(k - 1) + lengths(k - 1)
      end do
   end function starts_of

end module polydem_mpi_team
