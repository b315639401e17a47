!> What several processes tell each other, run by mpirun: ends with code 1 and a word about all that is wrong.
program team_checks
   use, intrinsic :: iso_fortran_env, only: error_unit
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_join_team, only: join_team
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_team, only: route_t, team_t
   implicit none
   class(team_t), allocatable :: team
   type(error_t), allocatable :: error
   logical :: good

   good = .true.
   call join_team(team, error)
   call check_sums()
   call check_rows()
   call check_routes()
   call check_relay()
   call check_errors()
   call team%leave()
   if (.not. good) error stop 1

contains

   subroutine expect(holds, what)
      logical, intent(in) :: holds
      character(len=*), intent(in) :: what

      if (holds) return
      good = .false.
      write (error_unit, '(a,i0,2a)') 'rank ', team%rank, ': ', what
   end subroutine expect

   subroutine check_sums()
      integer(lp) :: longs(2), n
      real(dp) :: doubles(2)
      real(dp), allocatable :: all_doubles(:)
      integer(ip), allocatable :: counts(:)
      character(len=:), allocatable :: text
      integer :: k

      n = int(team%size, lp)
      longs = [int(team%rank, lp), 1_lp]
      call team%add_up(longs)
      call expect(all(longs == [n*(n - 1_lp)/2_lp, n]), 'sums')
      longs = [int(team%rank, lp), -int(team%rank, lp)]
      call team%maximise(longs)
      call expect(all(longs == [n - 1_lp, 0_lp]), 'greatest whole numbers')
      doubles = [0.1_dp*real(team%rank, dp), -1.0_dp]
      call team%maximise(doubles)
      call expect(all(abs(doubles - [0.1_dp*real(n - 1_lp, dp), -1.0_dp]) <= 0.0_dp), 'greatest real numbers')
      doubles = real(team%rank, dp) + [0.1_dp, 0.2_dp]
      call team%share(doubles)
      call expect(all(abs(doubles - [0.1_dp, 0.2_dp]) <= 0.0_dp), 'numbers of the leader')
      text = repeat('x', int(team%rank) + 1)
      call team%share(text)
      call expect(text == 'x' .and. len(text) == 1, 'text of the leader')
      ! Rank r gives r numbers.
      call team%gather([(real(team%rank, dp) + real(k, dp)/16.0_dp, k=1, int(team%rank))], all_doubles, counts)
      call expect(size(all_doubles) == n*(n - 1_lp)/2_lp, 'number of numbers gathered')
      call expect(all(counts == [(int(k, ip), k=0, int(n) - 1)]), 'counts of numbers gathered')
      if (n > 2_lp) call expect(all(abs(all_doubles(2:3) - [2.0625_dp, 2.125_dp]) <= 0.0_dp), 'numbers gathered')
   end subroutine check_sums

   !> Rank r sends r + s rows to rank s.
   subroutine check_rows()
      integer(ip) :: counts(0:team%size - 1_ip)
      integer(ip), allocatable :: counts_received(:)
      real(wp), allocatable :: rows(:, :), received(:, :)
      integer :: k, r, n

      do r = 0, int(team%size) - 1
         counts(r) = team%rank + int(r, ip)
      end do
      allocate (rows(3, sum(counts)))
      n = 0
      do r = 0, int(team%size) - 1
         do k = 1, int(counts(r))
            n = n + 1
            rows(:, n) = [real(team%rank, wp), real(r, wp), real(k, wp)/3.0_wp]
         end do
      end do
      call team%trade(rows, counts, received, counts_received)
      call expect(all(counts_received == counts), 'numbers of rows')
      n = 0
      do r = 0, int(team%size) - 1
         do k = 1, int(counts(r))
            n = n + 1
            call expect(all(abs(received(:, n) - [real(r, wp), real(team%rank, wp), real(k, wp)/3.0_wp]) <= 0.0_wp), &
                        'rows')
         end do
      end do
   end subroutine check_rows

   !> Every rank passes one row to both neighbours on a ring, twice.
   subroutine check_routes()
      type(route_t) :: route
      real(wp), allocatable :: sent(:, :), received(:, :)
      integer(ip) :: k, below, above
      integer :: turn

      below = modulo(team%rank - 1_ip, team%size)
      above = modulo(team%rank + 1_ip, team%size)
      route%rank = [min(below, above), max(below, above)]
      if (below == above) route%rank = [below]
      if (team%size == 1_ip) route%rank = [integer(ip) ::]
      route%sent = [(k, k=1_ip, size(route%rank, kind=ip) + 1_ip)]
      route%received = route%sent
      allocate (sent(2, size(route%rank)), received(2, size(route%rank)))
      do turn = 1, 2
         sent(1, :) = real(team%rank, wp)
         sent(2, :) = real(turn, wp)
         call team%pass(route, sent, received)
         call expect(all(abs(received(1, :) - real(route%rank, wp)) <= 0.0_wp), 'who passed')
         call expect(all(abs(received(2, :) - real(turn, wp)) <= 0.0_wp), 'what was passed')
      end do
   end subroutine check_routes

   subroutine check_relay()
      integer(lp) :: baton(1)

      baton = 5_lp
      call team%take_over(baton)
      call expect(baton(1) == 5_lp + int(team%rank, lp), 'what was handed on')
      baton = baton + 1_lp
      call team%hand_on(baton)
   end subroutine check_relay

   !> The two highest ranks fail; all learn of the lower one. Then nobody fails, and the highest has something to say.
   subroutine check_errors()
      type(error_t), allocatable :: failure
      character(len=:), allocatable :: text
      integer(lp) :: flags(2)
      character(len=8) :: name

      if (team%rank >= team%size - 2_ip) then
         write (name, '(i0)') team%rank
         call raise(failure, io_error, 'rank '//trim(name)//' failed')
      end if
      flags = [0_lp, int(team%rank, lp)]
      call team%agree(failure, flags)
      write (name, '(i0)') max(0_ip, team%size - 2_ip)
      call expect(allocated(failure), 'a failure of others')
      if (allocated(failure)) call expect(failure%message == 'rank '//trim(name)//' failed', 'whose failure it is')
      if (allocated(failure)) call expect(failure%code == io_error, 'its code')
      call expect(all(flags == [0_lp, int(team%size, lp) - 1_lp]), 'flags')
      deallocate (failure)
      ! Now both say where: the highest rank has the least place.
      if (team%rank >= team%size - 2_ip) then
         write (name, '(i0)') team%rank
         call raise(failure, input_error, 'rank '//trim(name)//' failed')
         failure%place = int(team%size - team%rank, lp)
      end if
      call team%agree(failure)
      write (name, '(i0)') team%size - 1_ip
      if (allocated(failure)) call expect(failure%message == 'rank '//trim(name)//' failed', 'the least place')
      if (allocated(failure)) call expect(failure%code == input_error, 'its code')
      deallocate (failure)
      call team%agree(failure)
      call expect(.not. allocated(failure), 'no failure')
      text = name
      write (text, '(i0)') team%rank
      call team%spread_text(text, real(mod(team%rank, 2_ip), dp))
      call expect(text == merge('1', '0', team%size > 1_ip), 'the text of the greatest weight')
      deallocate (text)
      call team%spread_text(text, 1.0_dp)
      call expect(.not. allocated(text), 'no text, whatever its weight')
      call team%spread_text(text)
      call expect(.not. allocated(text), 'no text')
      if (team%rank == team%size - 1_ip) text = 'a word'
      call team%spread_text(text)
      call expect(allocated(text), 'a text')
      if (allocated(text)) call expect(text == 'a word', 'the text')
   end subroutine check_errors

end program team_checks
