!> Damping of contacts that act at once between two bodies, where all fixed bodies together count as one: the pieces of
!> a floor or of a grain, the feet of a table.
!>
!> A dashpot for a given restitution belongs to all contacts of two bodies together (`polydem_contact_modes`), so the
!> answer does not depend on how bodies are cut. A contact alone has that of its own point, and no share. Contacts with
!> several free bodies do not share: a body of the mass M that hits n free bodies of the mass m at once has the damping
!> ratio zeta sqrt((M + n m)/(M + m)).
!>
!> Nothing is remembered. The overlaps of these contacts are found here, and again in the loop over all contacts.
module polydem_contact_shares
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_history, only: contact_history_t
   use polydem_contact_modes, only: add_spring, find_damping, find_modes, modes_t, spring_sums_t, spring_t
   use polydem_fill_block, only: fill_block
   use polydem_force_law, only: force_law_t
   use polydem_grow, only: grow
   use polydem_joined_contacts, only: join_contacts, joined_contact_t, replace_overlap
   use polydem_kinds, only: ip, min_parallel_size, wp
   use polydem_normal_damping, only: find_reaches
   use polydem_pair_list, only: pair_list_t
   implicit none
   private
   public :: contact_shares_t, find_shares, set_shares

   !> Pairs of pieces in groups: those of one free body with all fixed bodies, or of two free bodies
   type :: contact_shares_t
      !> Number of pairs of groups with several pairs
      integer(ip) :: n = 0_ip
      !> Their indices in the pair list, ascending
      integer(ip), allocatable :: pair(:)
      !> Damping force of each over 2 zeta, and its dashpot likewise; 0 for a contact alone
      real(wp), allocatable :: force(:), dashpot(:)
      !> Group of each: the slot of its free body, or for two free bodies a number above all slots
      integer(ip), allocatable, private :: group(:)
      !> The contact of each
      type(spring_t), allocatable, private :: spring(:)
      !> Whether overlaps with neighbouring pieces count as one, and what replaces them
      logical, private :: joins = .false.
      type(joined_contact_t), allocatable, private :: joined(:)
      !> Next contact of the same group in the list, 0 at its end
      integer(ip), allocatable, private :: next(:)
      !> Greatest number of a group
      integer(ip), private :: n_groups = 0_ip
      !> Number of pairs of each group; 0 between two steps, (group)
      integer(ip), allocatable, private :: count_of(:)
      !> Sums over the contacts of each group, and the modes of those with several, (group)
      type(spring_sums_t), allocatable, private :: sums(:)
      type(modes_t), allocatable, private :: modes(:)
      !> Second contact of each such group
      integer(ip), allocatable, private :: leader(:)
      !> Group of one free body with each other, (slot); 0 between two bodies
      integer(ip), allocatable, private :: group_with(:)
      !> Remembered edges of the pairs of each block, a copy
      type(contact_history_t), allocatable, private :: mine(:)
   end type contact_shares_t

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
      type(contact_shares_t), intent(inout) :: shares

      call list_pairs(bodies, pairs, shares)
      if (shares%n == 0_ip) return
      shares%joined(:shares%n)%is_joined = .false.
      shares%joins = .false.
      call find_all_springs(law, bodies, pairs, history, shares)
      if (law%overlap_measure%joins()) call join_groups(bodies, pairs, shares)
      if (shares%joins) call find_all_springs(law, bodies, pairs, history, shares)
      call divide(shares)
   end subroutine find_shares

   !> Find the contacts of all listed pairs.
   subroutine find_all_springs(law, bodies, pairs, history, shares)
      type(force_law_t), intent(in) :: law
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(contact_history_t), intent(in) :: history
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: low

      !$omp parallel do if (shares%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(law, bodies, pairs, history, shares) private(low)
      do low = 1_ip, shares%n, block_size
         call find_springs(law, bodies, pairs, history, low, min(shares%n, low + block_size - 1_ip), shares)
      end do
      !$omp end parallel do
   end subroutine find_all_springs

   !> Join the overlaps of each group with several contacts.
   subroutine join_groups(bodies, pairs, shares)
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: head, k, n
      integer(ip), allocatable :: list(:)
      type(joined_contact_t), allocatable :: new(:)

      ! The contacts of each group become a chain in ascending order; `count_of` has its head.
      do k = shares%n, 1_ip, -1_ip
         shares%next(k) = 0_ip
         if (.not. shares%spring(k)%stiffness > 0.0_wp) cycle
         shares%next(k) = shares%count_of(shares%group(k))
         shares%count_of(shares%group(k)) = k
      end do
      do k = 1_ip, shares%n
         head = shares%count_of(shares%group(k))
         shares%count_of(shares%group(k)) = 0_ip
         if (head == 0_ip) cycle
         list = [integer(ip) ::]
         n = head
         do while (n > 0_ip)
            list = [list, n]
            n = shares%next(n)
         end do
         if (size(list) < 2) cycle
         allocate (new(size(list)))
         call join_contacts(bodies, pairs%first(shares%pair(list)), pairs%second(shares%pair(list)), new)
         shares%joined(list) = new
         shares%joins = shares%joins .or. any(new%is_joined)
         deallocate (new)
      end do
   end subroutine join_groups

   !> List the pairs of groups with several pairs.
   subroutine list_pairs(bodies, pairs, shares)
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(contact_shares_t), intent(inout) :: shares

      shares%n = 0_ip
      shares%n_groups = bodies%n
      if (bodies%pieces%most > 1_ip) then
         call list_pieces(bodies, pairs, shares)
      else
         call list_bodies(bodies, pairs, shares)
      end if
      if (shares%n > 0_ip) call keep_several(shares)
   end subroutine list_pairs

   !> List pairs where every body has one piece: only those of free with fixed bodies may be several.
   subroutine list_bodies(bodies, pairs, shares)
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: found(block_size + 1_ip), from, to, k, n, p

      ! Bodies that are not free here are fixed or belong to another rank.
      if (bodies%n - size(bodies%free, kind=ip) < 2_ip) return
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
      if (from >= to) return
      do p = 1_ip, pairs%n, block_size
         n = 0_ip
         do k = p, min(pairs%n, p + block_size - 1_ip)
            found(n + 1_ip) = k
            n = n + merge(1_ip, 0_ip, (pairs%second(k) >= from .and. pairs%second(k) <= to) .or. &
                          (pairs%first(k) >= from .and. pairs%first(k) <= to))
         end do
         call reserve_pairs(shares%n + n, shares)
         do k = 1_ip, n
            associate (i => pairs%first(found(k)), j => pairs%second(found(k)))
               if (bodies%fixed(i) .neqv. bodies%fixed(j)) call append(found(k), merge(j, i, bodies%fixed(i)), shares)
            end associate
         end do
      end do
   end subroutine list_bodies

   !> List pairs where bodies have several pieces. Those with the pieces of one body as the first follow each other.
   subroutine list_pieces(bodies, pairs, shares)
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: before, i, j, k, p, upto

      call reserve_bodies(bodies%n, shares)
      upto = 0_ip
      do while (upto < pairs%n)
         p = upto + 1_ip
         before = shares%n
         i = bodies%pieces%body_of(pairs%first(p))
         do while (upto < pairs%n)
            if (pairs%first(upto + 1_ip) >= bodies%pieces%first(i + 1_ip)) exit
            upto = upto + 1_ip
         end do
         call reserve_pairs(shares%n + upto - p + 1_ip, shares)
         do k = p, upto
            j = bodies%pieces%body_of(pairs%second(k))
            if (bodies%fixed(i) .neqv. bodies%fixed(j)) then
               call append(k, merge(j, i, bodies%fixed(i)), shares)
            else if (upto > p) then
               if (shares%group_with(j) == 0_ip) then
                  shares%n_groups = shares%n_groups + 1_ip
                  shares%group_with(j) = shares%n_groups
               end if
               call append(k, shares%group_with(j), shares)
            end if
         end do
         do k = before + 1_ip, shares%n
            shares%group_with(bodies%pieces%body_of(pairs%second(shares%pair(k)))) = 0_ip
         end do
      end do
   end subroutine list_pieces

   !> Append a pair; there must be room.
   pure subroutine append(pair, group, shares)
      !> Index in the pair list
      integer(ip), intent(in) :: pair
      integer(ip), intent(in) :: group
      type(contact_shares_t), intent(inout) :: shares

      shares%n = shares%n + 1_ip
      shares%pair(shares%n) = pair
      shares%group(shares%n) = group
   end subroutine append

   !> Keep the pairs of groups with several of them.
   subroutine keep_several(shares)
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: k, n, n_all

      call reserve_groups(shares%n_groups, shares)
      n_all = shares%n
      do k = 1_ip, n_all
         shares%count_of(shares%group(k)) = shares%count_of(shares%group(k)) + 1_ip
      end do
      n = 0_ip
      do k = 1_ip, n_all
         if (shares%count_of(shares%group(k)) < 2_ip) cycle
         n = n + 1_ip
         shares%pair(n) = shares%pair(k)
         ! Exchanged, not overwritten: the counts of all groups are still to be cleared.
         if (n < k) shares%group([n, k]) = shares%group([k, n])
      end do
      shares%n = n
      do k = 1_ip, n_all
         shares%count_of(shares%group(k)) = 0_ip
      end do
   end subroutine keep_several

   !> Find some listed contacts, at most a block.
   subroutine find_springs(law, bodies, pairs, history, low, high, shares)
      type(force_law_t), intent(in) :: law
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(contact_history_t), intent(in) :: history
      !> First and last pair of the list
      integer(ip), intent(in) :: low, high
      !> The list; what belongs to these pairs is set
      type(contact_shares_t), intent(inout) :: shares
      type(contact_block_t) :: block
      real(wp) :: reach(block_size)
      integer(ip) :: first(block_size), second(block_size), c, n, next, tested

      n = high - low + 1_ip
      do c = 1_ip, n
         first(c) = pairs%first(shares%pair(low + c - 1_ip))
         second(c) = pairs%second(shares%pair(low + c - 1_ip))
      end do
      shares%spring(low:high)%stiffness = 0.0_wp
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
            call fill_block(bodies, first(:n), second(:n), law%overlap_measure, 1_ip, next, tested, mine, block)
            do c = 1_ip, block%n
               associate (new => shares%joined(low + block%pair(c) - 1_ip))
                  if (new%is_joined) call replace_overlap(new, c, block)
               end associate
            end do
            call law%apply_elastic(bodies, block, mine)
            call find_reaches(block, reach)
            do c = 1_ip, block%n
               shares%spring(low + block%pair(c) - 1_ip) = spring_of(bodies, block, c, reach(c), &
                                                                     law%pairs%stiffness%one)
            end do
         end do
      end associate
   end subroutine find_springs

   !> A contact as the spring of a free body, the first one of two
   pure function spring_of(bodies, block, c, reach, stiffness) result(spring)
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(in) :: block
      !> Index of the contact
      integer(ip), intent(in) :: c
      !> Length by which the gradient of the area is divided [m]
      real(wp), intent(in) :: reach
      !> Stiffness E of the law [N/m2]
      real(wp), intent(in) :: stiffness
      type(spring_t) :: spring

      spring%stiffness = stiffness*reach*block%inverse_length(c)
      spring%rate = block%rate(c)/reach
      spring%elastic = block%elastic(c)
      if (bodies%fixed(block%first(c))) then
         spring%row = [-block%normal(c, :), -block%moment(c, 2)]/reach
         spring%mobility = mobility_of(bodies, block%second(c), [0.0_wp, 0.0_wp])
      else
         spring%row = [block%normal(c, :), block%moment(c, 1)]/reach
         spring%mobility = mobility_of(bodies, block%first(c), [0.0_wp, 0.0_wp])
         if (.not. bodies%fixed(block%second(c))) spring%mobility = spring%mobility &
            + mobility_of(bodies, block%second(c), block%arm_second(c, :) - block%arm_first(c, :))
      end if
   end function spring_of

   !> Mobility of a point that is fixed to a body: velocities along x and y and angular velocity per impulses, (3, 3)
   pure function mobility_of(bodies, s, place) result(mobility)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Place of the point relative to the centre [m]
      real(wp), intent(in) :: place(2)
      real(wp) :: mobility(3, 3), lever(3)

      lever = [-place(2), place(1), 1.0_wp]
      mobility = bodies%inverse_inertia(s)*spread(lever, 2, 3)*spread(lever, 1, 3)
      mobility(1, 1) = mobility(1, 1) + bodies%inverse_mass(s)
      mobility(2, 2) = mobility(2, 2) + bodies%inverse_mass(s)
   end function mobility_of

   !> Compute the damping of all listed contacts.
   subroutine divide(shares)
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: k, n

      do k = 1_ip, shares%n
         shares%sums(shares%group(k)) = spring_sums_t()
      end do
      n = 0_ip
      do k = 1_ip, shares%n
         if (.not. shares%spring(k)%stiffness > 0.0_wp) cycle
         call add_spring(shares%spring(k), shares%sums(shares%group(k)))
         if (shares%sums(shares%group(k))%n /= 2_ip) cycle
         n = n + 1_ip
         shares%leader(n) = k
      end do
      !$omp parallel do if (n > min_parallel_size) schedule(static) default(none) shared(n, shares) private(k)
      do k = 1_ip, n
         associate (leader => shares%leader(k), g => shares%group(shares%leader(k)))
            call find_modes(shares%spring(leader)%mobility, shares%sums(g), shares%modes(g))
         end associate
      end do
      !$omp end parallel do
      do k = 1_ip, shares%n
         shares%force(k) = 0.0_wp
         shares%dashpot(k) = 0.0_wp
         associate (spring => shares%spring(k), sums => shares%sums(shares%group(k)))
            ! A contact alone is not shared, however many pairs the boxes make: no bit depends on the boxes.
            if (spring%stiffness > 0.0_wp .and. sums%n > 1_ip) &
               call find_damping(spring, shares%modes(shares%group(k)), shares%force(k), shares%dashpot(k))
         end associate
      end do
   end subroutine divide

   !> Set the shares of a block of contacts: 0 for those that are alone.
   pure subroutine set_shares(shares, cursor, block)
      type(contact_shares_t), intent(in) :: shares
      !> Listed pairs up to this one are lower than all pairs of the blocks so far
      integer(ip), intent(inout) :: cursor
      !> Contacts in descending order of their pairs; `shared_force` and `shared_dashpot` are set
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: c

      block%shared_force(:block%n) = 0.0_wp
      block%shared_dashpot(:block%n) = 0.0_wp
      c = 1_ip
      do while (cursor > 0_ip .and. c <= block%n)
         associate (p => shares%pair(cursor))
            if (p < block%pair(block%n)) return
            do while (block%pair(c) > p)
               c = c + 1_ip
            end do
            if (block%pair(c) == p) then
               block%shared_force(c) = shares%force(cursor)
               block%shared_dashpot(c) = shares%dashpot(cursor)
               if (shares%joined(cursor)%is_joined) call replace_overlap(shares%joined(cursor), c, block)
            end if
         end associate
         cursor = cursor - 1_ip
      end do
   end subroutine set_shares

   !> Make room for n bodies.
   subroutine reserve_bodies(n, shares)
      integer(ip), intent(in) :: n
      type(contact_shares_t), intent(inout) :: shares

      if (allocated(shares%group_with)) then
         if (size(shares%group_with) >= n) return
         deallocate (shares%group_with)
      end if
      allocate (shares%group_with(n), source=0_ip)
   end subroutine reserve_bodies

   !> Make room for n groups.
   subroutine reserve_groups(n, shares)
      integer(ip), intent(in) :: n
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: room

      room = n
      if (allocated(shares%count_of)) then
         if (size(shares%count_of) >= n) return
         room = max(2_ip*size(shares%count_of, kind=ip), n)
         deallocate (shares%count_of, shares%sums, shares%modes, shares%leader)
      end if
      allocate (shares%count_of(room), source=0_ip)
      allocate (shares%sums(room), shares%modes(room), shares%leader(room))
   end subroutine reserve_groups

   !> Make room for n pairs.
   subroutine reserve_pairs(n, shares)
      integer(ip), intent(in) :: n
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: room, k

      room = 0_ip
      if (allocated(shares%pair)) room = size(shares%pair, kind=ip)
      if (room >= n) return
      room = max(2_ip*room, n)
      call grow(shares%pair, shares%n, room)
      call grow(shares%group, shares%n, room)
      if (allocated(shares%force)) deallocate (shares%force, shares%dashpot, shares%spring, shares%joined, &
                                                shares%next, shares%mine)
      allocate (shares%force(room), shares%dashpot(room), shares%spring(room), shares%joined(room), shares%next(room))
      allocate (shares%mine((room - 1_ip)/block_size + 1_ip))
      do k = 1_ip, size(shares%mine, kind=ip)
         allocate (shares%mine(k)%features(block_size))
      end do
   end subroutine reserve_pairs

end module polydem_contact_shares
