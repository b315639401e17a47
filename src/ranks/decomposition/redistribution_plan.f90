!> Plan of a redistribution of bodies: load balance of the ranks, partition of space, owner of each body, and the ranks
!> that need a copy of it in their halos.
module polydem_redistribution_plan
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_domain, only: domain_t
   use polydem_grow, only: grow
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_rank_order, only: sort_by_rank
   implicit none
   private
   public :: needs_repartition, divide, work_of_bodies, owners_of, padded_boxes, list_needed

   !> Number of steps after a partition before work is compared again
   integer(lp), parameter :: patience = 100_lp
   !> Work of a body without pairs, in pairs
   real(dp), parameter :: base_weight = 2.0_dp
   !> Allowance for rounding around a body, as a fraction of its extent
   real(wp), parameter :: rounding = 1024.0_wp*epsilon(1.0_wp)

contains

   !> Whether a new partition of space is necessary: in the first step, and when the work of the ranks is uneven.
   !> Collective.
   logical function needs_repartition(domain, comm, step, weight, seconds)
      type(domain_t), intent(in) :: domain
      class(communicator_t), intent(inout) :: comm
      !> Number of completed steps
      integer(lp), intent(in) :: step
      !> Work of each free body, in pairs
      real(dp), intent(in) :: weight(:)
      !> Computing time of this rank so far [s]
      real(dp), intent(in) :: seconds
      integer(lp) :: greatest(1), total(1)

      needs_repartition = domain%partition_step < 0_lp
      if (needs_repartition .or. domain%settings%balance == 'off') return
      if (step - domain%partition_step < patience) return
      if (domain%settings%balance == 'counted') then
         total = nint(sum(weight), lp)
      else
         total = nint(1.0e9_dp*(seconds - domain%partition_seconds), lp)
      end if
      greatest = total
      call comm%all_reduce_max(greatest)
      call comm%all_reduce_sum(total)
      needs_repartition = real(greatest(1), dp)*real(comm%size, dp) > real(domain%settings%imbalance, &
         dp)*real(total(1), dp)
   end function needs_repartition

   !> Compute a new partition of space with an even distribution of work. Collective.
   subroutine divide(domain, comm, step, bodies, weight, seconds)
      type(domain_t), intent(inout) :: domain
      class(communicator_t), intent(inout) :: comm
      !> Number of completed steps
      integer(lp), intent(in) :: step
      type(bodies_t), intent(in) :: bodies
      !> Work of each free body, in pairs
      real(dp), intent(in) :: weight(:)
      !> Computing time of this rank so far [s]
      real(dp), intent(in) :: seconds
      real(dp), allocatable :: measured(:)

      measured = weight
      if (domain%settings%balance == 'measured' .and. domain%partition_step >= 0_lp .and. size(weight) > 0) &
         measured = weight*((seconds - domain%partition_seconds)/sum(weight))
      call domain%partition%divide(comm, bodies%position(:, bodies%free), measured)
      domain%partition_step = step
      domain%partition_seconds = seconds
      domain%divisions = domain%divisions + 1_lp
   end subroutine divide

   !> Work of each free body, in pairs
   pure function work_of_bodies(bodies, n_pairs, first, second) result(weight)
      type(bodies_t), intent(in) :: bodies
      !> Number of pairs
      integer(ip), intent(in) :: n_pairs
      !> Pieces of each pair
      integer(ip), intent(in) :: first(:), second(:)
      real(dp), allocatable :: weight(:), of_slot(:)
      integer(ip) :: p

      allocate (of_slot(bodies%n))
      of_slot = base_weight
      do p = 1_ip, n_pairs
         associate (i => bodies%pieces%body_of(first(p)), j => bodies%pieces%body_of(second(p)))
            of_slot(i) = of_slot(i) + 1.0_dp
            of_slot(j) = of_slot(j) + 1.0_dp
         end associate
      end do
      weight = of_slot(bodies%free)
   end function work_of_bodies

   !> Rank that owns each body after the redistribution, negative for fixed bodies, (slot)
   function owners_of(domain, bodies) result(owner)
      type(domain_t), intent(in) :: domain
      type(bodies_t), intent(in) :: bodies
      integer(ip), allocatable :: owner(:)
      integer(ip) :: s

      allocate (owner(bodies%n))
      owner = -1_ip
      do s = 1_ip, bodies%n
         if (.not. bodies%fixed(s)) owner(s) = domain%partition%owner_of(bodies%position(:, s))
      end do
   end function owners_of

   !> Boxes of bodies, padded by a margin and an allowance for rounding: xmin, ymin, xmax, ymax, (4, body) [m]
   pure function padded_boxes(bodies, slots, margin) result(boxes)
      !> Bodies; `turned` of these is up to date
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Distance that bodies may move before the next redistribution, and the margin of boxes [m]
      real(wp), intent(in) :: margin
      real(wp), allocatable :: boxes(:, :)
      real(wp) :: low(2), high(2), room
      integer(ip) :: k, s, v

      allocate (boxes(4, size(slots)))
      do k = 1_ip, size(slots, kind=ip)
         s = slots(k)
         low = bodies%pieces%turned(:, bodies%pieces%vertex_start(s))
         high = low
         do v = bodies%pieces%vertex_start(s) + 1_ip, bodies%pieces%vertex_start(s + 1_ip) - 1_ip
            low = min(low, bodies%pieces%turned(:, v))
            high = max(high, bodies%pieces%turned(:, v))
         end do
         room = margin + rounding*(sum(high - low) + abs(bodies%position(1, s)) + abs(bodies%position(2, s)))
         boxes(1:2, k) = bodies%position(:, s) + (low - room)
         boxes(3:4, k) = bodies%position(:, s) + (high + room)
      end do
   end function padded_boxes

   !> List the bodies that other ranks need, in the order of these ranks.
   subroutine list_needed(domain, comm, boxes, needed, counts)
      type(domain_t), intent(in) :: domain
      class(communicator_t), intent(in) :: comm
      !> Padded boxes of the bodies of this rank, (4, body) [m]
      real(wp), intent(in) :: boxes(:, :)
      !> Indices of the bodies to send
      integer(ip), allocatable, intent(out) :: needed(:)
      !> Number of bodies for each rank
      integer(ip), allocatable, intent(out) :: counts(:)
      integer(ip), allocatable :: to_rank(:), order(:)
      integer(ip) :: needing(comm%size), k, m, n

      allocate (needed(64), to_rank(64))
      n = 0_ip
      do k = 1_ip, size(boxes, 2, kind=ip)
         call domain%rank_bounds%needed_by(boxes(:, k), needing, m)
         if (n + m > size(needed)) then
            call grow(needed, n, 2_ip*(n + m))
            call grow(to_rank, n, 2_ip*(n + m))
         end if
         needed(n + 1_ip:n + m) = k
         to_rank(n + 1_ip:n + m) = needing(:m)
         n = n + m
      end do
      call sort_by_rank(to_rank(:n), comm%size, counts, order)
      needed = needed(order)
   end subroutine list_needed

end module polydem_redistribution_plan
