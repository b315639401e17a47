!> Contacts of one body with neighbouring pieces of another one that count as one overlap (`polydem_joined_overlaps`).
!>
!> Bodies that are fixed count as one; they move alike or not at all where they have a flush joint.
module polydem_joined_contacts
   use polydem_bodies, only: bodies_t
   use polydem_clipping, only: clip_loop
   use polydem_contact_block, only: contact_block_t, is_exchanged
   use polydem_describe_pairs, only: offset_of
   use polydem_kinds, only: ip, wp
   use polydem_joined_overlaps, only: integrate_joined, join_loops, overlap_loop_t
   implicit none
   private
   public :: joined_contact_t, overlap_loop_t, join_contacts, replace_overlap

   !> What replaces the overlap of one of several contacts between two bodies
   type :: joined_contact_t
      !> Whether the contact is joined with others
      logical :: is_joined = .false.
      !> First one of those that it is joined with: its number among the contacts of both bodies
      integer(ip) :: first = 0_ip
      !> Slot of the body whose outline is integrated over
      integer(ip) :: body = 0_ip
      !> Gradient of the measure along the motion of that body [m], and its moments about its own centre and that of the
      !> other body [m2]
      real(wp) :: normal(2) = 0.0_wp, moment(2) = 0.0_wp
      !> Square of the length of the overlap, for the share of this contact [m2]
      real(wp) :: length_square = 0.0_wp
      !> Depth of the joined overlap [m]
      real(wp) :: depth = 0.0_wp
   end type joined_contact_t

   !> Distance of points that count as one over the radius of the body
   real(wp), parameter :: tolerance = 1.0e-10_wp
   !> Least length of a contact over the root of its area: rounding
   real(wp), parameter :: least_length = 1.0e-12_wp

