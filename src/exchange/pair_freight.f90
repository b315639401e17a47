!> Carries what is remembered of pairs to the processes that will have them.
module polydem_pair_freight
   use polydem_contacts, only: contact_memory_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_rank_order, only: sort_by_rank
   use polydem_sort, only: sort_keys
   use polydem_team, only: team_t
   implicit none
   private
   public :: pair_freight_t, send_pairs, receive_pairs

   !> Pairs in ascending order
   type :: pair_freight_t
      !> Places of both bodies among all of the run, the lower in the upper half of the word, (pair)
      integer(lp), allocatable :: key(:)
      !> Edge that separated the pair last, (pair)
      integer(ip), allocatable :: edge(:)
      !> Columns of the memory, zero where there is none, (column, pair)
      real(wp), allocatable :: value(:, :)
   end type pair_freight_t

contains

   !> Give pairs to the processes that will move one of their bodies; collective.
   !>
   !> A pair is sent by the process that owned its lead body: the first, or the second if the first is fixed.
   subroutine send_pairs(team, n, first, second, row, lead_is_mine, owner, memory, freight)
      !> Processes
      class(team_t), intent(inout) :: team
      !> Number of pairs
      integer(ip), intent(in) :: n
      !> Slots of both bodies of each pair
      integer(ip), intent(in) :: first(:), second(:)
      !> Place of each body among all of the run, (slot)
      integer(ip), intent(in) :: row(:)
      !> Whether the lead body of a pair is one of this process, (pair)
      logical, intent(in) :: lead_is_mine(:)
      !> Process that will move each body, negative for fixed ones, (slot)
      integer(ip), intent(in) :: owner(:)
      !> What is remembered
      type(contact_memory_t), intent(in) :: memory
      !> Pairs of which this process will have a body, in ascending order
      type(pair_freight_t), intent(out) :: freight
      integer(lp), allocatable :: sent(:, :), received(:, :)
      real(wp), allocatable :: value_sent(:, :), value_received(:, :)
      integer(ip), allocatable :: pair(:), rank(:), counts(:), counts_received(:), order(:)
      integer(ip) :: p, k, m, to(2)
      integer :: j

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
      call sort_by_rank(rank(:m), team%size, counts, order)
      allocate (sent(2, m), value_sent(size(memory%column), m))
      value_sent = 0.0_wp
      do k = 1_ip, m
         p = pair(order(k))
         sent(1, k) = key_of(row, first(p), second(p))
         sent(2, k) = int(memory%separating_edge(p), lp)
         do j = 1, size(memory%column)
            if (allocated(memory%column(j)%value)) value_sent(j, k) = memory%column(j)%value(p)
         end do
      end do
      call team%trade(sent, counts, received, counts_received)
      call team%trade(value_sent, counts, value_received, counts_received)
      call sort_pairs(received, value_received, freight)
   end subroutine send_pairs

   !> Places of both bodies of a pair among all of the run in one word, the lower one in its upper half
   pure integer(lp) function key_of(row, first, second)
      integer(ip), intent(in) :: row(:), first, second

      key_of = ior(shiftl(int(row(first), lp), 32), int(row(second), lp))
   end function key_of

   !> The one or two processes that will have a pair; negative: none
   pure function destinations(owner_1, owner_2) result(to)
      integer(ip), intent(in) :: owner_1, owner_2
      integer(ip) :: to(2)

      to = [owner_1, owner_2]
      if (owner_1 == owner_2) to(2) = -1_ip
   end function destinations

   subroutine sort_pairs(received, value_received, freight)
      integer(lp), intent(in) :: received(:, :)
      real(wp), intent(in) :: value_received(:, :)
      type(pair_freight_t), intent(out) :: freight
      integer(lp), allocatable :: spare_key(:)
      integer(ip), allocatable :: order(:), spare(:)
      integer(ip) :: k, n

      n = size(received, 2, kind=ip)
      allocate (order(n), spare(n), spare_key(n))
      freight%key = received(1, :)
      do k = 1_ip, n
         order(k) = k
      end do
      call sort_keys(n, freight%key, order, spare_key, spare)
      freight%edge = int(received(2, order), ip)
      freight%value = value_received(:, order)
   end subroutine sort_pairs

   !> Give the pairs of a new list what is remembered of them.
   subroutine receive_pairs(freight, n, first, second, row, memory, n_known)
      !> Pairs that arrived, in ascending order
      type(pair_freight_t), intent(in) :: freight
      !> Number of pairs in the list
      integer(ip), intent(in) :: n
      !> Slots of both bodies of each pair, in ascending order
      integer(ip), intent(in) :: first(:), second(:)
      !> Place of each body among all of the run, (slot)
      integer(ip), intent(in) :: row(:)
      !> Memory of the list, cleared; that of pairs that arrived is set
      type(contact_memory_t), intent(inout) :: memory
      !> Pairs of the list that arrived
      integer(ip), intent(out) :: n_known
      integer(lp) :: key
      integer(ip) :: p, k
      integer :: j

      n_known = 0_ip
      k = 1_ip
      do p = 1_ip, n
         key = key_of(row, first(p), second(p))
         do while (k <= size(freight%key))
            if (freight%key(k) >= key) exit
            k = k + 1_ip
         end do
         if (k > size(freight%key)) return
         if (freight%key(k) /= key) cycle
         n_known = n_known + 1_ip
         memory%separating_edge(p) = freight%edge(k)
         do j = 1, size(memory%column)
            if (allocated(memory%column(j)%value)) memory%column(j)%value(p) = freight%value(j, k)
         end do
      end do
   end subroutine receive_pairs

end module polydem_pair_freight
