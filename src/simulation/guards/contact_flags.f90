!> Flags contacts beyond the limits of the guards: those that are deep, degenerate or stiff. Detects bodies that pass
!> through each other: the centre of one body is inside the other, or the direction of their contact reverses.
!>
!> The overlap pushes a body that crosses a thin body back at first. Later the overlap has no direction, and finally it
!> pushes the body out on the far side. The direction therefore turns by more than a right angle from one step to the
!> next while the bodies overlap all the time. The contact history stores the direction of the last step, packed into
!> one number per pair. The result thus depends neither on the number of ranks nor on restarts.
!>
!> If the centre of a body is inside another body, their overlap reaches from the centre to the outline. In 20 000
!> random pairs of all shapes, the depth was never less than an eighth of the thickness of the thinner body. Only
!> contacts deeper than half of this value are tested. The contact direction of two corners that graze each other also
!> reverses, but this is harmless.
module polydem_contact_flags
   use polydem_bodies, only: bodies_t
   use polydem_cell, only: minimum_image
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: flag_limits_t, flag_deeper, test_block, packed_direction, is_reversed, centre_inside, least_depth, &
      former_direction

   !> Minimum depth of the tested contacts, as a fraction of the thickness of the thinner piece
   real(wp), parameter :: least_depth = 0.0625_wp

   !> Limits beyond which contacts are flagged
   type :: flag_limits_t
      !> Contacts deeper than this fraction of the thickness of the thinner piece are flagged; huge: only degenerate
      !> ones
      real(wp) :: least_depth = huge(1.0_wp)
      !> Contacts that are not deeper than this are surely none [m]
      real(wp) :: shallow = 2.0_wp**(maxexponent(1.0_wp)/2)
      !> Contacts with a greater product of ratio L/l and mobility may be too stiff for the time step [m/kg]
      real(wp) :: soft = huge(1.0_wp)
      !> Column of the contact history with the directions of the last step; 0 if there is none
      integer :: column = 0
   end type flag_limits_t

   !> Column of the contact history with the directions of the last step
   type(history_kind_t), parameter :: former_direction = &
      history_kind_t('direction', '1', 'direction at the last step, packed')

