!> Contacts between the same two bodies, in groups. All fixed bodies together count as one.
module polydem_contact_groups
   use polydem_bodies, only: bodies_t
   use polydem_grow, only: grow
   use polydem_kinds, only: ip
   use polydem_contact_block, only: block_size
   use polydem_pair_list, only: pair_list_t
   implicit none
   private
   public :: contact_groups_t, list_groups

   !> Pairs of pieces in groups: those of one free body with all fixed bodies, or of two free bodies
   type :: contact_groups_t
      !> Number of pairs of groups with several pairs
      integer(ip) :: n = 0_ip
      !> Their indices in the pair list, ascending
      integer(ip), allocatable :: pair(:)
      !> Group of each: the slot of its free body, or for two free bodies a number above all slots
      integer(ip), allocatable :: group(:)
      !> Greatest number of a group
      integer(ip) :: n_groups = 0_ip
      !> Number of pairs of each group; 0 between two steps, (group)
      integer(ip), allocatable, private :: count_of(:)
      !> Group of one free body with each other, (slot); 0 between two bodies
      integer(ip), allocatable, private :: group_with(:)
   end type contact_groups_t

contains

   !> List the pairs of groups with several pairs.
   subroutine list_groups(bodies, pairs, groups)
      type(bodies_t), intent(in) :: bodies
      !> Pairs of the list of neighbours
      type(pair_list_t), intent(in) :: pairs
      type(contact_groups_t), intent(inout) :: groups

      groups%n = 0_ip
      groups%n_groups = bodies%n
      if (bodies%pieces%most > 1_ip) then
         call list_pieces(bodies, pairs, groups)
      else
         call list_bodies(bodies, pairs, groups)
      end if
      if (groups%n > 0_ip) call keep_several(groups)
   end subroutine list_groups

   !> List pairs where every body has one piece: only those of free with fixed bodies may be several.
   subroutine list_bodies(bodies, pairs, groups)
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(contact_groups_t), intent(inout) :: groups
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
         call reserve_pairs(groups%n + n, groups)
         do k = 1_ip, n
            associate (i => pairs%first(found(k)), j => pairs%second(found(k)))
               if (bodies%fixed(i) .neqv. bodies%fixed(j)) call append(found(k), merge(j, i, bodies%fixed(i)), groups)
            end associate
         end do
      end do
   end subroutine list_bodies

   !> List pairs where bodies have several pieces. Those with the pieces of one body as the first follow each other.
   subroutine list_pieces(bodies, pairs, groups)
      type(bodies_t), intent(in) :: bodies
      type(pair_list_t), intent(in) :: pairs
      type(contact_groups_t), intent(inout) :: groups
      integer(ip) :: before, i, j, k, p, upto

      call reserve_bodies(bodies%n, groups)
      upto = 0_ip
      do while (upto < pairs%n)
         p = upto + 1_ip
         before = groups%n
         i = bodies%pieces%body_of(pairs%first(p))
         do while (upto < pairs%n)
            if (pairs%first(upto + 1_ip) >= bodies%pieces%first(i + 1_ip)) exit
            upto = upto + 1_ip
         end do
         call reserve_pairs(groups%n + upto - p + 1_ip, groups)
         do k = p, upto
            j = bodies%pieces%body_of(pairs%second(k))
            if (bodies%fixed(i) .neqv. bodies%fixed(j)) then
               call append(k, merge(j, i, bodies%fixed(i)), groups)
            else if (upto > p) then
               if (groups%group_with(j) == 0_ip) then
                  groups%n_groups = groups%n_groups + 1_ip
                  groups%group_with(j) = groups%n_groups
               end if
               call append(k, groups%group_with(j), groups)
            end if
         end do
         do k = before + 1_ip, groups%n
            groups%group_with(bodies%pieces%body_of(pairs%second(groups%pair(k)))) = 0_ip
         end do
      end do
   end subroutine list_pieces

   !> Append a pair; there must be room.
   pure subroutine append(pair, group, groups)
      !> Index in the pair list
      integer(ip), intent(in) :: pair
      integer(ip), intent(in) :: group
      type(contact_groups_t), intent(inout) :: groups

      groups%n = groups%n + 1_ip
      groups%pair(groups%n) = pair
      groups%group(groups%n) = group
   end subroutine append

   !> Keep the pairs of groups with several of them.
   subroutine keep_several(groups)
      type(contact_groups_t), intent(inout) :: groups
      integer(ip) :: k, n, n_all

      call reserve_counts(groups%n_groups, groups)
      n_all = groups%n
      do k = 1_ip, n_all
         groups%count_of(groups%group(k)) = groups%count_of(groups%group(k)) + 1_ip
      end do
      n = 0_ip
      do k = 1_ip, n_all
         if (groups%count_of(groups%group(k)) < 2_ip) cycle
         n = n + 1_ip
         groups%pair(n) = groups%pair(k)
         ! Exchanged, not overwritten: the counts of all groups are still to be cleared.
         if (n < k) groups%group([n, k]) = groups%group([k, n])
      end do
      groups%n = n
      do k = 1_ip, n_all
         groups%count_of(groups%group(k)) = 0_ip
      end do
   end subroutine keep_several

   !> Make room for n bodies.
   subroutine reserve_bodies(n, groups)
      integer(ip), intent(in) :: n
      type(contact_groups_t), intent(inout) :: groups

      if (allocated(groups%group_with)) then
         if (size(groups%group_with) >= n) return
         deallocate (groups%group_with)
      end if
      allocate (groups%group_with(n), source=0_ip)
   end subroutine reserve_bodies

   !> Make room for the counts of n groups.
   subroutine reserve_counts(n, groups)
      integer(ip), intent(in) :: n
      type(contact_groups_t), intent(inout) :: groups
      integer(ip) :: room

      room = n
      if (allocated(groups%count_of)) then
         if (size(groups%count_of) >= n) return
         room = max(2_ip*size(groups%count_of, kind=ip), n)
         deallocate (groups%count_of)
      end if
      allocate (groups%count_of(room), source=0_ip)
   end subroutine reserve_counts

   !> Make room for n pairs.
   subroutine reserve_pairs(n, groups)
      integer(ip), intent(in) :: n
      type(contact_groups_t), intent(inout) :: groups
      integer(ip) :: room

      room = 0_ip
      if (allocated(groups%pair)) room = size(groups%pair, kind=ip)
      if (room >= n) return
      room = max(2_ip*room, n)
      call grow(groups%pair, groups%n, room)
      call grow(groups%group, groups%n, room)
   end subroutine reserve_pairs

end module polydem_contact_groups
