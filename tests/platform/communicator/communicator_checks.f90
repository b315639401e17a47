!> Tests of the MPI communicator, started by mpirun. The program prints each failed check and ends with code 1 if any
!> fails.
program communicator_checks
   use, intrinsic :: iso_fortran_env, only: error_unit
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_world_communicator, only: create_world
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_communicator, only: neighbour_ranks_t, communicator_t
   implicit none
   class(communicator_t), allocatable :: comm
   type(error_t), allocatable :: error
   logical :: good

   good = .true.
   call create_world(comm, error)
   call check_sums()
   call check_rows()
   call check_routes()
   call check_relay()
   call check_errors()
   call comm%finalize()
   if (.not. good) error stop 1

contains

   !> Print a failed check.
   subroutine expect(holds, what)
      logical, intent(in) :: holds
      character(len=*), intent(in) :: what

      if (holds) return
      good = .false.
      write (error_unit, '(a,i0,2a)') 'rank ', comm%rank, ': ', what
   end subroutine expect

   !> Reductions, broadcasts and gathers
   subroutine check_sums()
      integer(lp) :: longs(2), n
      real(dp) :: doubles(2)
      real(dp), allocatable :: all_doubles(:)
      integer(ip), allocatable :: counts(:)
      character(len=:), allocatable :: text
      integer :: k

      n = int(comm%size, lp)
      longs = [int(comm%rank, lp), 1_lp]
      call comm%all_reduce_sum(longs)
      call expect(all(longs == [n*(n - 1_lp)/2_lp, n]), 'sums')
      longs = [int(comm%rank, lp), -int(comm%rank, lp)]
      call comm%all_reduce_max(longs)
      call expect(all(longs == [n - 1_lp, 0_lp]), 'maxima of integers')
      doubles = [0.1_dp*real(comm%rank, dp), -1.0_dp]
      call comm%all_reduce_max(doubles)
      call expect(all(abs(doubles - [0.1_dp*real(n - 1_lp, dp), -1.0_dp]) <= 0.0_dp), 'maxima of real numbers')
      doubles = real(comm%rank, dp) + [0.1_dp, 0.2_dp]
      call comm%broadcast(doubles)
      call expect(all(abs(doubles - [0.1_dp, 0.2_dp]) <= 0.0_dp), 'broadcast of numbers')
      text = repeat('x', int(comm%rank) + 1)
      call comm%broadcast(text)
      call expect(text == 'x' .and. len(text) == 1, 'broadcast of a text')
      ! Rank r contributes r numbers.
      call comm%gather([(real(comm%rank, dp) + real(k, dp)/16.0_dp, k=1, int(comm%rank))], all_doubles, counts)
      call expect(size(all_doubles) == n*(n - 1_lp)/2_lp, 'total of gathered numbers')
      call expect(all(counts == [(int(k, ip), k=0, int(n) - 1)]), 'counts of gathered numbers')
      if (n > 2_lp) call expect(all(abs(all_doubles(2:3) - [2.0625_dp, 2.125_dp]) <= 0.0_dp), 'gathered numbers')
   end subroutine check_sums

   !> Rank r sends r + s rows to rank s.
   subroutine check_rows()
      integer(ip) :: counts(0:comm%size - 1_ip)
      integer(ip), allocatable :: counts_received(:)
      real(wp), allocatable :: rows(:, :), received(:, :)
      integer :: k, r, n

      do r = 0, int(comm%size) - 1
         counts(r) = comm%rank + int(r, ip)
      end do
      allocate (rows(3, sum(counts)))
      n = 0
      do r = 0, int(comm%size) - 1
         do k = 1, int(counts(r))
            n = n + 1
            rows(:, n) = [real(comm%rank, wp), real(r, wp), real(k, wp)/3.0_wp]
         end do
      end do
      call comm%all_to_all(rows, counts, received, counts_received)
      call expect(all(counts_received == counts), 'numbers of rows')
      n = 0
      do r = 0, int(comm%size) - 1
         do k = 1, int(counts(r))
            n = n + 1
            call expect(all(abs(received(:, n) - [real(r, wp), real(comm%rank, wp), real(k, wp)/3.0_wp]) <= 0.0_wp), &
                        'rows')
         end do
      end do
   end subroutine check_rows

   !> Every rank sends one row to both neighbours on a ring, twice.
   subroutine check_routes()
      type(neighbour_ranks_t) :: route
      real(wp), allocatable :: sent(:, :), received(:, :)
      integer(ip) :: k, below, above
      integer :: turn

      below = modulo(comm%rank - 1_ip, comm%size)
      above = modulo(comm%rank + 1_ip, comm%size)
      route%rank = [min(below, above), max(below, above)]
      if (below == above) route%rank = [below]
      if (comm%size == 1_ip) route%rank = [integer(ip) ::]
      route%sent = [(k, k=1_ip, size(route%rank, kind=ip) + 1_ip)]
      route%received = route%sent
      allocate (sent(2, size(route%rank)), received(2, size(route%rank)))
      do turn = 1, 2
         sent(1, :) = real(comm%rank, wp)
         sent(2, :) = real(turn, wp)
         call comm%exchange(route, sent, received)
         call expect(all(abs(received(1, :) - real(route%rank, wp)) <= 0.0_wp), 'source rank of an exchanged row')
         call expect(all(abs(received(2, :) - real(turn, wp)) <= 0.0_wp), 'contents of an exchanged row')
      end do
   end subroutine check_routes

   !> Each rank adds 1 to a number and sends it to the next rank.
   subroutine check_relay()
      integer(lp) :: baton(1)

      baton = 5_lp
      call comm%receive_from_previous(baton)
      call expect(baton(1) == 5_lp + int(comm%rank, lp), 'relayed number')
      baton = baton + 1_lp
      call comm%send_to_next(baton)
   end subroutine check_relay

   !> The two highest ranks fail, and all ranks get the error of the lower one. Then no rank fails, and the highest rank
   !> has a text.
   subroutine check_errors()
      type(error_t), allocatable :: failure
      character(len=:), allocatable :: text
      integer(lp) :: flags(2)
      character(len=8) :: name

      if (comm%rank >= comm%size - 2_ip) then
         write (name, '(i0)') comm%rank
         call raise(failure, io_error, 'rank '//trim(name)//' failed')
      end if
      flags = [0_lp, int(comm%rank, lp)]
      call comm%all_reduce_error(failure, flags)
      write (name, '(i0)') max(0_ip, comm%size - 2_ip)
      call expect(allocated(failure), 'an error of another rank')
      if (allocated(failure)) call expect(failure%message == 'rank '//trim(name)//' failed', 'rank of the error')
      if (allocated(failure)) call expect(failure%code == io_error, 'code of the error')
      call expect(all(flags == [0_lp, int(comm%size, lp) - 1_lp]), 'flags')
      deallocate (failure)
      ! Now both errors have a place: that of the highest rank is the smallest.
      if (comm%rank >= comm%size - 2_ip) then
         write (name, '(i0)') comm%rank
         call raise(failure, input_error, 'rank '//trim(name)//' failed')
         failure%place = int(comm%size - comm%rank, lp)
      end if
      call comm%all_reduce_error(failure)
      write (name, '(i0)') comm%size - 1_ip
      if (allocated(failure)) call expect(failure%message == 'rank '//trim(name)//' failed', 'the smallest place')
      if (allocated(failure)) call expect(failure%code == input_error, 'code of the error')
      deallocate (failure)
      call comm%all_reduce_error(failure)
      call expect(.not. allocated(failure), 'no error')
      text = name
      write (text, '(i0)') comm%rank
      call comm%all_reduce_text(text, real(mod(comm%rank, 2_ip), dp))
      call expect(text == merge('1', '0', comm%size > 1_ip), 'the text of the largest weight')
      deallocate (text)
      call comm%all_reduce_text(text, 1.0_dp)
      call expect(.not. allocated(text), 'no text with a weight')
      call comm%all_reduce_text(text)
      call expect(.not. allocated(text), 'no text')
      if (comm%rank == comm%size - 1_ip) text = 'a word'
      call comm%all_reduce_text(text)
      call expect(allocated(text), 'a text')
      if (allocated(text)) call expect(text == 'a word', 'the text')
   end subroutine check_errors

end program communicator_checks
