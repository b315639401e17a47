!> Fills a block with the next contacts of the pair list: overlapping polygons with overlap area, its rate of change,
!> contact point and direction.
!>
!> Most pairs are like those of the last step: an edge still separates the polygons, or their outlines cross at the same
!> edges. The contact history remembers either. Contacts of the second kind are evaluated together, as a batch. All
!> other pairs are searched one by one. The result is the same, whatever is remembered.
!>
!> A contact is *degenerate* if it has no direction: |N| is negligible against the square root of the area, because one
!> body is inside the other, or bars cross. A degenerate contact gets the direction of the line of centres (or of the x
!> axis if the centres coincide) and the side of a square of the same area as its length. With this length no force or
!> stiffness overflows, and the run can continue or stop with a message. `normal`, `moment` and `rate` are not changed.
!> A contact of a batch is never degenerate.
module polydem_fill_block
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t, copy_motion
   use polydem_contact_history, only: contact_history_t
   use polydem_convex_overlap, only: find_overlap, overlap_t
   use polydem_evaluate_batch, only: evaluate_batch
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: add_lane, copy_lane, overlap_batch_t
   use polydem_overlap_tolerances, only: no_length
   use polydem_separation, only: test_separation
   implicit none
   private
   public :: fill_block

contains

   !> Fill a block with contacts of pairs in descending order.
   subroutine fill_block(bodies, first, second, effective, isa, low, next, history, block)
      !> Bodies with rotated polygons
      type(bodies_t), intent(in) :: bodies
      !> Lower and higher slot of each pair
      integer(ip), intent(in), contiguous :: first(:), second(:)
      !> Whether to compute the effective area
      logical, intent(in) :: effective
      !> Instruction set of the kernels
      integer, intent(in) :: isa
      !> Last pair to examine
      integer(ip), intent(in) :: low
      !> First pair to examine, at least `low`; afterwards the next one, less than `low` if there is none
      integer(ip), intent(inout) :: next
      !> Contact history of the pairs: `memory` is updated, and the other columns are cleared for pairs whose polygons
      !> do not overlap; any column may be absent
      type(contact_history_t), intent(inout) :: history
      !> Contacts; the columns that the force law fills are not changed
      type(contact_block_t), intent(inout) :: block
      type(overlap_batch_t) :: batch
      logical :: in_batch(block_size), exists(block_size)
      integer(ip) :: c

      call collect_pairs(bodies, first, second, low, next, history, block, batch, in_batch)
      call evaluate(bodies, effective, isa, block%n, in_batch, batch)
      call copy_batch(batch, block)
      do c = 1_ip, block%n
         exists(c) = in_batch(c)
         if (in_batch(c)) exists(c) = batch%certified(c) > 0.0_wp
         if (.not. exists(c)) call search(bodies, effective, c, history, block, exists(c))
      end do
      if (.not. all(exists(:block%n))) call remove_others(exists, block)
      call copy_motion(bodies, block)
      call find_rates(block)
      call find_directions(bodies, block)
   end subroutine fill_block

   !> Collect the next pairs that may be contacts: those that no remembered edge separates.
   subroutine collect_pairs(bodies, first, second, low, next, history, block, batch, in_batch)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in), contiguous :: first(:), second(:)
      integer(ip), intent(in) :: low
      integer(ip), intent(inout) :: next
      type(contact_history_t), intent(inout) :: history
      type(contact_block_t), intent(inout) :: block
      type(overlap_batch_t), intent(inout) :: batch
      !> Whether the pair has a lane in the batch
      logical, intent(inout) :: in_batch(block_size)
      integer(ip) :: exchange, i, j, n, p
      logical :: apart, remembers

      remembers = allocated(history%memory)
      n = 0_ip
      associate (start => bodies%vertex_start, turned => bodies%turned, radius => bodies%radius)
         do p = next, low, -1_ip
            if (n == block_size) exit
            i = first(p)
            j = second(p)
            ! The roles of `is_exchanged`, without a branch: which radius is greater, a processor cannot predict.
            exchange = iand(ieor(i, j), -merge(1_ip, 0_ip, radius(j) < radius(i)))
            i = ieor(i, exchange)
            j = ieor(j, exchange)
            if (remembers) then
               if (history%memory(p) < 0_ip) then
                  call test_separation(turned(:, start(i):start(i + 1_ip) - 1_ip), &
                                       turned(:, start(j):start(j + 1_ip) - 1_ip), offset_of(bodies, i, j), radius(i), &
                                       history%memory(p), apart)
                  if (apart) cycle
               end if
            end if
            n = n + 1_ip
            block%pair(n) = p
            block%first(n) = i
            block%second(n) = j
            in_batch(n) = .false.
            if (.not. remembers) cycle
            call add_lane(batch, n, history%memory(p), &
                          [start(i), start(i + 1_ip) - 1_ip, start(j), start(j + 1_ip) - 1_ip], &
                          offset_of(bodies, i, j), radius(i), radius(j), in_batch(n))
         end do
      end associate
      next = p
      block%n = n
   end subroutine collect_pairs

   !> Centre of the second body minus centre of the first [m]
   pure function offset_of(bodies, i, j) result(offset)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: i, j
      real(wp) :: offset(2)

      offset(1) = bodies%position(1, j) - bodies%position(1, i)
      offset(2) = bodies%position(2, j) - bodies%position(2, i)
   end function offset_of

   !> Evaluate the batch. Lanes without a pair get copies of another, so that there is no gap.
   pure subroutine evaluate(bodies, effective, isa, n, in_batch, batch)
      type(bodies_t), intent(in) :: bodies
      logical, intent(in) :: effective
      integer, intent(in) :: isa
      integer(ip), intent(in) :: n
      logical, intent(in) :: in_batch(block_size)
      type(overlap_batch_t), intent(inout) :: batch
      integer(ip) :: c, filled

      filled = findloc(in_batch(:n), .true., dim=1)
      if (filled == 0_ip) return
      do c = 1_ip, n
         if (.not. in_batch(c)) call copy_lane(batch, filled, c)
      end do
      call evaluate_batch(batch, n, bodies%turned, effective, isa)
   end subroutine evaluate

   !> Copy the results of the batch to the block.
   pure subroutine copy_batch(batch, block)
      type(overlap_batch_t), intent(in) :: batch
      type(contact_block_t), intent(inout) :: block

      associate (n => block%n)
         block%area(:n) = batch%area(:n)
         block%normal(:n, :) = batch%normal(:n, :)
         block%length(:n) = batch%length(:n)
         block%moment(:n, :) = batch%moment(:n, :)
         block%arm_first(:n, :) = batch%centroid(:n, 1:2)
         block%arm_second(:n, :) = batch%centroid(:n, 3:4)
         block%degenerate(:n) = 0.0_wp
      end associate
   end subroutine copy_batch

   !> Search the overlap of one pair without memory.
   subroutine search(bodies, effective, c, history, block, exists)
      type(bodies_t), intent(in) :: bodies
      logical, intent(in) :: effective
      !> Index in the block
      integer(ip), intent(in) :: c
      type(contact_history_t), intent(inout) :: history
      type(contact_block_t), intent(inout) :: block
      !> Whether the polygons overlap
      logical, intent(out) :: exists
      type(overlap_t) :: overlap
      integer(ip) :: memory
      integer :: k

      associate (start => bodies%vertex_start, turned => bodies%turned, radius => bodies%radius, i => block%first(c), &
                 j => block%second(c), p => block%pair(c))
         call find_overlap(turned(:, start(i):start(i + 1_ip) - 1_ip), turned(:, start(j):start(j + 1_ip) - 1_ip), &
                           offset_of(bodies, i, j), radius(i), radius(j), effective, overlap, memory)
         if (allocated(history%memory)) history%memory(p) = memory
         exists = overlap%area > 0.0_wp
         if (.not. exists) then
            if (.not. allocated(history%column)) return
            do k = 1, size(history%column)
               history%column(k)%value(p) = 0.0_wp
            end do
            return
         end if
      end associate
      block%area(c) = overlap%area
      block%normal(c, :) = overlap%normal
      block%length(c) = length_of(overlap%normal(1), overlap%normal(2))
      block%moment(c, :) = [overlap%moment_a, overlap%moment_b]
      block%arm_first(c, :) = overlap%centroid
      block%arm_second(c, :) = overlap%centroid_b
      block%degenerate(c) = merge(1.0_wp, 0.0_wp, block%length(c) <= no_length*sqrt(overlap%area))
   end subroutine search

   !> Remove the pairs that are no contacts.
   pure subroutine remove_others(exists, block)
      logical, intent(in) :: exists(block_size)
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: b, c

      b = 0_ip
      do c = 1_ip, block%n
         if (.not. exists(c)) cycle
         b = b + 1_ip
         if (b == c) cycle
         block%pair(b) = block%pair(c)
         block%first(b) = block%first(c)
         block%second(b) = block%second(c)
         block%area(b) = block%area(c)
         block%normal(b, :) = block%normal(c, :)
         block%length(b) = block%length(c)
         block%moment(b, :) = block%moment(c, :)
         block%arm_first(b, :) = block%arm_first(c, :)
         block%arm_second(b, :) = block%arm_second(c, :)
         block%degenerate(b) = block%degenerate(c)
      end do
      block%n = b
   end subroutine remove_others

   !> Compute the rates of change of the areas.
   pure subroutine find_rates(block)
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: c

      do c = 1_ip, block%n
         block%rate(c) = (block%normal(c, 1)*(block%velocity_first(c, 1) - block%velocity_second(c, 1)) &
                          + block%normal(c, 2)*(block%velocity_first(c, 2) - block%velocity_second(c, 2))) &
            + (block%moment(c, 1)*block%angular_velocity(c, 1) - block%moment(c, 2)*block%angular_velocity(c, 2))
      end do
   end subroutine find_rates

   !> Find the directions from the second bodies to the first.
   pure subroutine find_directions(bodies, block)
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(inout) :: block
      real(wp) :: inverse
      integer(ip) :: c

      do c = 1_ip, block%n
         inverse = -1.0_wp/max(block%length(c), tiny(inverse))
         block%direction(c, 1) = block%normal(c, 1)*inverse
         block%direction(c, 2) = block%normal(c, 2)*inverse
      end do
      if (.not. any(block%degenerate(:block%n) > 0.0_wp)) return
      do c = 1_ip, block%n
         if (block%degenerate(c) > 0.0_wp) call direct_from_centres(bodies, c, block)
      end do
   end subroutine find_directions

   !> Give a degenerate contact the direction of the line of centres and the side of a square of its area.
   pure subroutine direct_from_centres(bodies, c, block)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: c
      type(contact_block_t), intent(inout) :: block
      real(wp) :: offset(2), distance

      block%length(c) = sqrt(block%area(c))
      block%direction(c, :) = [1.0_wp, 0.0_wp]
      offset = offset_of(bodies, block%first(c), block%second(c))
      distance = length_of(offset(1), offset(2))
      if (distance > no_length*block%length(c)) block%direction(c, :) = -offset/distance
   end subroutine direct_from_centres

   !> Length of a vector
   elemental real(wp) function length_of(x, y)
      real(wp), intent(in) :: x, y

      length_of = sqrt(x*x + y*y)
   end function length_of

end module polydem_fill_block
