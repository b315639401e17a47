!> Counts what ranks would tell each other in a step: mpirun -n RANKS count_exchange FILE.csv GRAINS...
!>
!> The counts are those of the program itself, for grains packed in a box and in a drum, for both cuts and several
!> margins (in long axes of a grain). They are exact on any machine, however many ranks share a processor.
program count_exchange
   use, intrinsic :: iso_fortran_env, only: error_unit
   use packed_grains, only: pack_share, shape_names
   use polydem_cover, only: cover
   use polydem_errors, only: error_t
   use polydem_join_team, only: join_team
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_partition, only: partition_t
   use polydem_partition_factory, only: new_partition, partition_names
   use polydem_regions, only: regions_t
   use polydem_team, only: team_t
   implicit none

   !> How far a body may move until regions are published anew [m]
   real(wp), parameter :: margins(5) = [0.1_wp, 0.2_wp, 0.5_wp, 1.0_wp, 2.0_wp]
   !> Bytes of a body that moves: place, angle, and how fast they change
   integer(lp), parameter :: bytes_per_ghost = 48_lp

   class(team_t), allocatable :: team
   type(error_t), allocatable :: error
   character(len=:), allocatable :: word
   integer :: unit, a, s, c
   integer(ip) :: n

   call join_team(team, error)
   if (command_argument_count() < 2) then
      if (team%leads()) write (error_unit, '(a)') 'usage: mpirun -n RANKS count_exchange FILE.csv GRAINS...'
      call team%leave()
      error stop 2
   end if
   if (team%leads()) then
      call get_word(1, word)
      open (newunit=unit, file=word, status='replace', action='write')
      write (unit, '(a)') 'shape,grains,ranks,cut,margin,grains_most,ghosts,ghosts_most,messages,messages_most,'// &
         'bytes,bytes_most,rectangles,imbalance,ghosts_per_grain,neighbours'
   end if
   do a = 2, command_argument_count()
      call get_word(a, word)
      read (word, *) n
      do s = 1, size(shape_names)
         do c = 1, size(partition_names)
            call count_cut(trim(shape_names(s)), n, trim(partition_names(c)))
         end do
      end do
   end do
   if (team%leads()) close (unit)
   call team%leave()

contains

   !> Count for one packing and one cut.
   subroutine count_cut(shape, n, cut)
      character(len=*), intent(in) :: shape, cut
      integer(ip), intent(in) :: n
      class(partition_t), allocatable :: partition
      real(wp), allocatable :: share(:, :), grains(:, :)
      real(dp), allocatable :: weight(:)
      integer :: m

      call new_partition(partition, cut, error)
      call pack_share(shape, n, team%rank, team%size, share)
      allocate (weight(size(share, 2)), source=1.0_dp)
      call partition%divide(team, share(1:2, :), weight)
      call send_home(partition, share, grains)
      do m = 1, size(margins)
         call count_margin(shape, cut, margins(m), grains)
      end do
   end subroutine count_cut

   !> Give all grains to their owners.
   subroutine send_home(partition, share, grains)
      class(partition_t), intent(in) :: partition
      real(wp), intent(in) :: share(:, :)
      real(wp), allocatable, intent(out) :: grains(:, :)
      real(wp) :: rows(4, size(share, 2))
      integer(ip) :: owner(size(share, 2)), counts(0:team%size - 1_ip), next(0:team%size - 1_ip), rank
      integer(ip), allocatable :: received(:)
      integer :: k

      counts = 0_ip
      do k = 1, size(owner)
         owner(k) = partition%owner_of(share(1:2, k))
         counts(owner(k)) = counts(owner(k)) + 1_ip
      end do
      next(0) = 0_ip
      do rank = 1_ip, team%size - 1_ip
         next(rank) = next(rank - 1_ip) + counts(rank - 1_ip)
      end do
      do k = 1, size(owner)
         next(owner(k)) = next(owner(k)) + 1_ip
         rows(:, next(owner(k))) = share(:, k)
      end do
      call team%trade(rows, counts, grains, received)
   end subroutine send_home

   !> Count for one margin, and let the leader write a row.
   subroutine count_margin(shape, cut, margin, grains)
      character(len=*), intent(in) :: shape, cut
      real(wp), intent(in) :: margin
      real(wp), intent(in) :: grains(:, :)
      type(regions_t) :: regions
      real(wp), allocatable :: rectangles(:, :)
      real(wp) :: boxes(4, size(grains, 2))
      integer(ip) :: ranks(team%size), n_ranks, k
      integer(lp) :: sent(0:team%size - 1_ip), received(0:team%size - 1_ip), sums(4), most(4)

      boxes(1:2, :) = grains(1:2, :) - grains(3:4, :) - margin
      boxes(3:4, :) = grains(1:2, :) + grains(3:4, :) + margin
      call regions%publish(team, boxes)
      sent = 0_lp
      do k = 1_ip, size(boxes, 2, kind=ip)
         call regions%needed_by(boxes(:, k), ranks, n_ranks)
         sent(ranks(1:n_ranks)) = sent(ranks(1:n_ranks)) + 1_lp
      end do
      received = sent
      call team%add_up(received)
      call cover(boxes, rectangles)
      sums = [size(boxes, 2, lp), sum(sent), count(sent > 0_lp, kind=lp), size(rectangles, 2, lp)]
      most = [sums(1), received(team%rank), sums(3), max(sums(2), received(team%rank))*bytes_per_ghost]
      call team%add_up(sums)
      call team%maximise(most)
      if (.not. team%leads()) return
      write (unit, '(a,2(",",i0),3a,f0.2,8(",",i0),3(",",f0.6))') shape, sums(1), team%size, ',', cut, ',', margin, &
         most(1), sums(2), most(2), sums(3), most(3), sums(2)*bytes_per_ghost, most(4), sums(4), &
         real(most(1)*team%size, dp)/real(sums(1), dp), real(sums(2), dp)/real(sums(1), dp), &
         real(sums(3), dp)/real(team%size, dp)
   end subroutine count_margin

   !> A word of the command line.
   subroutine get_word(k, word)
      integer, intent(in) :: k
      character(len=:), allocatable, intent(out) :: word
      integer :: length

      call get_command_argument(k, length=length)
      allocate (character(len=length) :: word)
      call get_command_argument(k, word)
   end subroutine get_word

end program count_exchange
