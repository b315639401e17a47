!> Fills a block with the next contacts of the pair list: overlapping polygons with overlap area, its rate of change,
!> contact point and direction.
!>
!> A contact is *degenerate* if it has no direction: |N| is negligible against the square root of the area, because one
!> body is inside the other, or bars cross. A degenerate contact gets the direction of the line of centres (or of the x
!> axis if the centres coincide) and the side of a square of the same area as its length. With this length no force or
!> stiffness overflows, and the run can continue or stop with a message. `normal`, `moment` and `rate` are not changed.
module polydem_fill_block
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t, copy_motion, is_exchanged
   use polydem_contact_history, only: contact_history_t
   use polydem_convex_overlap, only: overlap_polygons, overlap_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: fill_block

   !> Ratio of a length to the square root of the area below which the length is rounding error
   real(wp), parameter :: no_length = 4096.0_wp*epsilon(1.0_wp)

contains

   !> Fill a block with contacts of pairs in descending order.
   subroutine fill_block(bodies, first, second, effective, low, next, history, block)
      !> Bodies with rotated polygons
      type(bodies_t), intent(in) :: bodies
      !> Lower and higher slot of each pair
      integer(ip), intent(in) :: first(:), second(:)
      !> Whether to compute the effective area
      logical, intent(in) :: effective
      !> Last pair to examine
      integer(ip), intent(in) :: low
      !> First pair to examine, at least `low`; afterwards the next one, less than `low` if there is none
      integer(ip), intent(inout) :: next
      !> Contact history of the pairs: `memory` is updated, and the other columns are cleared for pairs whose polygons do
      !> not overlap; any column may be absent
      type(contact_history_t), intent(inout) :: history
      !> Contacts; the columns that the force law fills are not changed
      type(contact_block_t), intent(inout) :: block
      type(overlap_t) :: overlap
      integer(ip) :: i, j, p

      block%n = 0_ip
      do p = next, low, -1_ip
         if (block%n == block_size) exit
         i = first(p)
         j = second(p)
         if (is_exchanged(bodies, i, j)) then
            i = second(p)
            j = first(p)
         end if
         call find_one(bodies, p, i, j, effective, history, overlap)
         if (overlap%area > 0.0_wp) call append(overlap, p, i, j, bodies, block)
      end do
      next = p
      call copy_motion(bodies, block)
      call find_rates(block)
      call find_directions(bodies, block)
   end subroutine fill_block

   !> Find the overlap of one pair.
   subroutine find_one(bodies, p, i, j, effective, history, overlap)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: p
      !> Slots of the body with the smaller and with the greater radius
      integer(ip), intent(in) :: i, j
      logical, intent(in) :: effective
      type(contact_history_t), intent(inout) :: history
      type(overlap_t), intent(out) :: overlap
      integer(ip) :: memory
      integer :: k

      memory = 0_ip
      if (allocated(history%memory)) memory = history%memory(p)
      associate (start => bodies%vertex_start, turned => bodies%turned)
         call overlap_polygons(turned(:, start(i):start(i + 1_ip) - 1_ip), &
                               turned(:, start(j):start(j + 1_ip) - 1_ip), &
                               bodies%position(:, j) - bodies%position(:, i), memory, overlap, effective)
      end associate
      if (allocated(history%memory)) history%memory(p) = overlap%separating_edge
      if (overlap%area > 0.0_wp .or. .not. allocated(history%column)) return
      do k = 1, size(history%column)
         history%column(k)%value(p) = 0.0_wp
      end do
   end subroutine find_one

   !> Append an overlap to a block.
   pure subroutine append(overlap, p, i, j, bodies, block)
      type(overlap_t), intent(in) :: overlap
      integer(ip), intent(in) :: p, i, j
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: c

      c = block%n + 1_ip
      block%n = c
      block%pair(c) = p
      block%first(c) = i
      block%second(c) = j
      block%area(c) = overlap%area
      block%normal(c, :) = overlap%normal
      block%moment(c, :) = [overlap%moment_a, overlap%moment_b]
      block%arm_first(c, :) = overlap%centroid
      block%arm_second(c, :) = overlap%centroid - (bodies%position(:, j) - bodies%position(:, i))
   end subroutine append

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

   !> Find the directions from the second bodies to the first, and the lengths of the contacts.
   pure subroutine find_directions(bodies, block)
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(inout) :: block
      real(wp) :: length
      integer(ip) :: c

      do c = 1_ip, block%n
         length = length_of(block%normal(c, 1), block%normal(c, 2))
         block%length(c) = length
         length = max(length, tiny(length))
         block%direction(c, 1) = -block%normal(c, 1)/length
         block%direction(c, 2) = -block%normal(c, 2)/length
         block%degenerate(c) = 0.0_wp
      end do
      do c = 1_ip, block%n
         if (block%length(c) <= no_length*sqrt(block%area(c))) call direct_from_centres(bodies, c, block)
      end do
   end subroutine find_directions

   !> Give a degenerate contact the direction of the line of centres and the side of a square of its area.
   pure subroutine direct_from_centres(bodies, c, block)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: c
      type(contact_block_t), intent(inout) :: block
      real(wp) :: offset(2), distance, side

      side = sqrt(block%area(c))
      offset = bodies%position(:, block%second(c)) - bodies%position(:, block%first(c))
      distance = length_of(offset(1), offset(2))
      block%degenerate(c) = 1.0_wp
      block%length(c) = side
      block%direction(c, :) = [1.0_wp, 0.0_wp]
      if (distance > no_length*side) block%direction(c, :) = -offset/distance
   end subroutine direct_from_centres

   !> Length of a vector
   elemental real(wp) function length_of(x, y)
      real(wp), intent(in) :: x, y

      length_of = sqrt(x*x + y*y)
   end function length_of

end module polydem_fill_block
