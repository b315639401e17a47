!> Sorting of 64-bit keys: a stable radix sort, by insertion if there are few keys.
module polydem_sort
   use polydem_kinds, only: ip, lp
   implicit none
   private
   public :: ascending_order, place_in, sort_keys

   !> Number of keys up to which insertion is faster
   integer(ip), parameter :: few = 64_ip
   !> Number of bytes of a key
   integer, parameter :: n_bytes = 8

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

   !> Sort keys in ascending order, and permute one integer per key in the same way. The sort is stable. It takes the
   !> keys byte by byte, from the lowest byte on, without those bytes that are equal in all keys.
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
      integer(lp) :: varying
      integer(ip) :: k
      integer :: byte
      logical :: in_spare

      if (n <= few) then
         call insertion_sort(keys, carried, n)
         return
      end if
      varying = 0_lp
      do k = 2_ip, n
         varying = ior(varying, ieor(keys(k), keys(1)))
      end do
      in_spare = .false.
      do byte = 0, n_bytes - 1
         if (ibits(varying, 8*byte, 8) == 0_lp) cycle
         if (in_spare) then
            call sort_by_byte(n, byte, spare_keys, spare_carried, keys, carried)
         else
            call sort_by_byte(n, byte, keys, carried, spare_keys, spare_carried)
         end if
         in_spare = .not. in_spare
      end do
      if (.not. in_spare) return
      keys(:n) = spare_keys(:n)
      carried(:n) = spare_carried(:n)
   end subroutine sort_keys

   !> Sort keys by one of their bytes.
   pure subroutine sort_by_byte(n, byte, keys, carried, sorted_keys, sorted_carried)
      !> Number of entries
      integer(ip), intent(in) :: n
      !> The byte; 0 is the lowest one
      integer, intent(in) :: byte
      !> Keys, and the integers that go with them
      integer(lp), intent(in) :: keys(n)
      integer(ip), intent(in) :: carried(n)
      !> The same, sorted
      integer(lp), intent(inout) :: sorted_keys(n)
      integer(ip), intent(inout) :: sorted_carried(n)
      integer(ip) :: next(0:256), k, v
      integer(lp) :: sign_bit

      ! The highest bit of the highest byte is the sign. Negative keys come first.
      sign_bit = merge(128_lp, 0_lp, byte == n_bytes - 1)
      next = 0_ip
      do k = 1_ip, n
         v = int(ieor(ibits(keys(k), 8*byte, 8), sign_bit), ip)
         next(v + 1_ip) = next(v + 1_ip) + 1_ip
      end do
      do v = 1_ip, 255_ip
         next(v + 1_ip) = next(v) + next(v + 1_ip)
      end do
      do k = 1_ip, n
         v = int(ieor(ibits(keys(k), 8*byte, 8), sign_bit), ip)
         next(v) = next(v) + 1_ip
         sorted_keys(next(v)) = keys(k)
         sorted_carried(next(v)) = carried(k)
      end do
   end subroutine sort_by_byte

   !> Sort few keys.
   pure subroutine insertion_sort(keys, carried, n)
      integer(lp), intent(inout) :: keys(:)
      integer(ip), intent(inout) :: carried(:)
      integer(ip), intent(in) :: n
      integer(lp) :: key
      integer(ip) :: k, place, item

      do k = 2_ip, n
         key = keys(k)
         item = carried(k)
         place = k
         do while (place > 1_ip)
            if (keys(place - 1_ip) <= key) exit
            keys(place) = keys(place - 1_ip)
            carried(place) = carried(place - 1_ip)
            place = place - 1_ip
         end do
         keys(place) = key
         carried(place) = item
      end do
   end subroutine insertion_sort

end module polydem_sort