contains

   !> Join the contacts of one body with another one, or with all fixed ones.
   pure subroutine join_contacts(bodies, pieces, loops, contacts)
      !> Bodies with turned polygons
      type(bodies_t), intent(in) :: bodies
      !> Lower and higher piece of each contact, (2, contact)
      integer(ip), intent(in) :: pieces(:, :)
      !> Work space, one for each contact
      type(overlap_loop_t), intent(inout) :: loops(:)
      !> The contacts; all is set
      type(joined_contact_t), intent(inout) :: contacts(:)
      real(wp) :: from_other(2)
      integer(ip) :: k

      do k = 1_ip, size(pieces, 2, kind=ip)
         contacts(k) = joined_contact_t()
         call find_loop(bodies, pieces(1, k), pieces(2, k), contacts(k)%body, loops(k))
      end do
      call join_loops(tolerance*bodies%radius(contacts(1)%body), loops)
      do k = 1_ip, size(pieces, 2, kind=ip)
         if (loops(k)%n == 0_ip .or. parts_of(loops, loops(k)%part_of) < 2_ip) cycle
         associate (new => contacts(k))
            new%is_joined = .true.
            new%first = loops(k)%part_of
            call integrate_joined(loops, k, new%normal, new%moment(1), new%length_square)
            from_other = offset_of(bodies, other_of(bodies, pieces(1, k), pieces(2, k), new%body), new%body)
            new%moment(2) = new%moment(1) + (from_other(1)*new%normal(2) - from_other(2)*new%normal(1))
         end associate
      end do
      do k = 1_ip, size(pieces, 2, kind=ip)
         if (contacts(k)%is_joined) contacts(k)%depth = joined_depth(loops, contacts, contacts(k)%first)
      end do
   end subroutine join_contacts

   !> Depth of a joined overlap [m]
   pure real(wp) function joined_depth(loops, contacts, first)
      type(overlap_loop_t), intent(in) :: loops(:)
      type(joined_contact_t), intent(in) :: contacts(:)
      !> Number of its first contact
      integer(ip), intent(in) :: first
      real(wp) :: area, normal(2)
      integer(ip) :: k

      area = 0.0_wp
      normal = 0.0_wp
      do k = 1_ip, size(contacts, kind=ip)
         if (.not. contacts(k)%is_joined .or. contacts(k)%first /= first) cycle
         area = area + loops(k)%area
         normal = normal + contacts(k)%normal
      end do
      joined_depth = area/max(sqrt(normal(1)**2 + normal(2)**2), tiny(area))
   end function joined_depth

   !> Number of overlaps that are joined with the given one, itself included
   pure integer(ip) function parts_of(loops, part)
      type(overlap_loop_t), intent(in) :: loops(:)
      !> Number of the first one
      integer(ip), intent(in) :: part
      integer(ip) :: k

      parts_of = 0_ip
      do k = 1_ip, size(loops, kind=ip)
         if (loops(k)%n > 0_ip .and. loops(k)%part_of == part) parts_of = parts_of + 1_ip
      end do
   end function parts_of

   !> The body of a pair of pieces that is not the given one
   pure integer(ip) function other_of(bodies, first, second, body)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: first, second, body

      other_of = bodies%pieces%body_of(first)
      if (other_of == body) other_of = bodies%pieces%body_of(second)
   end function other_of

   !> Find the outline of the overlap of two pieces, relative to the centre of the free body, or of the first of two.
   pure subroutine find_loop(bodies, first, second, body, loop)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: first, second
      !> Slot of this body
      integer(ip), intent(out) :: body
      type(overlap_loop_t), intent(inout) :: loop
      real(wp) :: offset(2), arm(2)
      integer(ip) :: i, j, a, b, k
      logical :: swapped

      i = bodies%pieces%body_of(first)
      j = bodies%pieces%body_of(second)
      swapped = is_exchanged(bodies, min(i, j), max(i, j)) .neqv. i > j
      if (bodies%fixed(i) .neqv. bodies%fixed(j)) swapped = bodies%fixed(i)
      a = merge(second, first, swapped)
      b = merge(first, second, swapped)
      body = merge(j, i, swapped)
      offset = offset_of(bodies, body, merge(i, j, swapped))
      arm = 0.0_wp
      if (bodies%pieces%most > 1_ip) then
         arm = bodies%pieces%arm(:, a)
         offset = offset + (bodies%pieces%arm(:, b) - arm)
      end if
      if (radius_of(bodies, b) < radius_of(bodies, a)) then
         call clip_pieces(bodies, b, a, -offset, loop)
         arm = arm + offset
      else
         call clip_pieces(bodies, a, b, offset, loop)
         loop%on_outline(:loop%n) = .not. loop%on_outline(:loop%n)
      end if
      do k = 1_ip, loop%n
         loop%vertex(k, :) = loop%vertex(k, :) + arm
      end do
   end subroutine find_loop

   !> Find the outline of the overlap of two pieces, relative to the centre of the first one.
   pure subroutine clip_pieces(bodies, subject, clipper, offset, loop)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: subject, clipper
      !> Centre of the clipper minus centre of the subject [m]
      real(wp), intent(in) :: offset(2)
      !> Its vertices are set, and which of its edges are on the outline of the clipper
      type(overlap_loop_t), intent(inout) :: loop

      associate (pieces => bodies%pieces)
         if (pieces%most > 1_ip) then
            call clip_loop(pieces%outline(:, pieces%start(subject):pieces%start(subject + 1_ip) - 1_ip), &
                           pieces%outline(:, pieces%start(clipper):pieces%start(clipper + 1_ip) - 1_ip), &
                           offset, radius_of(bodies, subject), loop%n, loop%vertex, loop%on_outline)
         else
            associate (start => pieces%vertex_start)
               call clip_loop(pieces%turned(:, start(subject):start(subject + 1_ip) - 1_ip), &
                              pieces%turned(:, start(clipper):start(clipper + 1_ip) - 1_ip), &
                              offset, radius_of(bodies, subject), loop%n, loop%vertex, loop%on_outline)
            end associate
         end if
      end associate
   end subroutine clip_pieces

   !> Radius of a piece [m]
   pure real(wp) function radius_of(bodies, piece)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: piece

      if (bodies%pieces%most > 1_ip) then
         radius_of = bodies%pieces%radius(piece)
      else
         radius_of = bodies%radius(piece)
      end if
   end function radius_of

   !> Replace the overlap of a contact of a block.
   pure subroutine replace_overlap(new, c, block)
      !> Of a contact that is joined
      type(joined_contact_t), intent(in) :: new
      !> Index of the contact
      integer(ip), intent(in) :: c
      !> The block with overlaps and motions; normal, moments, lengths, rate and direction change
      type(contact_block_t), intent(inout) :: block

      if (block%first(c) == new%body) then
         block%normal(c, :) = new%normal
         block%moment(c, :) = new%moment
      else
         block%normal(c, :) = -new%normal
         block%moment(c, :) = -new%moment([2, 1])
      end if
      ! Where the outline of the body is not inside the piece, its part of the force is zero or a couple.
      block%length(c) = max(sqrt(new%normal(1)**2 + new%normal(2)**2), least_length*sqrt(block%area(c)))
      block%length_square(c) = new%length_square
      block%depth(c) = new%depth
      block%rate(c) = dot_product(block%normal(c, :), block%velocity_first(c, :) - block%velocity_second(c, :)) &
         + (block%moment(c, 1)*block%angular_velocity(c, 1) - block%moment(c, 2)*block%angular_velocity(c, 2))
      block%direction(c, :) = -block%normal(c, :)/block%length(c)
   end subroutine replace_overlap

end module polydem_joined_contacts
