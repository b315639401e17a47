!> Ownership and global order of bodies, of their vertices, and of pairs of bodies.
!>
!> A rank owns the free bodies that it moves. The root rank also owns the fixed bodies, which all ranks have. Two ranks
!> can have the same pair of bodies. Its owner is the owner of the *leading* body: the first body, or the second one if
!> the first is fixed.
module polydem_ownership
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_pair_keys, only: pair_key
   use polydem_row_distribution, only: row_distribution_t
   use polydem_kinds, only: ip, lp
   implicit none
   private
   public :: owns_body, owns_pair, find_owned_pairs, order_bodies, order_vertices, order_pairs, &
      order_pieces

contains

   !> Whether a rank owns a body
   elemental logical function owns_body(is_root, in_halo, is_fixed)
      !> Whether the rank is the root rank
      logical, intent(in) :: is_root
      !> Whether the body is in the halo; whether it is fixed
      logical, intent(in) :: in_halo, is_fixed

      owns_body = .not. in_halo .and. (is_root .or. .not. is_fixed)
   end function owns_body

   !> Whether this rank owns a pair of bodies, not both fixed
   pure logical function owns_pair(bodies, first, second)
      type(bodies_t), intent(in) :: bodies
      !> Slots of the two bodies, in ascending order
      integer(ip), intent(in) :: first, second

      owns_pair = .not. bodies%in_halo(merge(second, first, bodies%fixed(first)))
   end function owns_pair

   !> Find out which of some pairs this rank owns, as `owns_pair` does, in a loop over plain arrays.
   pure subroutine find_owned_pairs(n, one, other, in_halo, fixed, owned)
      !> Number of pairs, and slots of their bodies, in any order
      integer(ip), intent(in) :: n, one(n), other(n)
      !> Whether each body is in the halo, and whether it is fixed, (slot)
      logical, intent(in), contiguous :: in_halo(:), fixed(:)
      !> Whether the pair is owned
      logical, intent(inout) :: owned(n)
      integer(ip) :: low, high, k

      do k = 1_ip, n
         low = min(one(k), other(k))
         high = max(one(k), other(k))
         owned(k) = .not. in_halo(merge(high, low, fixed(low)))
      end do
   end subroutine find_owned_pairs

   !> Find the global order of columns over the bodies. Collective.
   subroutine order_bodies(comm, bodies, blocks, slots)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Destination of each row
      type(row_distribution_t), intent(inout) :: blocks
      !> Slots of some bodies, ascending; absent: all bodies
      integer(ip), intent(in), optional :: slots(:)
      integer(ip) :: s

      if (present(slots)) then
         call order_parts(comm, bodies, slots, blocks, slots)
      else
         call order_parts(comm, bodies, [(s, s=1_ip, bodies%n)], blocks)
      end if
   end subroutine order_bodies

   !> Find the global order of columns over parts of bodies. Collective.
   subroutine order_parts(comm, bodies, body, blocks, rows)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body of each part, ascending; the parts of one body have the same order on all ranks
      integer(ip), intent(in) :: body(:)
      !> Destination of each row
      type(row_distribution_t), intent(inout) :: blocks
      !> Index of each part in the local columns; absent: its position in this list
      integer(ip), intent(in), optional :: rows(:)
      integer(lp), allocatable :: key(:)
      integer(ip), allocatable :: slot(:)
      integer(ip) :: k, n

      allocate (key(size(body)), slot(size(body)))
      n = 0_ip
      do k = 1_ip, size(body, kind=ip)
         associate (s => body(k))
            if (.not. owns_body(comm%is_root(), bodies%in_halo(s), bodies%fixed(s))) cycle
            n = n + 1_ip
            key(n) = pair_key(bodies%global_index(s), k)
            slot(n) = k
            if (present(rows)) slot(n) = rows(k)
         end associate
      end do
      call blocks%lay_out(comm, bodies%n_all, key(:n), slot(:n))
   end subroutine order_parts

   !> Find the global order of columns over the vertices of bodies. Collective.
   subroutine order_vertices(comm, bodies, blocks, slots)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Destination of each row
      type(row_distribution_t), intent(inout) :: blocks
      !> Slots of the bodies whose vertices are ordered, ascending; absent: all bodies
      integer(ip), intent(in), optional :: slots(:)
      integer(ip), allocatable :: body(:), vertex(:)
      logical, allocatable :: is_chosen(:)
      integer(ip) :: s

      allocate (body(bodies%pieces%vertex_start(bodies%n + 1_ip) - 1_ip))
      do s = 1_ip, bodies%n
         body(bodies%pieces%vertex_start(s):bodies%pieces%vertex_start(s + 1_ip) - 1_ip) = s
      end do
      if (.not. present(slots)) then
         call order_parts(comm, bodies, body, blocks)
         return
      end if
      allocate (is_chosen(bodies%n), source=.false.)
      is_chosen(slots) = .true.
      vertex = pack([(s, s=1_ip, size(body, kind=ip))], is_chosen(body))
      call order_parts(comm, bodies, body(vertex), blocks, vertex)
   end subroutine order_vertices

   !> Find the global order of columns over pairs of bodies, such as contacts. Pairs of two fixed bodies are not
   !> allowed. Collective.
   subroutine order_pairs(comm, bodies, first, second, blocks)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Slots of the two bodies of each pair, in ascending order
      integer(ip), intent(in) :: first(:), second(:)
      !> Destination of each row
      type(row_distribution_t), intent(inout) :: blocks

      call lay_out_pairs(comm, bodies, first, second, bodies%global_index(first), bodies%global_index(second), &
                         bodies%n_all, blocks)
   end subroutine order_pairs

   !> Find the global order of columns over pairs of pieces, of which not both bodies are fixed. Collective.
   subroutine order_pieces(comm, bodies, first, second, blocks)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> The two pieces of each pair, in ascending order
      integer(ip), intent(in) :: first(:), second(:)
      !> Destination of each row
      type(row_distribution_t), intent(inout) :: blocks
      integer(ip), allocatable :: body(:, :), place(:, :)
      integer(ip) :: k

      allocate (body(size(first), 2), place(size(first), 2))
      do k = 1_ip, size(first, kind=ip)
         body(k, 1) = bodies%pieces%body_of(first(k))
         body(k, 2) = bodies%pieces%body_of(second(k))
         place(k, :) = [place_of(first(k)), place_of(second(k))]
      end do
      call lay_out_pairs(comm, bodies, body(:, 1), body(:, 2), place(:, 1), place(:, 2), &
                         bodies%n_all*bodies%pieces%most, blocks)

   contains

      !> Place of a piece if every body had the greatest number of pieces, from 1
      pure integer(ip) function place_of(p)
         integer(ip), intent(in) :: p

         associate (s => bodies%pieces%body_of(p))
            place_of = (bodies%global_index(s) - 1_ip)*bodies%pieces%most + (p - bodies%pieces%first_of(s)) + 1_ip
         end associate
      end function place_of

   end subroutine order_pieces

   !> Find the global order of pairs from the places of their two members among all. Collective.
   subroutine lay_out_pairs(comm, bodies, first, second, first_place, second_place, n_places, blocks)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Slots of the two bodies of each pair
      integer(ip), intent(in) :: first(:), second(:)
      !> Places of the two members of each pair, in ascending order, and number of places
      integer(ip), intent(in) :: first_place(:), second_place(:), n_places
      type(row_distribution_t), intent(inout) :: blocks
      integer(lp), allocatable :: key(:)
      integer(ip), allocatable :: row(:)
      integer(ip) :: k, n

      allocate (key(size(first)), row(size(first)))
      n = 0_ip
      do k = 1_ip, size(first, kind=ip)
         if (.not. owns_pair(bodies, first(k), second(k))) cycle
         n = n + 1_ip
         key(n) = pair_key(first_place(k), second_place(k))
         row(n) = k
      end do
      call blocks%lay_out(comm, n_places, key(:n), row(:n))
   end subroutine lay_out_pairs

end module polydem_ownership
