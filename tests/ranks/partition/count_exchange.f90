!> Count the halo exchange of one step: mpirun -n RANKS count_exchange FILE.csv GRAINS...
!>
!> The counts come from the code of the program, for grains packed in a box and in a drum, and for several
!> margins (in long axes of a grain). They are exact on any machine, even if many ranks share a processor.
program count_exchange
   use, intrinsic :: iso_fortran_env, only: error_unit
   use packed_grains, only: pack_share, shape_names
   use polydem_bounding_rectangles, only: cover
   use polydem_errors, only: error_t
   use polydem_world_communicator, only: create_world
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_partition, only: partition_t
   use polydem_rank_bounds, only: rank_bounds_t
   use polydem_communicator, only: communicator_t
   implicit none

   !> Distances that a body may move before the next redistribution [m]
   real(wp), parameter :: margins(5) = [0.1_wp, 0.2_wp, 0.5_wp, 1.0_wp, 2.0_wp]
   !> Bytes of a halo body in a step: position, angle and velocities
   integer(lp), parameter :: bytes_per_halo_body = 48_lp

   class(communicator_t), allocatable :: comm
   type(error_t), allocatable :: error
   character(len=:), allocatable :: word
   integer :: unit, a, s
   integer(ip) :: n

   call create_world(comm, error)
   if (command_argument_count() < 2) then
      if (comm%is_root()) write (error_unit, '(a)') 'usage: mpirun -n RANKS count_exchange FILE.csv GRAINS...'
      call comm%finalize()
      error stop 2
   end if
   if (comm%is_root()) then
      call get_word(1, word)
      open (newunit=unit, file=word, status='replace', action='write')
      write (unit, '(a)') 'shape,grains,ranks,margin,grains_most,halo_bodies,halo_bodies_most,messages,'// &
         'messages_most,bytes,bytes_most,rectangles,imbalance,halo_bodies_per_grain,neighbours'
   end if
   do a = 2, command_argument_count()
      call get_word(a, word)
      read (word, *) n
      do s = 1, size(shape_names)
         call count_shape(trim(shape_names(s)), n)
      end do
   end do
   if (comm%is_root()) close (unit)
   call comm%finalize()

contains

   !> Count for one packing.
   subroutine count_shape(shape, n)
      character(len=*), intent(in) :: shape
      integer(ip), intent(in) :: n
      type(partition_t) :: partition
      real(wp), allocatable :: share(:, :), grains(:, :)
      real(dp), allocatable :: weight(:)
      integer :: m

      call pack_share(shape, n, comm%rank, comm%size, share)
      allocate (weight(size(share, 2)), source=1.0_dp)
      call partition%divide(comm, share(1:2, :), weight)
      call send_to_owners(partition, share, grains)
      do m = 1, size(margins)
         call count_margin(shape, margins(m), grains)
      end do
   end subroutine count_shape

   !> Send all grains to their owners.
   subroutine send_to_owners(partition, share, grains)
      type(partition_t), intent(in) :: partition
      real(wp), intent(in) :: share(:, :)
      real(wp), allocatable, intent(out) :: grains(:, :)
      real(wp) :: rows(4, size(share, 2))
      integer(ip) :: owner(size(share, 2)), counts(0:comm%size - 1_ip), next(0:comm%size - 1_ip), rank
      integer(ip), allocatable :: received(:)
      integer :: k

      counts = 0_ip
      do k = 1, size(owner)
         owner(k) = partition%owner_of(share(1:2, k))
         counts(owner(k)) = counts(owner(k)) + 1_ip
      end do
      next(0) = 0_ip
      do rank = 1_ip, comm%size - 1_ip
         next(rank) = next(rank - 1_ip) + counts(rank - 1_ip)
      end do
      do k = 1, size(owner)
         next(owner(k)) = next(owner(k)) + 1_ip
         rows(:, next(owner(k))) = share(:, k)
      end do
      call comm%all_to_all(rows, counts, grains, received)
   end subroutine send_to_owners

   !> Count for one margin; the root rank writes a row.
   subroutine count_margin(shape, margin, grains)
      character(len=*), intent(in) :: shape
      real(wp), intent(in) :: margin
      real(wp), intent(in) :: grains(:, :)
      type(rank_bounds_t) :: rank_bounds
      real(wp), allocatable :: rectangles(:, :)
      real(wp) :: boxes(4, size(grains, 2))
      integer(ip) :: ranks(comm%size), n_ranks, k
      integer(lp) :: sent(0:comm%size - 1_ip), received(0:comm%size - 1_ip), sums(4), most(4)

      boxes(1:2, :) = grains(1:2, :) - grains(3:4, :) - margin
      boxes(3:4, :) = grains(1:2, :) + grains(3:4, :) + margin
      call rank_bounds%publish(comm, boxes)
      sent = 0_lp
      do k = 1_ip, size(boxes, 2, kind=ip)
         call rank_bounds%needed_by(boxes(:, k), ranks, n_ranks)
         sent(ranks(1:n_ranks)) = sent(ranks(1:n_ranks)) + 1_lp
      end do
      received = sent
      call comm%all_reduce_sum(received)
      call cover(boxes, rectangles)
      sums = [size(boxes, 2, lp), sum(sent), count(sent > 0_lp, kind=lp), size(rectangles, 2, lp)]
      most = [sums(1), received(comm%rank), sums(3), max(sums(2), received(comm%rank))*bytes_per_halo_body]
      call comm%all_reduce_sum(sums)
      call comm%all_reduce_max(most)
      if (.not. comm%is_root()) return
      write (unit, '(a,2(",",i0),",",f0.2,8(",",i0),3(",",f0.6))') shape, sums(1), comm%size, margin, &
         most(1), sums(2), most(2), sums(3), most(3), sums(2)*bytes_per_halo_body, most(4), sums(4), &
         real(most(1)*comm%size, dp)/real(sums(1), dp), real(sums(2), dp)/real(sums(1), dp), &
         real(sums(3), dp)/real(comm%size, dp)
   end subroutine count_margin

   !> An argument of the command line
   subroutine get_word(k, word)
      integer, intent(in) :: k
      character(len=:), allocatable, intent(out) :: word
      integer :: length

      call get_command_argument(k, length=length)
      allocate (character(len=length) :: word)
      call get_command_argument(k, word)
   end subroutine get_word

end program count_exchange
