!> Damping of contacts that act at once between two bodies, where all fixed bodies together count as one: the pieces of
!> a floor or of a grain, the feet of a table.
!>
!> A dashpot for a given restitution belongs to all contacts of two bodies together (`polydem_shared_dashpots`), so the
!> answer does not depend on how bodies are cut. A contact alone has that of its own point, and no share. Contacts with
!> several free bodies do not share: a body of the mass M that hits n free bodies of the mass m at once has the damping
!> ratio zeta sqrt((M + n m)/(M + m)).
!>
!> Nothing is remembered. The overlaps of these contacts are found here, and again in the loop over all contacts.
module polydem_contact_shares
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_groups, only: contact_groups_t, list_groups
   use polydem_contact_history, only: contact_history_t
   use polydem_shared_dashpots, only: add_spring, find_damping, find_motion, joined_spring, relative_motion_t, &
      spring_sums_t, spring_t
   use polydem_fill_block, only: fill_block
   use polydem_force_law, only: force_law_t
   use polydem_joined_contacts, only: join_contacts, joined_contact_t, overlap_loop_t, replace_overlap
   use polydem_kinds, only: ip, min_parallel_size, wp
   use polydem_normal_damping, only: find_reaches
   use polydem_pair_list, only: pair_list_t
   implicit none
   private
   public :: contact_shares_t, find_shares, set_shares

   !> Damping of contacts in groups
   type :: contact_shares_t
      !> The contacts of groups with several pairs
      type(contact_groups_t) :: groups
      !> Damping force of each over 2 zeta, and its dashpot likewise; 0 for a contact alone
      real(wp), allocatable, private :: force(:), dashpot(:)
      !> The contact of each
      type(spring_t), allocatable, private :: spring(:)
      !> Whether overlaps with neighbouring pieces count as one, and what replaces them
      logical, private :: joins = .false.
      type(joined_contact_t), allocatable, private :: joined(:)
      !> Members of groups with several contacts: number in the list, both pieces, and work space
      integer(ip), allocatable, private :: member(:), pieces(:, :)
      type(overlap_loop_t), allocatable, private :: loops(:)
      type(joined_contact_t), allocatable, private :: new(:)
      !> Contacts before they are joined, and sums over those that are, by the first one of them
      type(spring_t), allocatable, private :: part(:)
      type(spring_sums_t), allocatable, private :: joint(:)
      !> Next contact of the same group in the list, 0 at its end; first one of each group, 0 between two steps
      integer(ip), allocatable, private :: next(:), head(:)
      !> Sums over the contacts of each group, and the motion of those with several, (group)
      type(spring_sums_t), allocatable, private :: sums(:)
      type(relative_motion_t), allocatable, private :: motion(:)
      !> Second contact of each such group
      integer(ip), allocatable, private :: leader(:)
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

      call list_groups(bodies, pairs, shares%groups)
      if (shares%groups%n == 0_ip) return
      call reserve(shares)
      shares%joined(:shares%groups%n)%is_joined = .false.
      shares%joins = .false.
      call find_all_springs(law, bodies, pairs, history, shares)
      if (law%overlap_measure%per_length) call join_groups(bodies, pairs, shares)
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

      !$omp parallel do if (shares%groups%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(law, bodies, pairs, history, shares) private(low)
      do low = 1_ip, shares%groups%n, block_size
         call find_springs(law, bodies, pairs, history, low, min(shares%groups%n, low + block_size - 1_ip), shares)
      end do
      !$omp end parallel do
   end subroutine find_all_springs

   !> Join the overlaps of each group with several contacts.
   subroutine join_groups(bodies, pairs, shares)
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: head, j, k, m, n, n_groups

      ! The contacts of each group become a chain in ascending order; `head` has its first one.
      do k = shares%groups%n, 1_ip, -1_ip
         shares%next(k) = 0_ip
         if (.not. shares%spring(k)%stiffness > 0.0_wp) cycle
         shares%next(k) = shares%head(shares%groups%group(k))
         shares%head(shares%groups%group(k)) = k
      end do
      ! The groups with several contacts, one after another; `leader` has the first contact of each, and the end.
      n_groups = 0_ip
      m = 0_ip
      do k = 1_ip, shares%groups%n
         head = shares%head(shares%groups%group(k))
         shares%head(shares%groups%group(k)) = 0_ip
         if (head == 0_ip) cycle
         if (shares%next(head) == 0_ip) cycle
         n_groups = n_groups + 1_ip
         shares%leader(n_groups) = m + 1_ip
         n = head
         do while (n > 0_ip)
            m = m + 1_ip
            shares%member(m) = n
            shares%pieces(:, m) = [pairs%first(shares%groups%pair(n)), pairs%second(shares%groups%pair(n))]
            n = shares%next(n)
         end do
      end do
      if (m == 0_ip) return
      shares%leader(n_groups + 1_ip) = m + 1_ip
      call reserve_loops(m, shares)
      !$omp parallel do if (m > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(bodies, shares, n_groups) private(j)
      do j = 1_ip, n_groups
         associate (low => shares%leader(j), high => shares%leader(j + 1_ip) - 1_ip)
            call join_contacts(bodies, shares%pieces(:, low:high), shares%loops(low:high), shares%new(low:high))
            call keep_joined(low, high, shares)
         end associate
      end do
      !$omp end parallel do
      shares%joins = any(shares%new(:m)%is_joined)
   end subroutine join_groups

   !> Keep what became of the contacts of one group.
   pure subroutine keep_joined(low, high, shares)
      !> Its first and last member
      integer(ip), intent(in) :: low, high
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: k

      do k = low, high
         associate (joined => shares%joined(shares%member(k)))
            joined = shares%new(k)
            if (joined%is_joined) joined%first = shares%member(low + joined%first - 1_ip)
         end associate
      end do
   end subroutine keep_joined

   !> Make room for n members of groups with several contacts.
   subroutine reserve_loops(n, shares)
      integer(ip), intent(in) :: n
      type(contact_shares_t), intent(inout) :: shares

      if (allocated(shares%loops)) then
         if (size(shares%loops) >= n) return
         deallocate (shares%loops, shares%new)
      end if
      allocate (shares%loops(n + n/2_ip), shares%new(n + n/2_ip))
   end subroutine reserve_loops

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
         first(c) = pairs%first(shares%groups%pair(low + c - 1_ip))
         second(c) = pairs%second(shares%groups%pair(low + c - 1_ip))
      end do
      shares%spring(low:high)%stiffness = 0.0_wp
      next = n
      tested = n + 1_ip
      associate (mine => shares%mine((low - 1_ip)/block_size + 1_ip))
         if (allocated(history%features)) then
            do c = 1_ip, n
               mine%features(c) = history%features(shares%groups%pair(low + c - 1_ip))
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

      if (shares%joins) call join_springs(shares)
      do k = 1_ip, shares%groups%n
         shares%sums(shares%groups%group(k)) = spring_sums_t()
      end do
      n = 0_ip
      do k = 1_ip, shares%groups%n
         if (.not. shares%spring(k)%stiffness > 0.0_wp .or. is_other_part(shares%joined(k), k)) cycle
         associate (sums => shares%sums(shares%groups%group(k)))
            call add_spring(shares%spring(k), sums)
            ! A contact alone is not shared, however many pairs the boxes make: no bit depends on the boxes.
            if (.not. (sums%n == 2_ip .or. (sums%n == 1_ip .and. shares%joined(k)%is_joined))) cycle
         end associate
         n = n + 1_ip
         shares%leader(n) = k
      end do
      !$omp parallel do if (n > min_parallel_size) schedule(static) default(none) shared(n, shares) private(k)
      do k = 1_ip, n
         associate (leader => shares%leader(k), g => shares%groups%group(shares%leader(k)))
            call find_motion(shares%spring(leader)%mobility, shares%sums(g), shares%motion(g))
         end associate
      end do
      !$omp end parallel do
      do k = 1_ip, shares%groups%n
         shares%force(k) = 0.0_wp
         shares%dashpot(k) = 0.0_wp
         associate (g => shares%groups%group(k), joined => shares%joined(k))
            if (.not. shares%spring(k)%stiffness > 0.0_wp .or. is_other_part(joined, k)) cycle
            if (shares%sums(g)%n > 1_ip .or. joined%is_joined) &
               call find_damping(shares%spring(k), shares%sums(g), shares%motion(g), shares%force(k), shares%dashpot(k))
         end associate
      end do
      if (shares%joins) call divide_joined(shares)
   end subroutine divide

   !> Whether a contact is a part of one that is joined, and not the first
   elemental logical function is_other_part(joined, k)
      type(joined_contact_t), intent(in) :: joined
      !> Index in the list
      integer(ip), intent(in) :: k

      is_other_part = joined%is_joined .and. joined%first /= k
   end function is_other_part

   !> Replace the first of contacts that are joined by the spring of all; `part` keeps each.
   subroutine join_springs(shares)
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: k

      shares%part(:shares%groups%n) = shares%spring(:shares%groups%n)
      shares%joint(:shares%groups%n) = spring_sums_t()
      do k = 1_ip, shares%groups%n
         if (shares%joined(k)%is_joined .and. shares%part(k)%stiffness > 0.0_wp) &
            call add_spring(shares%part(k), shares%joint(shares%joined(k)%first))
      end do
      do k = 1_ip, shares%groups%n
         if (shares%joint(k)%n > 0_ip) shares%spring(k) = joined_spring(shares%joint(k), shares%part(k)%mobility)
      end do
   end subroutine join_springs

   !> Divide the damping of contacts that are joined among them as their elastic forces, and the dashpots so that those
   !> against tilts add up.
   subroutine divide_joined(shares)
      type(contact_shares_t), intent(inout) :: shares
      real(wp) :: share
      integer(ip) :: k

      do k = shares%groups%n, 1_ip, -1_ip
         if (.not. shares%joined(k)%is_joined .or. .not. shares%part(k)%stiffness > 0.0_wp) cycle
         associate (first => shares%joined(k)%first)
            share = shares%part(k)%elastic/max(shares%spring(first)%elastic, tiny(share))
            shares%dashpot(k) = shares%dashpot(first)*(shares%spring(first)%stiffness/shares%part(k)%stiffness)
            shares%force(k) = shares%force(first)*share
         end associate
      end do
   end subroutine divide_joined

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
         associate (p => shares%groups%pair(cursor))
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

   !> Make room for all listed pairs and their groups.
   subroutine reserve(shares)
      type(contact_shares_t), intent(inout) :: shares
      integer(ip) :: room, k

      room = size(shares%groups%pair, kind=ip)
      if (allocated(shares%force)) then
         if (size(shares%force) < room) deallocate (shares%force, shares%dashpot, shares%spring, shares%joined, &
                                                    shares%part, shares%joint, shares%next, shares%leader, &
                                                    shares%mine, shares%member, shares%pieces)
      end if
      if (.not. allocated(shares%force)) then
         allocate (shares%force(room), shares%dashpot(room), shares%spring(room), shares%joined(room), &
                   shares%part(room), shares%joint(room), shares%next(room), shares%leader(room + 1_ip))
         allocate (shares%member(room), shares%pieces(2, room))
         allocate (shares%mine((room - 1_ip)/block_size + 1_ip))
         do k = 1_ip, size(shares%mine, kind=ip)
            allocate (shares%mine(k)%features(block_size))
         end do
      end if
      room = shares%groups%n_groups
      if (allocated(shares%head)) then
         if (size(shares%head) >= room) return
         room = max(2_ip*size(shares%head, kind=ip), room)
         deallocate (shares%head, shares%sums, shares%motion)
      end if
      allocate (shares%head(room), source=0_ip)
      allocate (shares%sums(room), shares%motion(room))
   end subroutine reserve

end module polydem_contact_shares