contains

   !> Flag contacts that are deeper than a share of the thickness of the thinner piece, beside those flagged already.
   subroutine flag_deeper(limits, share, bodies)
      type(flag_limits_t), intent(inout) :: limits
      !> Share of the thickness of the thinner piece
      real(wp), intent(in) :: share
      !> Bodies, for their shapes
      type(bodies_t), intent(in) :: bodies

      limits%least_depth = min(limits%least_depth, share)
      limits%shallow = min(limits%shallow, 0.999_wp*limits%least_depth*minval(bodies%thickness))
   end subroutine flag_deeper

   !> Test the contacts of a block, and store their directions.
   subroutine test_block(limits, bodies, block, history, flagged, any_flagged, passing_pair)
      !> Limits beyond which a contact is flagged
      type(flag_limits_t), intent(in) :: limits
      !> Bodies with the positions of this step
      type(bodies_t), intent(in) :: bodies
      !> Contacts in descending order of their pairs
      type(contact_block_t), intent(in) :: block
      !> Contact history; the direction is read and set
      type(contact_history_t), intent(inout) :: history
      !> Whether each contact is deep, degenerate or stiff; set if any is
      logical, intent(inout) :: flagged(block_size)
      !> Whether any may be
      logical, intent(out) :: any_flagged
      !> Lowest index in the pair list of a contact whose bodies pass through each other; changes if there is one
      integer(ip), intent(inout) :: passing_pair
      real(wp) :: before(block_size), now(block_size), deepest
      integer(ip) :: c

      deepest = -1.0_wp
      do c = 1_ip, block%n
         deepest = max(deepest, max(block%degenerate(c), block%depth(c) - limits%shallow, &
                                    block%length(c)*block%inverse_length(c)*block%mobility(c) - limits%soft))
      end do
      any_flagged = deepest > 0.0_wp
      if (any_flagged) call find_flagged(limits, bodies, block, flagged)
      if (limits%column == 0) return
      do c = 1_ip, block%n
         now(c) = packed_direction(block%direction(c, 1), block%direction(c, 2))
      end do
      associate (stored => history%column(limits%column)%value)
         do c = 1_ip, block%n
            before(c) = stored(block%pair(c))
            stored(block%pair(c)) = now(c)
         end do
      end associate
      if (.not. any_flagged) return
      do c = 1_ip, block%n
         if (.not. flagged(c)) cycle
         if (passes(bodies, block, c, is_reversed(before(c), now(c)))) passing_pair = block%pair(c)
      end do
   end subroutine test_block

   !> Find the contacts that are deep, degenerate or stiff.
   pure subroutine find_flagged(limits, bodies, block, flagged)
      !> Limits beyond which a contact is flagged
      type(flag_limits_t), intent(in) :: limits
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(in) :: block
      logical, intent(inout) :: flagged(block_size)
      integer(ip) :: c

      do c = 1_ip, block%n
         flagged(c) = block%degenerate(c) > 0.0_wp &
            .or. block%length(c)*block%inverse_length(c)*block%mobility(c) > limits%soft
         if (flagged(c) .or. limits%least_depth >= huge(1.0_wp)) cycle
         flagged(c) = block%depth(c) > limits%least_depth*thinner_of(bodies, block, c)
      end do
   end subroutine find_flagged

   !> Thickness of the thinner of the two pieces of a contact [m]
   pure real(wp) function thinner_of(bodies, block, c)
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(in) :: block
      integer(ip), intent(in) :: c

      if (bodies%pieces%most == 1_ip) then
         thinner_of = min(bodies%thickness(block%first(c)), bodies%thickness(block%second(c)))
      else
         thinner_of = min(bodies%pieces%thickness(block%piece(c, 1)), bodies%pieces%thickness(block%piece(c, 2)))
      end if
   end function thinner_of

   !> Whether the bodies of a contact pass through each other
   pure logical function passes(bodies, block, c, reversed)
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(in) :: block
      integer(ip), intent(in) :: c
      !> Whether the direction of the contact is reversed
      logical, intent(in) :: reversed

      associate (i => block%first(c), j => block%second(c))
         passes = block%depth(c) > least_depth*thinner_of(bodies, block, c)
         if (.not. passes .or. reversed) return
         if (bodies%pieces%most > 1_ip) then
            passes = piece_inside(bodies, i, j, block%piece(c, 1), block%piece(c, 2)) &
                     .or. piece_inside(bodies, j, i, block%piece(c, 2), block%piece(c, 1))
            return
         end if
         passes = centre_inside(bodies, bodies%radius, i, j)
         if (.not. passes) passes = centre_inside(bodies, bodies%radius, j, i)
      end associate
   end function passes

   !> Whether the centre of a piece is inside a piece of another body
   pure logical function piece_inside(bodies, s, other, piece, of_other) result(inside)
      type(bodies_t), intent(in) :: bodies
      !> Slots of the body and of the other body, and their pieces
      integer(ip), intent(in) :: s, other, piece, of_other
      real(wp) :: place(2), edge(2)
      integer(ip) :: v, w

      place = bodies%position(:, s) - bodies%position(:, other)
      if (bodies%cell%is_periodic) &
         place = minimum_image(bodies%cell, min(bodies%inverse_period(:, s), bodies%inverse_period(:, other)), place)
      associate (pieces => bodies%pieces)
         place = place + (pieces%arm(:, piece) - pieces%arm(:, of_other))
         inside = .true.
         w = pieces%start(of_other + 1_ip) - 1_ip
         do v = pieces%start(of_other), pieces%start(of_other + 1_ip) - 1_ip
            edge = pieces%outline(:, v) - pieces%outline(:, w)
            inside = inside .and. edge(1)*(place(2) - pieces%outline(2, w)) &
               - edge(2)*(place(1) - pieces%outline(1, w)) > 0.0_wp
            w = v
         end do
      end associate
   end function piece_inside

   !> Whether the centre of a body is inside another body
   pure logical function centre_inside(bodies, radius, s, other)
      type(bodies_t), intent(in) :: bodies
      !> Greatest distance of a vertex from the centre of each body, (slot) [m]
      real(wp), intent(in) :: radius(:)
      !> Slots of the body and of the other body
      integer(ip), intent(in) :: s, other
      real(wp) :: x, y, cross, offset(2)
      integer(ip) :: v, w

      x = bodies%position(1, s) - bodies%position(1, other)
      y = bodies%position(2, s) - bodies%position(2, other)
      if (bodies%cell%is_periodic) then
         offset = minimum_image(bodies%cell, min(bodies%inverse_period(:, s), bodies%inverse_period(:, other)), [x, y])
         x = offset(1)
         y = offset(2)
      end if
      centre_inside = x*x + y*y < radius(other)*radius(other)
      if (.not. centre_inside) return
      w = bodies%pieces%vertex_start(other + 1_ip) - 1_ip
      do v = bodies%pieces%vertex_start(other), bodies%pieces%vertex_start(other + 1_ip) - 1_ip
         cross = (bodies%pieces%turned(1, v) - bodies%pieces%turned(1, w))*(y - bodies%pieces%turned(2, w)) &
            - (bodies%pieces%turned(2, v) - bodies%pieces%turned(2, w))*(x - bodies%pieces%turned(1, w))
         centre_inside = cross > 0.0_wp
         if (.not. centre_inside) return
         w = v
      end do
   end function centre_inside

   !> Direction of a vector packed into one number from 1 to 5. The number increases with the angle, and any two
   !> perpendicular directions differ by 1 (modulo 4).
   pure real(wp) function packed_direction(x, y)
      !> Components of the vector
      real(wp), intent(in) :: x, y
      real(wp) :: side

      side = sign(1.0_wp, x)
      packed_direction = 3.0_wp + side*(y/(abs(x) + abs(y)) - 1.0_wp)
   end function packed_direction

   !> Whether two directions differ by more than a right angle; false if there is no previous direction
   pure logical function is_reversed(before, now)
      !> Previous direction packed by `packed_direction`; 0: none
      real(wp), intent(in) :: before
      !> Present direction, packed
      real(wp), intent(in) :: now

      is_reversed = before > 0.0_wp .and. abs(now - before) > 1.0_wp .and. abs(now - before) < 3.0_wp
   end function is_reversed

end module polydem_contact_flags
