!> Shares of the contacts of a free body with several fixed bodies, such as the pieces of one floor.
!>
!> A dashpot for a given restitution, c = 2 zeta sqrt(m k), belongs to all contacts that stop the body together. If each
!> of n equal contacts had it for its own stiffness k, the sum would be sqrt(n) times too strong: a floor that is cut
!> into five pieces would damp twice as much as the whole one. Contact i with the fixed body i gets
!>
!>     c_i = 2 zeta sqrt(m k_i s_i),     s_i = k_i/sum_j k_j (n_i . n_j)^2,
!>
!> where the sum runs over all contacts of the free body with fixed bodies. Then the sum of all c_i is 2 zeta sqrt(m k)
!> for the stiffness k of all, however the floor is cut, and a contact alone, or one among others in perpendicular
!> directions, has the share 1.
!>
!> The shares are those of the present step, so nothing is remembered. The contacts in question are few: their overlaps
!> are found here, before the loop over all contacts finds them again.
module polydem_wall_shares
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_history, only: contact_history_t
   use polydem_fill_block, only: fill_block
   use polydem_force_law, only: force_law_t
   use polydem_grow, only: grow
   use polydem_kinds, only: ip, min_parallel_size, wp
   use polydem_pair_list, only: pair_list_t
   use polydem_pieces, only: pieces_t
   implicit none
   private
   public :: wall_shares_t, find_shares, set_shares

   !> Pairs of free bodies that have pairs with several fixed bodies
   type :: wall_shares_t
      !> Number of these pairs
      integer(ip) :: n = 0_ip
      !> Their indices in the pair list, ascending, and the slots of their free bodies
      integer(ip), allocatable :: pair(:), body(:)
      !> Square root of the share of each
      real(wp), allocatable :: root(:)
      !> Ratio L/l of each contact, 0 if the polygons do not overlap, and its direction, (x or y, pair)
      real(wp), allocatable, private :: ratio(:), direction(:, :)
      !> Number of pairs, then of contacts, of each free body with fixed bodies, (slot); 0 between two steps
      integer(ip), allocatable, private :: count_of(:)
      !> Sums of L/l n n^T over the contacts of each free body: xx, xy, yy, (3, slot)
      real(wp), allocatable, private :: tensor(:, :)
      !> Remembered edges of the pairs of each block, a copy
      type(contact_history_t), allocatable, private :: mine(:)
   end type wall_shares_t

