!> Sorting of 64-bit keys: a stable bottom-up merge sort without recursion, O(n log n) in the worst case.
module polydem_sort
   use polydem_kinds, only: ip, lp
   implicit none
   private
   public :: ascending_order, place_in, sort_keys

contains

   !> Index of the first entry of an ascending list that is not less than a number; size + 1 if there is none
   pure integer(ip) function place_in(list, wanted)
      !> Ascending numbers
      integer(ip), intent(in) :: list(:)
      !> The number
      integer(ip), intent(in) :: wanted
      integer(ip) :: high, middle

      place_in = 1_ip
      high = size(list, kind=ip) + 1_ip
      do while (place_in < high)
         middle = place_in + (high - place_in)/2_ip
         if (list(middle) < wanted) then
            place_in = middle + 1_ip
         else
            high = middle
         end if
      end do
   end function place_in

   !> Indices of keys in ascending order of the keys. The sort is stable.
   pure function ascending_order(keys) result(order)
      !> The keys, (n)
      integer(lp), intent(in) :: keys(:)
      !> Index of the k-th smallest key, (n)
      integer(ip), allocatable :: order(:)
      integer(lp), allocatable :: sorted(:), spare_keys(:)
      integer(ip), allocatable :: spare(:)
      integer(ip) :: k, n

      n = size(keys, kind=ip)
      order = [(k, k=1_ip, n)]
      if (all(keys(2:) >= keys(:n - 1_ip))) return
      allocate (sorted(n), spare_keys(n), spare(n))
      sorted = keys
      call sort_keys(n, sorted, order, spare_keys, spare)
   end function ascending_order

   !> Sort keys in ascending order, and permute one integer per key in the same way.
   pure subroutine sort_keys(n, keys, carried, spare_keys, spare_carried)
      !> Number of entries
      integer(ip), intent(in) :: n
      !> Keys, (n) or longer
      integer(lp), intent(inout) :: keys(:)
      !> Integers that are permuted with the keys, (n) or longer
      integer(ip), intent(inout) :: carried(:)
      !> Workspace, (n) or longer
      integer(lp), intent(inout) :: spare_keys(:)
      !> Workspace, (n) or longer
      integer(ip), intent(inout) :: spare_carried(:)
      integer(ip) :: width, low, middle, high
      integer(ip), parameter :: run = 16_ip

      do low = 1_ip, n, run
         call insertion_sort(keys, carried, low, min(low + run - 1_ip, n))
      end do
      width = run
      do while (width < n)
         do low = 1_ip, n - width, 2_ip*width
            middle = low + width
            high = min(low + 2_ip*width, n + 1_ip)
            if (keys(middle - 1_ip) <= keys(middle)) cycle
            call merge_runs(keys, carried, low, middle, high, spare_keys, spare_carried)
            keys(low:high - 1_ip) = spare_keys(low:high - 1_ip)
            carried(low:high - 1_ip) = spare_carried(low:high - 1_ip)
         end do
         width = 2_ip*width
      end do
   end subroutine sort_keys

   pure subroutine insertion_sort(keys, carried, low, high)
      integer(lp), intent(inout) :: keys(:)
      integer(ip), intent(inout) :: carried(:)
      integer(ip), intent(in) :: low, high
      integer(lp) :: key
      integer(ip) :: k, place, item

      do k = low + 1_ip, high
         key = keys(k)
         item = carried(k)
         place = k
         do while (place > low)
            if (keys(place - 1_ip) <= key) exit
            keys(place) = keys(place - 1_ip)
            carried(place) = carried(place - 1_ip)
            place = place - 1_ip
         end do
         keys(place) = key
         carried(place) = item
      end do
   end subroutine insertion_sort

   !> Merge the sorted ranges [low, middle) and [middle, high) into the spare arrays.
   pure subroutine merge_runs(keys, carried, low, middle, high, spare_keys, spare_carried)
      integer(lp), intent(in) :: keys(:)
      integer(ip), intent(in) :: carried(:)
      integer(ip), intent(in) :: low, middle, high
      integer(lp), intent(inout) :: spare_keys(:)
      integer(ip), intent(inout) :: spare_carried(:)
      integer(ip) :: a, b, k
      logical :: take_left

      a = low
      b = middle
      do k = low, high - 1_ip
         take_left = a < middle
         if (take_left .and. b < high) take_left = keys(a) <= keys(b)
         if (take_left) then
            spare_keys(k) = keys(a)
            spare_carried(k) = carried(a)
            a = a + 1_ip
         else
            spare_keys(k) = keys(b)
            spare_carried(k) = carried(b)
            b = b + 1_ip
         end if
      end do
   end subroutine merge_runs

end module polydem_sort
