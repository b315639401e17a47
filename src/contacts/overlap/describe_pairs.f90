!> Polygons of pairs and the vectors between their centres, as a batch for the search for overlaps.
module polydem_describe_pairs
   use polydem_bodies, only: bodies_t
   use polydem_cell, only: find_minimum_images, minimum_image
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: overlap_batch_t
   implicit none
   private
   public :: describe_pairs, offset_of, offset_of_contact

contains

   !> Choose the roles of the polygons, and copy their sizes and places to the batch.
   subroutine describe_pairs(bodies, n, pair, first, second, radius, start, i, j, batch)
      type(bodies_t), intent(in) :: bodies
      !> Number of pairs, and the pairs
      integer(ip), intent(in) :: n, pair(n)
      !> Lower and higher piece of each pair of the list
      integer(ip), intent(in), contiguous :: first(:), second(:)
      !> Greatest distance of a vertex from the centre of each polygon [m]
      real(wp), intent(in), contiguous :: radius(:)
      !> First vertex of each polygon
      integer(ip), intent(in), contiguous :: start(:)
      !> P and Q of each pair
      integer(ip), intent(inout) :: i(block_size), j(block_size)
      !> All but what is remembered is set
      type(overlap_batch_t), intent(inout) :: batch

      if (bodies%pieces%most == 1_ip) then
         call describe_polygons(n, pair, first, second, radius, start, bodies%position, i, j, batch)
         if (bodies%cell%is_periodic) call find_minimum_images(bodies%cell, n, i, j, bodies%inverse_period, &
                                                               batch%offset)
      else
         call describe_polygons(n, pair, first, second, radius, start, bodies%pieces%arm, i, j, batch)
         call add_positions(bodies, n, i, j, batch)
      end if
   end subroutine describe_pairs

   !> Add the vectors between the bodies to those between the centres of their pieces.
   subroutine add_positions(bodies, n, i, j, batch)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: n
      !> Pieces
      integer(ip), intent(in) :: i(block_size), j(block_size)
      type(overlap_batch_t), intent(inout) :: batch
      real(wp) :: offset(2)
      integer(ip) :: c

      do c = 1_ip, n
         offset = offset_of(bodies, bodies%pieces%body(i(c)), bodies%pieces%body(j(c)))
         batch%offset(c, 1) = offset(1) + batch%offset(c, 1)
         batch%offset(c, 2) = offset(2) + batch%offset(c, 2)
      end do
   end subroutine add_positions

   !> The same for plain arrays. Roles are those of `is_exchanged`, without a branch: which radius is greater, a
   !> processor cannot predict.
   pure subroutine describe_polygons(n, pair, first, second, radius, start, position, i, j, batch)
      !> Number of pairs
      integer(ip), intent(in) :: n
      !> Pairs
      integer(ip), intent(in) :: pair(n)
      integer(ip), intent(in), contiguous :: first(:), second(:)
      !> Radii of the bodies [m]
      real(wp), intent(in), contiguous :: radius(:)
      !> First vertex of each body
      integer(ip), intent(in), contiguous :: start(:)
      !> Centres of the bodies [m]
      real(wp), intent(in) :: position(2, size(radius))
      !> Slots of P and of Q
      integer(ip), intent(inout) :: i(block_size), j(block_size)
      !> All but what is remembered is set
      type(overlap_batch_t), intent(inout) :: batch
      integer(ip) :: exchange, c, p, q

      do c = 1_ip, n
         p = first(pair(c))
         q = second(pair(c))
         exchange = iand(ieor(p, q), -merge(1_ip, 0_ip, radius(q) < radius(p)))
         batch%radius(c, 1) = min(radius(p), radius(q))
         batch%radius(c, 2) = max(radius(p), radius(q))
         p = ieor(p, exchange)
         q = ieor(q, exchange)
         i(c) = p
         j(c) = q
         batch%start(c, 1) = start(p)
         batch%start(c, 2) = start(q)
         batch%corners(c, 1) = start(p + 1_ip) - start(p)
         batch%corners(c, 2) = start(q + 1_ip) - start(q)
         batch%offset(c, 1) = position(1, q) - position(1, p)
         batch%offset(c, 2) = position(2, q) - position(2, p)
      end do
   end subroutine describe_polygons

   !> Centre of the second body minus centre of the first; in a periodic cell the vector to the nearest copy [m]
   pure function offset_of(bodies, i, j) result(offset)
      type(bodies_t), intent(in) :: bodies
      !> Slots of the first and of the second body
      integer(ip), intent(in) :: i, j
      real(wp) :: offset(2)

      offset(1) = bodies%position(1, j) - bodies%position(1, i)
      offset(2) = bodies%position(2, j) - bodies%position(2, i)
      if (bodies%cell%is_periodic) &
         offset = minimum_image(bodies%cell, min(bodies%inverse_period(:, i), bodies%inverse_period(:, j)), offset)
   end function offset_of

   !> Centre of the second polygon of a contact minus centre of the first [m]
   pure function offset_of_contact(bodies, block, c) result(offset)
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their bodies and, if bodies have several, pieces
      type(contact_block_t), intent(in) :: block
      !> Index in the block
      integer(ip), intent(in) :: c
      real(wp) :: offset(2)

      offset = offset_of(bodies, block%first(c), block%second(c))
      if (bodies%pieces%most > 1_ip) &
         offset = offset + (bodies%pieces%arm(:, block%piece(c, 2)) - bodies%pieces%arm(:, block%piece(c, 1)))
   end function offset_of_contact

end module polydem_describe_pairs
