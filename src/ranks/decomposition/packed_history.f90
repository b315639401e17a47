!> Contact history of pairs without their bodies: its transfer to the ranks that have these pairs after a
!> redistribution, and its way from a checkpoint, or from the former bodies, to the pairs of the first search.
module polydem_packed_history
   use polydem_communicator, only: communicator_t
   use polydem_contact_history, only: contact_history_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_keys, only: first_of, pair_key, second_of
   use polydem_rank_order, only: sort_by_rank
   use polydem_sort, only: ascending_order, place_in
   implicit none
   private
   public :: packed_history_t, pack_pairs, send_pairs, receive_pairs, slots_of_pair

   !> Contact history of some pairs
   type :: packed_history_t
      !> Identifiers of both bodies in one word, the lower one in the upper half, ascending, (pair)
      integer(lp), allocatable :: key(:)
      !> What the search for overlaps remembers, (pair)
      integer(ip), allocatable :: features(:)
      !> Columns of the contact history, or one of zeros if there is none, (column, pair)
      real(wp), allocatable :: value(:, :)
   contains
      procedure :: append
   end type packed_history_t

contains

   !> Append some pairs of another part.
   subroutine append(self, other, chosen)
      class(packed_history_t), intent(inout) :: self
      !> The other part
      type(packed_history_t), intent(in) :: other
      !> Indices of the pairs to append
      integer(ip), intent(in) :: chosen(:)
      integer :: n

      n = size(self%value, 2) + size(chosen)
      self%key = [self%key, other%key(chosen)]
      self%features = [self%features, other%features(chosen)]
      self%value = reshape([self%value, other%value(:, chosen)], [size(self%value, 1), n])
   end subroutine append

   !> Pack the history of all pairs of a list.
   subroutine pack_pairs(n, first, second, id, history, packed)
      !> Number of pairs
      integer(ip), intent(in) :: n
      !> Slots of both bodies of each pair, in ascending order
      integer(ip), intent(in) :: first(:), second(:)
      !> Identifier of each body, (slot)
      integer(ip), intent(in) :: id(:)
      !> Contact history of the pairs
      type(contact_history_t), intent(in) :: history
      !> The same, packed
      type(packed_history_t), intent(out) :: packed
      integer :: j, n_columns

      n_columns = 0
      if (allocated(history%column)) n_columns = size(history%column)
      packed%key = pair_key(id(first(:n)), id(second(:n)))
      packed%features = history%features(:n)
      allocate (packed%value(max(1, n_columns), n), source=0.0_wp)
      do j = 1, n_columns
         packed%value(j, :) = history%column(j)%value(:n)
      end do
   end subroutine pack_pairs

   !> Send the history of each pair to the ranks that will move one of its bodies. Collective.
   !>
   !> Both ranks that move a body of the pair have its history. Each sends it to the next owner of its own body.
   subroutine send_pairs(comm, slots, owner, packed)
      class(communicator_t), intent(inout) :: comm
      !> Slots of the bodies of each pair; 0 for bodies that this rank does not have, (2, pair)
      integer(ip), intent(in) :: slots(:, :)
      !> Rank that will move each body; negative for bodies that this rank does not move, (slot)
      integer(ip), intent(in) :: owner(:)
      !> On entry the history of pairs with a body of this rank; on return that of pairs with a future body of it
      type(packed_history_t), intent(inout) :: packed
      type(packed_history_t) :: other
      integer(lp), allocatable :: sent(:, :), received(:, :)
      integer(ip), allocatable :: pair(:), to_rank(:), counts(:), counts_received(:), order(:), kept(:)
      integer(ip) :: p, k, m, n, n_kept, to(2)

      n = size(packed%key, kind=ip)
      allocate (pair(2_ip*n), to_rank(2_ip*n), kept(n))
      m = 0_ip
      n_kept = 0_ip
      do p = 1_ip, n
         to = -1_ip
         do k = 1_ip, 2_ip
            if (slots(k, p) > 0_ip) to(k) = owner(slots(k, p))
         end do
         if (any(to == comm%rank)) then
            n_kept = n_kept + 1_ip
            kept(n_kept) = p
         end if
         if (to(1) == to(2)) to(2) = -1_ip
         do k = 1_ip, 2_ip
            if (to(k) < 0_ip .or. to(k) == comm%rank) cycle
            m = m + 1_ip
            pair(m) = p
            to_rank(m) = to(k)
         end do
      end do
      call sort_by_rank(to_rank(:m), comm%size, counts, order)
      order = pair(order)
      allocate (sent(2, m))
      sent(1, :) = packed%key(order)
      sent(2, :) = int(packed%features(order), lp)
      call comm%all_to_all(sent, counts, received, counts_received)
      call comm%all_to_all(packed%value(:, order), counts, other%value, counts_received)
      other%key = received(1, :)
      other%features = int(received(2, :), ip)
      call other%append(packed, kept(:n_kept))
      call sort_pairs(other, packed)
   end subroutine send_pairs

   !> Slots of the bodies of a pair; 0 for bodies that the rank does not have
   pure function slots_of_pair(id, key) result(slots)
      !> Identifier of each body, ascending, (slot)
      integer(ip), intent(in) :: id(:)
      !> Key of the pair
      integer(lp), intent(in) :: key
      integer(ip) :: slots(2)

      slots = [slot_of(id, first_of(key)), slot_of(id, second_of(key))]
   end function slots_of_pair

   !> Slot of a body given by its identifier; 0 if there is none
   pure integer(ip) function slot_of(id, wanted)
      !> Identifier of each body, ascending, (slot)
      integer(ip), intent(in) :: id(:)
      !> Identifier to find
      integer(ip), intent(in) :: wanted

      slot_of = place_in(id, wanted)
      if (slot_of > size(id)) then
         slot_of = 0_ip
      else if (id(slot_of) /= wanted) then
         slot_of = 0_ip
      end if
   end function slot_of

   !> Sort pairs by their keys. A pair that two ranks have is kept once.
   subroutine sort_pairs(unsorted, packed)
      type(packed_history_t), intent(in) :: unsorted
      type(packed_history_t), intent(out) :: packed
      integer(ip), allocatable :: order(:)
      integer(ip) :: k

      order = ascending_order(unsorted%key)
      order = pack(order, [(is_new(k), k=1_ip, size(order, kind=ip))])
      packed%key = unsorted%key(order)
      packed%features = unsorted%features(order)
      packed%value = unsorted%value(:, order)

   contains

      !> Whether a key differs from the one before it
      pure logical function is_new(at)
         integer(ip), intent(in) :: at

         is_new = .true.
         if (at > 1_ip) is_new = unsorted%key(order(at)) /= unsorted%key(order(at - 1_ip))
      end function is_new

   end subroutine sort_pairs

   !> Restore the history of the pairs of a new list.
   subroutine receive_pairs(packed, n, first, second, id, history, n_known)
      !> Received history
      type(packed_history_t), intent(in) :: packed
      !> Number of pairs in the list
      integer(ip), intent(in) :: n
      !> Slots of both bodies of each pair, in ascending order
      integer(ip), intent(in) :: first(:), second(:)
      !> Identifier of each body, (slot)
      integer(ip), intent(in) :: id(:)
      !> Contact history of the list, zero on entry; received values are set
      type(contact_history_t), intent(inout) :: history
      !> Number of pairs of the list with received history
      integer(ip), intent(out) :: n_known
      integer(lp) :: key
      integer(ip) :: p, k
      integer :: j, n_columns

      n_columns = 0
      if (allocated(history%column)) n_columns = size(history%column)
      n_known = 0_ip
      k = 1_ip
      do p = 1_ip, n
         key = pair_key(id(first(p)), id(second(p)))
         do while (k <= size(packed%key))
            if (packed%key(k) >= key) exit
            k = k + 1_ip
         end do
         if (k > size(packed%key)) return
         if (packed%key(k) /= key) cycle
         n_known = n_known + 1_ip
         history%features(p) = packed%features(k)
         do j = 1, n_columns
            history%column(j)%value(p) = packed%value(j, k)
         end do
      end do
   end subroutine receive_pairs

end module polydem_packed_history
