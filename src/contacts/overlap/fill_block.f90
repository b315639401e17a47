!> Fills a block with the next contacts of the pair list: overlapping polygons with overlap area, its rate of change,
!> contact point and direction.
!>
!> Most pairs are like those of the last step: an edge still separates the polygons, or their outlines cross at the same
!> edges. The contact history remembers either. Contacts of the second kind are evaluated together, as a batch. All
!> other pairs are searched one by one. The result is the same, whatever is remembered.
!>
!> If bodies have several pieces, pairs and polygons are those of pieces; the contacts are those of their bodies.
!>
!> A contact is *degenerate* if it has no direction: |N| is negligible against the square root of the area, because one
!> body is inside the other, or bars cross. A degenerate contact gets the direction of the line of centres (or of the x
!> axis if the centres coincide) and the side of a square of the same area as its length. With this length no force or
!> stiffness overflows, and the run can continue or stop with a message. `normal`, `moment` and `rate` are not changed.
!> A contact of a batch is never degenerate.
module polydem_fill_block
   use polydem_bodies, only: bodies_t
   use polydem_cell, only: copies_along_y
   use polydem_contact_block, only: block_size, contact_block_t, copy_motion
   use polydem_contact_history, only: contact_history_t
   use polydem_convex_overlap, only: find_overlap, overlap_t
   use polydem_describe_pairs, only: describe_pairs, offset_of_contact
   use polydem_evaluate_batch, only: evaluate_batch
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: overlap_batch_t
   use polydem_overlap_measure, only: overlap_measure_t
   use polydem_overlap_tolerances, only: no_length
   use polydem_piece_contacts, only: keep_pieces, refer_to_bodies, take_bodies
   use polydem_separation, only: test_edges
   implicit none
   private
   public :: fill_block

   !> Number of pairs whose remembered edges are tested at a time
   integer(ip), parameter :: ahead = 2_ip*block_size

   !> Where the loop over the pairs is
   type :: place_t
      !> Last pair to examine, next one, and first one whose remembered edges have been tested
      integer(ip) :: low, next, tested
   end type place_t

