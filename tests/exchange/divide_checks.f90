!> What divisions and regions promise, checked by all ranks of an MPI run; ends with code 1 if a promise is broken.
!>
!> All ranks make the same bodies from the same random numbers, so each can check by itself what it should be told.
program divide_checks
   use, intrinsic :: iso_fortran_env, only: error_unit
   use polydem_errors, only: error_t
   use polydem_join_team, only: join_team
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_partition, only: partition_t
   use polydem_partition_factory, only: new_partition, partition_names
   use polydem_random, only: new_random, random_t
   use polydem_regions, only: regions_t
   use polydem_team, only: team_t
   use posed_team, only: divided, owners_of, shares, strew
   implicit none
   class(team_t), allocatable :: team
   type(error_t), allocatable :: error
   integer(lp) :: broken(1)
   integer :: c

   call join_team(team, error)
   broken = 0_lp
   do c = 1, size(partition_names)
      call check_cloud(trim(partition_names(c)), 0_ip)
      call check_cloud(trim(partition_names(c)), 1_ip)
      call check_cloud(trim(partition_names(c)), 3000_ip)
   end do
   call team%add_up(broken)
   call team%leave()
   if (broken(1) > 0_lp) error stop 1

contains

   !> Divide a cloud of bodies that are first here, then there.
   subroutine check_cloud(name, n)
      character(len=*), intent(in) :: name
      integer(ip), intent(in) :: n
      class(partition_t), allocatable :: expected
      real(wp) :: position(2, n), boxes(4, n)
      real(dp) :: weight(n), share(0:team%size - 1_ip)
      integer(ip) :: owner(n)
      integer :: k

      call strew(n + 5_ip, 2.0_wp, 3.0_wp, position, weight)
      call divided(expected, name, team%size, position, weight)
      owner = owners_of(expected, position)
      share = shares(expected, team%size, position, weight)
      if (n > 0_ip) call demand(maxval(abs(share - sum(share)/team%size)) <= maxval(weight), name//': balance')
      call check_division(name//': dealt out', position, weight, [(modulo(k, int(team%size)), k=1, int(n))], owner)
      call check_division(name//': in blocks', position, weight, [((k - 1)/(n/team%size + 1), k=1, int(n))], owner)
      call check_division(name//': all on the last rank', position, weight, [(int(team%size) - 1, k=1, int(n))], owner)
      call check_division(name//': where they belong', position, weight, int(owner), owner)
      call grow_boxes(position, boxes)
      call check_regions(name, boxes, owner)
   end subroutine check_cloud

   !> The division must be that of a process that has all bodies.
   subroutine check_division(what, position, weight, before, owner)
      character(len=*), intent(in) :: what
      real(wp), intent(in) :: position(:, :)
      real(dp), intent(in) :: weight(:)
      !> Ranks that have the bodies
      integer, intent(in) :: before(:)
      !> Ranks that must get them
      integer(ip), intent(in) :: owner(:)
      class(partition_t), allocatable :: partition
      integer, allocatable :: mine(:)
      integer :: k

      call new_partition(partition, what(1:index(what, ':') - 1), error)
      call demand(.not. allocated(error), what)
      mine = pack([(k, k=1, size(before))], before == int(team%rank))
      call partition%divide(team, position(:, mine), weight(mine))
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

   !> Own bodies must be needed by all owners of bodies whose boxes theirs overlaps.
   subroutine check_regions(name, boxes, owner)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: boxes(:, :)
      integer(ip), intent(in) :: owner(:)
      type(regions_t) :: regions
      integer(ip) :: ranks(team%size), n
      logical :: needed(0:team%size - 1_ip)
      integer, allocatable :: mine(:)
      integer :: j, k

      mine = pack([(j, j=1, size(owner))], owner == team%rank)
      call regions%publish(team, boxes(:, mine))
      do j = 1, size(mine)
         call regions%needed_by(boxes(:, mine(j)), ranks, n)
         needed = .false.
         needed(ranks(1:n)) = .true.
         call demand(count(needed, kind=ip) == n .and. .not. needed(team%rank), name//': list of ranks')
         do k = 1, size(owner)
            if (owner(k) /= team%rank .and. overlap(boxes(:, k), boxes(:, mine(j)))) &
               call demand(needed(owner(k)), name//': body not sent to where it is needed')
         end do
      end do
   end subroutine check_regions

   pure logical function overlap(a, b)
      real(wp), intent(in) :: a(4), b(4)

      overlap = all(a(1:2) <= b(3:4)) .and. all(b(1:2) <= a(3:4))
   end function overlap

   !> Note and tell a broken promise.
   subroutine demand(kept, promise)
      logical, intent(in) :: kept
      character(len=*), intent(in) :: promise

      if (kept) return
      broken = broken + 1_lp
      if (broken(1) <= 10_lp) write (error_unit, '(a,i0,2a)') 'rank ', team%rank, ': ', promise
   end subroutine demand

end program divide_checks
