!> The changes of one step: pairs of boxes that began or ceased to overlap.
!>
!> Finders record changes in any order. `order` then sorts them and adds up those of the same pair of pieces, as
!> `pair_list_t` requires. A few hundred changes are sorted instead of the whole list of pairs.
module polydem_pair_changes
   use polydem_grow, only: grow
   use polydem_kinds, only: ip, lp
   use polydem_pair_keys, only: pair_key
   use polydem_sort, only: sort_keys
   implicit none
   private
   public :: pair_changes_t

   !> A growing list of changes, keyed by the pair of pieces
   type :: pair_changes_t
      !> Number of changes recorded
      integer(ip) :: n = 0_ip
      !> `pair_key` of each change
      integer(lp), allocatable :: key(:)
      !> +1: two boxes began to overlap, -1: they ceased to; after `order` the sum over the boxes of the two pieces
      integer(ip), allocatable :: step(:)
      !> Work space of `order`
      integer(lp), allocatable, private :: spare_key(:)
      !> Work space of `order`
      integer(ip), allocatable, private :: spare_step(:)
   contains
      procedure :: clear
      procedure :: record
      procedure :: append
      procedure :: order
      procedure :: bytes
   end type pair_changes_t

contains

   !> Delete all changes; the arrays stay allocated.
   pure subroutine clear(self)
      class(pair_changes_t), intent(inout) :: self

      self%n = 0_ip
   end subroutine clear

   !> Record one change.
   pure subroutine record(self, a, b, step)
      class(pair_changes_t), intent(inout) :: self
      !> Index of one piece
      integer(ip), intent(in) :: a
      !> Index of the other piece
      integer(ip), intent(in) :: b
      !> +1: began to overlap, -1: ceased to
      integer(ip), intent(in) :: step

      call reserve(self, self%n + 1_ip)
      self%n = self%n + 1_ip
      self%key(self%n) = pair_key(min(a, b), max(a, b))
      self%step(self%n) = step
   end subroutine record

   !> Append the changes of another list, for example of another thread.
   pure subroutine append(self, other)
      class(pair_changes_t), intent(inout) :: self
      !> Changes to append
      type(pair_changes_t), intent(in) :: other

      if (other%n == 0_ip) return
      call reserve(self, self%n + other%n)
      self%key(self%n + 1_ip:self%n + other%n) = other%key(1:other%n)
      self%step(self%n + 1_ip:self%n + other%n) = other%step(1:other%n)
      self%n = self%n + other%n
   end subroutine append

   !> Sort by key, and replace the changes of each pair of pieces by their sum. Sums of zero are dropped.
   pure subroutine order(self)
      class(pair_changes_t), intent(inout) :: self
      integer(lp) :: key
      integer(ip) :: k, kept, total

      if (self%n == 0_ip) return
      if (allocated(self%spare_key)) then
         if (size(self%spare_key) < self%n) deallocate (self%spare_key, self%spare_step)
      end if
      if (.not. allocated(self%spare_key)) then
         allocate (self%spare_key(size(self%key)), self%spare_step(size(self%key)))
      end if
      call sort_keys(self%n, self%key, self%step, self%spare_key, self%spare_step)
      kept = 0_ip
      k = 1_ip
      do while (k <= self%n)
         key = self%key(k)
         total = 0_ip
         do while (k <= self%n)
            if (self%key(k) /= key) exit
            total = total + self%step(k)
            k = k + 1_ip
         end do
         if (total == 0_ip) cycle
         kept = kept + 1_ip
         self%key(kept) = key
         self%step(kept) = total
      end do
      self%n = kept
   end subroutine order

   !> Allocated memory [B]
   pure integer(lp) function bytes(self)
      class(pair_changes_t), intent(in) :: self

      bytes = 0_lp
      if (allocated(self%key)) bytes = &
         size(self%key, kind=lp)*int((storage_size(self%key) + storage_size(self%step))/8, lp)
      if (allocated(self%spare_key)) bytes = bytes + &
         size(self%spare_key, kind=lp)*int((storage_size(self%spare_key) + storage_size(self%spare_step))/8, lp)
   end function bytes

   !> Make room for at least `capacity` changes.
   pure subroutine reserve(self, capacity)
      type(pair_changes_t), intent(inout) :: self
      integer(ip), intent(in) :: capacity
      integer(ip) :: m

      if (allocated(self%key)) then
         if (size(self%key) >= capacity) return
      end if
      m = max(256_ip, 2_ip*capacity)
      call grow(self%key, self%n, m)
      call grow(self%step, self%n, m)
   end subroutine reserve

end module polydem_pair_changes