contains

   !> Fill a block with contacts of pairs in descending order.
   subroutine fill_block(bodies, first, second, measure, low, next, tested, history, block)
      !> Bodies with rotated polygons
      type(bodies_t), intent(in) :: bodies
      !> Lower and higher piece of each pair
      integer(ip), intent(in), contiguous :: first(:), second(:)
      !> How the overlaps are measured
      type(overlap_measure_t), intent(in) :: measure
      !> Last pair to examine
      integer(ip), intent(in) :: low
      !> First pair to examine, at least `low`; afterwards the next one, less than `low` if there is none
      integer(ip), intent(inout) :: next
      !> From this pair on, remembered edges have been tested; greater than `next` at the start
      integer(ip), intent(inout) :: tested
      !> Contact history of the pairs: `features` is updated, and the other columns are cleared for pairs whose polygons
      !> do not overlap; any column may be absent
      type(contact_history_t), intent(inout) :: history
      !> Contacts; the columns that the force law fills are not changed
      type(contact_block_t), intent(inout) :: block
      type(place_t) :: at

      block%has_cohesion = measure%with_area
      at = place_t(low, next, tested)
      if (bodies%pieces%most == 1_ip) then
         call fill(bodies, bodies%radius, bodies%pieces%vertex_start, bodies%pieces%turned, first, second, measure, &
                   at, history, block)
      else
         call fill(bodies, bodies%pieces%radius, bodies%pieces%start, bodies%pieces%outline, first, second, measure, &
                   at, history, block)
      end if
      next = at%next
      tested = at%tested
   end subroutine fill_block

   !> Fill a block with contacts of the pairs of some polygons.
   subroutine fill(bodies, radius, start, outline, first, second, measure, at, history, block)
      type(bodies_t), intent(in) :: bodies
      !> Greatest distance of a vertex from the centre of each polygon [m]
      real(wp), intent(in), contiguous :: radius(:)
      !> First vertex of each polygon
      integer(ip), intent(in), contiguous :: start(:)
      !> Turned vertices, relative to the centre of their polygon, (2, vertex) [m]
      real(wp), intent(in), contiguous :: outline(:, :)
      integer(ip), intent(in), contiguous :: first(:), second(:)
      type(overlap_measure_t), intent(in) :: measure
      type(place_t), intent(inout) :: at
      type(contact_history_t), intent(inout) :: history
      type(contact_block_t), intent(inout) :: block
      type(overlap_batch_t) :: batch
      logical :: all_certified, is_compound

      is_compound = bodies%pieces%most > 1_ip
      call select_pairs(bodies, radius, start, outline, first, second, at, history, block, batch)
      call describe_pairs(bodies, block%n, block%pair, first, second, radius, start, block%first, block%second, batch)
      if (is_compound) call take_bodies(bodies%pieces, block)
      call evaluate_batch(batch, block%n, outline, measure, bodies%isa, block%overlap_columns_t)
      block%degenerate(:block%n) = 0.0_wp
      all_certified = count(batch%certified(:block%n) > 0.0_wp) == block%n
      if (.not. all_certified) &
         call search_others(bodies, radius, start, outline, measure, batch%certified, history, block)
      if (is_compound) call refer_to_bodies(bodies, block)
      call copy_motion(bodies, block)
      if (bodies%cell%is_sheared) call add_jumps(bodies, block)
      if (allocated(bodies%cell%load)) call add_stretching(bodies, block)
      call find_rates_and_directions(block)
      if (.not. all_certified) call direct_from_centres(bodies, block)
      call find_depths(block)
   end subroutine fill

   !> Select the next pairs that may be contacts: those that no remembered edge separates.
   subroutine select_pairs(bodies, radius, start, outline, first, second, at, history, block, batch)
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in), contiguous :: radius(:)
      integer(ip), intent(in), contiguous :: start(:)
      real(wp), intent(in), contiguous :: outline(:, :)
      integer(ip), intent(in), contiguous :: first(:), second(:)
      type(place_t), intent(inout) :: at
      type(contact_history_t), intent(inout) :: history
      type(contact_block_t), intent(inout) :: block
      type(overlap_batch_t), intent(inout) :: batch
      integer(ip) :: nothing(ahead)

      block%n = 0_ip
      associate (low => at%low, next => at%next, tested => at%tested)
         do while (next >= low .and. block%n < block_size)
            if (next < tested) then
               tested = max(low, next - ahead + 1_ip)
               if (allocated(history%features)) call forget_edges(bodies, radius, start, outline, tested, next, &
                                                                first, second, history%features)
            end if
            if (allocated(history%features)) then
               call select_in_range(tested, next, history%features(tested:next), block, batch)
            else
               nothing = 0_ip
               call select_in_range(tested, next, nothing(:next - tested + 1_ip), block, batch)
            end if
         end do
      end associate
   end subroutine select_pairs

   !> Forget the remembered edges that do not separate the polygons any more.
   subroutine forget_edges(bodies, radius, start, outline, from, to, first, second, features)
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in), contiguous :: radius(:)
      integer(ip), intent(in), contiguous :: start(:)
      real(wp), intent(in), contiguous :: outline(:, :)
      !> First and last pair, at most `ahead` pairs
      integer(ip), intent(in) :: from, to
      integer(ip), intent(in), contiguous :: first(:), second(:)
      integer(ip), intent(inout), contiguous :: features(:)
      type(overlap_batch_t) :: batch
      integer(ip) :: found(ahead), i(block_size), j(block_size), k, n, n_found, p, done
      logical :: apart(block_size)

      n_found = 0_ip
      do p = from, to
         found(n_found + 1_ip) = p
         n_found = n_found + shiftr(features(p), bit_size(p) - 1)
      end do
      do done = 0_ip, n_found - 1_ip, block_size
         n = min(block_size, n_found - done)
         call describe_pairs(bodies, n, found(done + 1:done + n), first, second, radius, start, i, j, batch)
         do k = 1_ip, n
            batch%features(k) = features(found(done + k))
         end do
         call test_edges(batch, n, size(outline, 2, kind=ip), outline, bodies%isa, apart)
         do k = 1_ip, n
            features(found(done + k)) = merge(batch%features(k), 0_ip, apart(k))
         end do
      end do
   end subroutine forget_edges

   !> Add pairs without remembered edge to a block, in descending order, until it is full.
   pure subroutine select_in_range(low, next, features, block, batch)
      !> Last pair to examine
      integer(ip), intent(in) :: low
      !> First pair to examine; afterwards the next one
      integer(ip), intent(inout) :: next
      integer(ip), intent(in) :: features(low:next)
      type(contact_block_t), intent(inout) :: block
      type(overlap_batch_t), intent(inout) :: batch
      integer(ip) :: c, p, last

      c = block%n
      p = next
      do while (p >= low .and. c < block_size)
         ! So many pairs surely find room.
         last = max(low, p - (block_size - c) + 1_ip)
         do p = p, last, -1_ip
            block%pair(c + 1_ip) = p
            batch%features(c + 1_ip) = features(p)
            c = c + shiftr(not(features(p)), bit_size(p) - 1)
         end do
      end do
      next = p
      block%n = c
   end subroutine select_in_range

   !> Search the overlaps of the pairs that are not certified, and remove those that are no contacts.
   subroutine search_others(bodies, radius, start, outline, measure, certified, history, block)
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in), contiguous :: radius(:)
      integer(ip), intent(in), contiguous :: start(:)
      real(wp), intent(in), contiguous :: outline(:, :)
      type(overlap_measure_t), intent(in) :: measure
      real(wp), intent(in) :: certified(:)
      type(contact_history_t), intent(inout) :: history
      type(contact_block_t), intent(inout) :: block
      logical :: exists(block_size)
      integer(ip) :: c

      do c = 1_ip, block%n
         exists(c) = certified(c) > 0.0_wp
         if (.not. exists(c)) &
            call search(bodies, radius, start, outline, measure, c, history, block, exists(c))
      end do
      if (all(exists(:block%n))) return
      if (bodies%pieces%most > 1_ip) call keep_pieces(exists, block)
      call remove_others(exists, measure%with_area, block)
   end subroutine search_others

   !> Search the overlap of one pair. What is remembered is no separating edge, and no lens that is certified.
   subroutine search(bodies, radius, start, outline, measure, c, history, block, exists)
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in), contiguous :: radius(:)
      integer(ip), intent(in), contiguous :: start(:)
      real(wp), intent(in), contiguous :: outline(:, :)
      type(overlap_measure_t), intent(in) :: measure
      !> Index in the block
      integer(ip), intent(in) :: c
      type(contact_history_t), intent(inout) :: history
      type(contact_block_t), intent(inout) :: block
      !> Whether the polygons overlap
      logical, intent(out) :: exists
      type(overlap_t) :: overlap
      integer(ip) :: features, rejected, i, j
      integer :: k

      rejected = 0_ip
      i = block%first(c)
      j = block%second(c)
      if (bodies%pieces%most > 1_ip) then
         i = block%piece(c, 1)
         j = block%piece(c, 2)
      end if
      if (allocated(history%features)) rejected = max(0_ip, history%features(block%pair(c)))
      associate (p => block%pair(c))
         call find_overlap(outline(:, start(i):start(i + 1_ip) - 1_ip), outline(:, start(j):start(j + 1_ip) - 1_ip), &
                           offset_of_contact(bodies, block, c), radius(i), radius(j), measure, overlap, features, &
                           rejected)
         if (allocated(history%features)) history%features(p) = merge(rejected, features, features == 0_ip)
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
      block%length_square(c) = overlap%length_square
      block%of_area(c, :) = overlap%of_area
      block%moment(c, :) = [overlap%moment_a, overlap%moment_b]
      block%arm_first(c, :) = overlap%centroid
      block%arm_second(c, :) = overlap%centroid_b
      block%degenerate(c) = merge(1.0_wp, 0.0_wp, block%length(c) <= no_length*sqrt(overlap%area))
   end subroutine search

   !> Remove the pairs that are no contacts.
   pure subroutine remove_others(exists, with_area, block)
      logical, intent(in) :: exists(block_size)
      !> Whether the measure asks for the true area
      logical, intent(in) :: with_area
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
         block%length_square(b) = block%length_square(c)
         block%moment(b, :) = block%moment(c, :)
         block%arm_first(b, :) = block%arm_first(c, :)
         block%arm_second(b, :) = block%arm_second(c, :)
         block%degenerate(b) = block%degenerate(c)
         if (with_area) block%of_area(b, :) = block%of_area(c, :)
      end do
      block%n = b
   end subroutine remove_others

   !> Add to the velocities of the second bodies those of their nearest copies in a sheared cell.
   pure subroutine add_jumps(bodies, block)
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: c

      do c = 1_ip, block%n
         associate (distance => bodies%position(2, block%second(c)) - bodies%position(2, block%first(c)))
            block%velocity_second(c, 1) = block%velocity_second(c, 1) &
               - copies_along_y(bodies%cell, distance)*bodies%cell%jump
         end associate
      end do
   end subroutine add_jumps

   !> Add to the velocities of the second bodies that with which the growing cell moves them away from the first.
   pure subroutine add_stretching(bodies, block)
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(inout) :: block
      real(wp) :: rate(2)
      integer(ip) :: c

      rate = bodies%cell%load%axis%speed/bodies%cell%size
      do c = 1_ip, block%n
         block%velocity_second(c, :) = block%velocity_second(c, :) &
                                       + rate*(block%arm_first(c, :) - block%arm_second(c, :))
      end do
   end subroutine add_stretching

   !> Compute the rates of change of the areas, and find the directions from the second bodies to the first.
   pure subroutine find_rates_and_directions(block)
      type(contact_block_t), intent(inout) :: block
      real(wp) :: inverse
      integer(ip) :: c

      do c = 1_ip, block%n
         block%rate(c) = (block%normal(c, 1)*(block%velocity_first(c, 1) - block%velocity_second(c, 1)) &
                          + block%normal(c, 2)*(block%velocity_first(c, 2) - block%velocity_second(c, 2))) &
            + (block%moment(c, 1)*block%angular_velocity(c, 1) - block%moment(c, 2)*block%angular_velocity(c, 2))
         inverse = -1.0_wp/max(block%length(c), tiny(inverse))
         block%direction(c, 1) = block%normal(c, 1)*inverse
         block%direction(c, 2) = block%normal(c, 2)*inverse
      end do
   end subroutine find_rates_and_directions

   !> Give degenerate contacts the direction of the line of centres and the side of a square of their area.
   pure subroutine direct_from_centres(bodies, block)
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(inout) :: block
      real(wp) :: offset(2), distance
      integer(ip) :: c

      do c = 1_ip, block%n
         if (.not. block%degenerate(c) > 0.0_wp) cycle
         block%length(c) = sqrt(block%area(c))
         block%direction(c, :) = [1.0_wp, 0.0_wp]
         offset = offset_of_contact(bodies, block, c)
         distance = length_of(offset(1), offset(2))
         if (distance > no_length*block%length(c)) block%direction(c, :) = -offset/distance
      end do
   end subroutine direct_from_centres

   !> Find the depths of the overlaps: area over length. With an area that is not the true one, this is how far a body
   !> has to move until the area is zero if it falls at a constant rate.
   pure subroutine find_depths(block)
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: c

      do c = 1_ip, block%n
         block%depth(c) = block%area(c)/block%length(c)
      end do
   end subroutine find_depths

   !> Length of a vector
   elemental real(wp) function length_of(x, y)
      real(wp), intent(in) :: x, y

      length_of = sqrt(x*x + y*y)
   end function length_of

end module polydem_fill_block
