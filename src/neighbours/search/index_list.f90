!> List of integers that grows.
module polydem_index_list
   use polydem_grow, only: grow
   use polydem_kinds, only: ip, lp
   use polydem_sort, only: sort_keys
   implicit none
   private
   public :: index_list_t

   !> List of integers
   type :: index_list_t
      !> Number of entries
      integer(ip) :: n = 0_ip
      !> Entries, (entry); may be longer than n
      integer(ip), allocatable :: at(:)
   contains
      procedure :: push
      procedure :: append
      procedure :: reserve
      procedure :: sort
   end type index_list_t

contains

   !> Make room for n entries.
   pure subroutine reserve(self, n)
      class(index_list_t), intent(inout) :: self
      !> Number of entries
      integer(ip), intent(in) :: n

      if (allocated(self%at)) then
         if (size(self%at) >= n) return
      end if
      call grow(self%at, self%n, n + n/4_ip + 64_ip)
   end subroutine reserve

   !> Append an entry.
   pure subroutine push(self, entry)
      class(index_list_t), intent(inout) :: self
      !> Entry to append
      integer(ip), intent(in) :: entry

      if (.not. allocated(self%at)) allocate (self%at(64))
      if (self%n == size(self%at)) call grow(self%at, self%n, 2_ip*self%n)
      self%n = self%n + 1_ip
      self%at(self%n) = entry
   end subroutine push

   !> Append the entries of another list.
   pure subroutine append(self, other)
      class(index_list_t), intent(inout) :: self
      !> Entries to append
      type(index_list_t), intent(in) :: other

      if (other%n == 0_ip) return
      call self%reserve(self%n + other%n)
      self%at(self%n + 1_ip:self%n + other%n) = other%at(1:other%n)
      self%n = self%n + other%n
   end subroutine append

   !> Sort the entries in ascending order.
   pure subroutine sort(self)
      class(index_list_t), intent(inout) :: self
      integer(lp), allocatable :: keys(:), spare_keys(:)
      integer(ip), allocatable :: spare(:)
      integer(ip) :: k

      do k = 2_ip, self%n
         if (self%at(k - 1_ip) > self%at(k)) exit
      end do
      if (k > self%n) return
      allocate (keys(self%n), spare_keys(self%n), spare(self%n))
      keys = int(self%at(1:self%n), lp)
      call sort_keys(self%n, keys, self%at, spare_keys, spare)
   end subroutine sort

end module polydem_index_list
