!> Transfer of the contact history of pairs to the ranks that have these pairs after a redistribution.
module polydem_packed_history
   use polydem_communicator, only: communicator_t
   use polydem_contact_history, only: contact_history_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_rank_order, only: sort_by_rank
   use polydem_sort, only: sort_keys
   implicit none
   private
   public :: packed_history_t, send_pairs, receive_pairs

   !> Contact history of some pairs, in ascending order
   type :: packed_history_t
      !> Global indices of both bodies in one word, the lower one in the upper half, (pair)
      integer(lp), allocatable :: key(:)
      !> Edge that separated the pair last, (pair)
      integer(ip), allocatable :: edge(:)
      !> Columns of the contact history, or one of zeros if there is none, (column, pair)
      real(wp), allocatable :: value(:, :)
   end type packed_history_t

contains

   !> Send the history of each pair to the ranks that will move one of its bodies. Collective.
   !>
   !> The sender is the rank that owned the leading body: the first body, or the second one if the first is fixed.
   subroutine send_pairs(comm, n, first, second, row, lead_is_mine, owner, history, packed)
      !> Ranks
      class(communicator_t), intent(inout) :: comm
      !> Number of pairs
      integer(ip), intent(in) :: n
      !> Slots of both bodies of each pair
      integer(ip), intent(in) :: first(:), second(:)
      !> Global index of each body, (slot)
      integer(ip), intent(in) :: row(:)
      !> Whether this rank owns the leading body of each pair, (pair)
      logical, intent(in) :: lead_is_mine(:)
      !> Rank that will move each body, negative for fixed bodies, (slot)
      integer(ip), intent(in) :: owner(:)
      !> Contact history of the pairs
      type(contact_history_t), intent(in) :: history
      !> Received history: pairs of which this rank will move a body, in ascending order
      type(packed_history_t), intent(out) :: packed
      integer(lp), allocatable :: sent(:, :), received(:, :)
      real(wp), allocatable :: value_sent(:, :), value_received(:, :)
      integer(ip), allocatable :: pair(:), rank(:), counts(:), counts_received(:), order(:)
      integer(ip) :: p, k, m, to(2)
      integer :: j, n_columns

      n_columns = 0
      if (allocated(history%column)) n_columns = size(history%column)
      allocate (pair(2_ip*n), rank(2_ip*n))
      m = 0_ip
      do p = 1_ip, n
         if (.not. lead_is_mine(p)) cycle
         to = destinations(owner(first(p)), owner(second(p)))
         do k = 1_ip, 2_ip
            if (to(k) < 0_ip) cycle
            m = m + 1_ip
            pair(m) = p
            rank(m) = to(k)
         end do
      end do
      call sort_by_rank(rank(:m), comm%size, counts, order)
      allocate (sent(2, m), value_sent(max(1, n_columns), m))
      value_sent = 0.0_wp
      do k = 1_ip, m
         p = pair(order(k))
         sent(1, k) = key_of(row, first(p), second(p))
         sent(2, k) = int(history%memory(p), lp)
         do j = 1, n_columns
            value_sent(j, k) = history%column(j)%value(p)
         end do
      end do
      call comm%all_to_all(sent, counts, received, counts_received)
      call comm%all_to_all(value_sent, counts, value_received, counts_received)
      call sort_pairs(received, value_received, packed)
   end subroutine send_pairs

   !> Global indices of both bodies of a pair in one word, the lower one in the upper half
   pure integer(lp) function key_of(row, first, second)
      integer(ip), intent(in) :: row(:), first, second

      key_of = ior(shiftl(int(row(first), lp), 32), int(row(second), lp))
   end function key_of

   !> The one or two ranks that will have a pair; negative: none
   pure function destinations(owner_1, owner_2) result(to)
      integer(ip), intent(in) :: owner_1, owner_2
      integer(ip) :: to(2)

      to = [owner_1, owner_2]
      if (owner_1 == owner_2) to(2) = -1_ip
   end function destinations

   !> Sort received pairs by their keys.
   subroutine sort_pairs(received, value_received, packed)
      integer(lp), intent(in) :: received(:, :)
      real(wp), intent(in) :: value_received(:, :)
      type(packed_history_t), intent(out) :: packed
      integer(lp), allocatable :: spare_key(:)
      integer(ip), allocatable :: order(:), spare(:)
      integer(ip) :: k, n

      n = size(received, 2, kind=ip)
      allocate (order(n), spare(n), spare_key(n))
      packed%key = received(1, :)
      do k = 1_ip, n
         order(k) = k
      end do
      call sort_keys(n, packed%key, order, spare_key, spare)
      packed%edge = int(received(2, order), ip)
      packed%value = value_received(:, order)
   end subroutine sort_pairs

   !> Restore the history of the pairs of a new list.
   subroutine receive_pairs(packed, n, first, second, row, history, n_known)
      !> Received history, in ascending order
      type(packed_history_t), intent(in) :: packed
      !> Number of pairs in the list
      integer(ip), intent(in) :: n
      !> Slots of both bodies of each pair, in ascending order
      integer(ip), intent(in) :: first(:), second(:)
      !> Global index of each body, (slot)
      integer(ip), intent(in) :: row(:)
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
         key = key_of(row, first(p), second(p))
         do while (k <= size(packed%key))
            if (packed%key(k) >= key) exit
            k = k + 1_ip
         end do
         if (k > size(packed%key)) return
         if (packed%key(k) /= key) cycle
         n_known = n_known + 1_ip
         history%memory(p) = packed%edge(k)
         do j = 1, n_columns
            history%column(j)%value(p) = packed%value(j, k)
         end do
      end do
   end subroutine receive_pairs

end module polydem_packed_history
