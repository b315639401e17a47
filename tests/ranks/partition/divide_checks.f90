!> Check the partition of space and rank bounds on all ranks of an MPI run. The exit status is 1 if a check fails.
!>
!> All ranks make the same bodies from the same random numbers. Each rank can therefore check its own results.
program divide_checks
   use, intrinsic :: iso_fortran_env, only: error_unit
   use polydem_errors, only: error_t
   use polydem_world_communicator, only: create_world
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_partition, only: partition_t
   use polydem_random, only: new_random, random_t
   use polydem_rank_bounds, only: rank_bounds_t
   use polydem_communicator, only: communicator_t
   use posed_communicator, only: divided, owners_of, shares, strew
   implicit none
   class(communicator_t), allocatable :: comm
   type(error_t), allocatable :: error
   integer(lp) :: broken(1)

   call create_world(comm, error)
   broken = 0_lp
   call check_cloud(0_ip)
   call check_cloud(1_ip)
   call check_cloud(3000_ip)
   call comm%all_reduce_sum(broken)
   call comm%finalize()
   if (broken(1) > 0_lp) error stop 1

contains

   !> Check the partition of a cloud of bodies for several distributions of the bodies over the ranks.
   subroutine check_cloud(n)
      integer(ip), intent(in) :: n
      type(partition_t) :: expected
      real(wp) :: position(2, n), boxes(4, n)
      real(dp) :: weight(n), share(0:comm%size - 1_ip)
      integer(ip) :: owner(n)
      integer :: k

      call strew(n + 5_ip, 2.0_wp, 3.0_wp, position, weight)
      call divided(expected, comm%size, position, weight)
      owner = owners_of(expected, position)
      share = shares(expected, comm%size, position, weight)
      if (n > 0_ip) call demand(maxval(abs(share - sum(share)/comm%size)) <= maxval(weight), 'balance')
      call check_division('dealt out', position, weight, [(modulo(k, int(comm%size)), k=1, int(n))], owner)
      call check_division('in blocks', position, weight, [((k - 1)/(n/comm%size + 1), k=1, int(n))], owner)
      call check_division('all on the last rank', position, weight, [(int(comm%size) - 1, k=1, int(n))], owner)
      call check_division('where they belong', position, weight, int(owner), owner)
      call grow_boxes(position, boxes)
      call check_regions(boxes, owner)
   end subroutine check_cloud

   !> Check that the partition is that of a single rank with all bodies.
   subroutine check_division(what, position, weight, before, owner)
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: position(:, :)
      real(dp), intent(in) :: weight(:)
      !> Rank of each body before
      integer, intent(in) :: before(:)
      !> Expected owner of each body
      integer(ip), intent(in) :: owner(:)
      type(partition_t) :: partition
      integer, allocatable :: mine(:)
      integer :: k

      mine = pack([(k, k=1, size(before))], before == int(comm%rank))
      call partition%divide(comm, position(:, mine), weight(mine))
      call demand(all(owners_of(partition, position) == owner), what)
   end subroutine check_division

   !> Boxes of many sizes around the bodies.
   subroutine grow_boxes(position, boxes)
      real(wp), intent(in) :: position(:, :)
      real(wp), intent(out) :: boxes(:, :)
      type(random_t) :: random
      real(wp) :: half(2)
      integer :: k

      random = new_random(9_ip)
      do k = 1, size(boxes, 2)
         half = 0.01_wp*random%uniform()**(-0.5_wp)*[random%uniform(), random%uniform()]
         boxes(:, k) = [position(:, k) - half, position(:, k) + half]
      end do
   end subroutine grow_boxes

   !> Check that the owners of overlapping boxes need each other's bodies.
   subroutine check_regions(boxes, owner)
      real(wp), intent(in) :: boxes(:, :)
      integer(ip), intent(in) :: owner(:)
      type(rank_bounds_t) :: rank_bounds
      integer(ip) :: ranks(comm%size), n
      logical :: needed(0:comm%size - 1_ip)
      integer, allocatable :: mine(:)
      integer :: j, k

      mine = pack([(j, j=1, size(owner))], owner == comm%rank)
      call rank_bounds%publish(comm, boxes(:, mine))
      do j = 1, size(mine)
         call rank_bounds%needed_by(boxes(:, mine(j)), ranks, n)
         needed = .false.
         needed(ranks(1:n)) = .true.
         call demand(count(needed, kind=ip) == n .and. .not. needed(comm%rank), 'list of ranks')
         do k = 1, size(owner)
            if (owner(k) /= comm%rank .and. overlap(boxes(:, k), boxes(:, mine(j)))) &
               call demand(needed(owner(k)), 'body not sent to where it is needed')
         end do
      end do
   end subroutine check_regions

   !> Whether two boxes share a point
   pure logical function overlap(a, b)
      real(wp), intent(in) :: a(4), b(4)

      overlap = all(a(1:2) <= b(3:4)) .and. all(b(1:2) <= a(3:4))
   end function overlap

   !> Count and report a failed check.
   subroutine demand(kept, promise)
      logical, intent(in) :: kept
      character(len=*), intent(in) :: promise

      if (kept) return
      broken = broken + 1_lp
      if (broken(1) <= 10_lp) write (error_unit, '(a,i0,2a)') 'rank ', comm%rank, ': ', promise
   end subroutine demand

end program divide_checks