contains

   !> Find the shares of the present step.
   subroutine find_shares(law, bodies, pairs, history, shares)
      type(force_law_t), intent(in) :: law
      !> Bodies with rotated polygons
      type(bodies_t), intent(in) :: bodies
      !> Pairs of the list of neighbours
      type(pair_list_t), intent(in) :: pairs
      !> Contact history of the pairs; it is not changed
      type(contact_history_t), intent(in) :: history
      type(wall_shares_t), intent(inout) :: shares
      integer(ip) :: low

      call list_pairs(bodies, pairs, shares)
      if (shares%n == 0_ip) return
      !$omp parallel do if (shares%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(law, bodies, pairs, history, shares) private(low)
      do low = 1_ip, shares%n, block_size
         call find_ratios(law, bodies, pairs, history, low, min(shares%n, low + block_size - 1_ip), shares)
      end do
      !$omp end parallel do
      call divide(shares)
   end subroutine find_shares

   !> List the pairs of free bodies that have several fixed partners.
   subroutine list_pairs(bodies, pairs, shares)
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(wall_shares_t), intent(inout) :: shares
      integer(ip) :: found(block_size + 1_ip), from, to, k, n, p

      shares%n = 0_ip
      if (bodies%n - size(bodies%free, kind=ip) < 2_ip) return
      call reserve_bodies(bodies%n, shares)
      from = 1_ip
      do while (from <= bodies%n)
         if (bodies%fixed(from)) exit
         from = from + 1_ip
      end do
      to = bodies%n
      do while (to >= from)
         if (bodies%fixed(to)) exit
         to = to - 1_ip
      end do
      if (bodies%pieces%most > 1_ip) then
         from = bodies%pieces%first(from)
         to = bodies%pieces%first(to + 1_ip) - 1_ip
      end if
      do p = 1_ip, pairs%n, block_size
         n = 0_ip
         do k = p, min(pairs%n, p + block_size - 1_ip)
            found(n + 1_ip) = k
            n = n + merge(1_ip, 0_ip, (pairs%second(k) >= from .and. pairs%second(k) <= to) .or. &
                          (pairs%first(k) >= from .and. pairs%first(k) <= to))
         end do
         if (n > 0_ip) call append(bodies%fixed, bodies%pieces, pairs, found(:n), shares)
      end do
      call keep_several(shares)
   end subroutine list_pairs

   !> Append those of some pairs that have one fixed body.
   subroutine append(fixed, pieces, pairs, found, shares)
      logical, intent(in), contiguous :: fixed(:)
      type(pieces_t), intent(in) :: pieces
      type(pair_list_t), intent(in) :: pairs
      !> Indices of pairs, ascending
      integer(ip), intent(in) :: found(:)
      type(wall_shares_t), intent(inout) :: shares
      integer(ip) :: k

      call reserve_pairs(shares%n + size(found, kind=ip), shares)
      do k = 1_ip, size(found, kind=ip)
         associate (i => pieces%body_of(pairs%first(found(k))), j => pieces%body_of(pairs%second(found(k))))
            if (fixed(i) .eqv. fixed(j)) cycle
            shares%n = shares%n + 1_ip
            shares%pair(shares%n) = found(k)
            shares%body(shares%n) = merge(j, i, fixed(i))
         end associate
         shares%count_of(shares%body(shares%n)) = shares%count_of(shares%body(shares%n)) + 1_ip
      end do
   end subroutine append

   !> Keep the pairs of bodies with several of them, and clear the counts.
   subroutine keep_several(shares)
      type(wall_shares_t), intent(inout) :: shares
      integer(ip) :: k, n, n_all

      n_all = shares%n
      n = 0_ip
      do k = 1_ip, n_all
         if (shares%count_of(shares%body(k)) < 2_ip) cycle
         n = n + 1_ip
         shares%pair(n) = shares%pair(k)
         ! Exchanged, not overwritten: the counts of all bodies are still to be cleared.
         if (n < k) call swap(shares%body(n), shares%body(k))
      end do
      shares%n = n
      do k = 1_ip, n_all
         shares%count_of(shares%body(k)) = 0_ip
      end do
   end subroutine keep_several

   !> Exchange two slots.
   elemental subroutine swap(a, b)
      integer(ip), intent(inout) :: a, b
      integer(ip) :: c

      c = a
      a = b
      b = c
   end subroutine swap

   !> Find ratio and direction of some listed contacts, at most a block.
   subroutine find_ratios(law, bodies, pairs, history, low, high, shares)
      type(force_law_t), intent(in) :: law
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(contact_history_t), intent(in) :: history
      !> First and last pair of the list
      integer(ip), intent(in) :: low, high
      !> The list; ratio and direction of these pairs are set
      type(wall_shares_t), intent(inout) :: shares
      type(contact_block_t) :: block
      integer(ip) :: first(block_size), second(block_size), c, k, n, next, tested

      n = high - low + 1_ip
      do c = 1_ip, n
         first(c) = pairs%first(shares%pair(low + c - 1_ip))
         second(c) = pairs%second(shares%pair(low + c - 1_ip))
      end do
      shares%ratio(low:high) = 0.0_wp
      next = n
      tested = n + 1_ip
      associate (mine => shares%mine((low - 1_ip)/block_size + 1_ip))
         if (allocated(history%features)) then
            do c = 1_ip, n
               mine%features(c) = history%features(shares%pair(low + c - 1_ip))
            end do
         else
            mine%features(:n) = 0_ip
         end if
         do while (next >= 1_ip)
            call fill_block(bodies, first(:n), second(:n), law%needs_effective_area, 1_ip, next, tested, mine, &
                         block)
            call law%apply_elastic(bodies, block, mine)
            do c = 1_ip, block%n
               k = low + block%pair(c) - 1_ip
               shares%ratio(k) = block%length(c)*block%inverse_length(c)
               shares%direction(:, k) = block%direction(c, :)
            end do
         end do
      end associate
   end subroutine find_ratios

   !> Compute the shares from the ratios and directions of all listed contacts.
   subroutine divide(shares)
      type(wall_shares_t), intent(inout) :: shares
      integer(ip) :: k
      real(wp) :: whole

      do k = 1_ip, shares%n
         shares%tensor(:, shares%body(k)) = 0.0_wp
      end do
      do k = 1_ip, shares%n
         associate (t => shares%tensor(:, shares%body(k)), n => shares%direction(:, k), r => shares%ratio(k))
            if (.not. r > 0.0_wp) cycle
            t = t + r*[n(1)*n(1), n(1)*n(2), n(2)*n(2)]
         end associate
         shares%count_of(shares%body(k)) = shares%count_of(shares%body(k)) + 1_ip
      end do
      do k = 1_ip, shares%n
         shares%root(k) = 1.0_wp
         associate (t => shares%tensor(:, shares%body(k)), n => shares%direction(:, k), r => shares%ratio(k))
            ! A contact alone has exactly 1, however many pairs the boxes make: no bit depends on the boxes.
            if (.not. r > 0.0_wp .or. shares%count_of(shares%body(k)) < 2_ip) cycle
            whole = n(1)*n(1)*t(1) + 2.0_wp*n(1)*n(2)*t(2) + n(2)*n(2)*t(3)
            shares%root(k) = sqrt(min(1.0_wp, r/whole))
         end associate
      end do
      do k = 1_ip, shares%n
         shares%count_of(shares%body(k)) = 0_ip
      end do
   end subroutine divide

   !> Set the shares of a block of contacts: 1 for those that are not listed.
   pure subroutine set_shares(shares, cursor, block)
      type(wall_shares_t), intent(in) :: shares
      !> Listed pairs up to this one are lower than all pairs of the blocks so far
      integer(ip), intent(inout) :: cursor
      !> Contacts in descending order of their pairs; `share_root` is set
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: c

      block%share_root(:block%n) = 1.0_wp
      c = 1_ip
      do while (cursor > 0_ip .and. c <= block%n)
         associate (p => shares%pair(cursor))
            if (p < block%pair(block%n)) return
            do while (block%pair(c) > p)
               c = c + 1_ip
            end do
            if (block%pair(c) == p) block%share_root(c) = shares%root(cursor)
         end associate
         cursor = cursor - 1_ip
      end do
   end subroutine set_shares

   !> Make room for n bodies.
   subroutine reserve_bodies(n, shares)
      integer(ip), intent(in) :: n
      type(wall_shares_t), intent(inout) :: shares

      if (allocated(shares%count_of)) then
         if (size(shares%count_of) >= n) return
         deallocate (shares%count_of, shares%tensor)
      end if
      allocate (shares%count_of(n), source=0_ip)
      allocate (shares%tensor(3, n))
   end subroutine reserve_bodies

   !> Make room for n pairs.
   subroutine reserve_pairs(n, shares)
      integer(ip), intent(in) :: n
      type(wall_shares_t), intent(inout) :: shares
      integer(ip) :: room, k

      room = 0_ip
      if (allocated(shares%pair)) room = size(shares%pair, kind=ip)
      if (room >= n) return
      room = max(2_ip*room, n)
      call grow(shares%pair, shares%n, room)
      call grow(shares%body, shares%n, room)
      if (allocated(shares%root)) deallocate (shares%root, shares%ratio, shares%direction, shares%mine)
      allocate (shares%root(room), shares%ratio(room), shares%direction(2, room))
      allocate (shares%mine((room - 1_ip)/block_size + 1_ip))
      do k = 1_ip, size(shares%mine, kind=ip)
         allocate (shares%mine(k)%features(block_size))
      end do
   end subroutine reserve_pairs

end module polydem_wall_shares
