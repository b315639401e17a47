!> Longer arrays: one generic procedure for all kinds.
module polydem_grow
   use polydem_kinds, only: bp, ip, lp, wp
   implicit none
   private
   public :: grow

   !> Give an array n entries along its last dimension: grow(array, kept, n, fill). The first `kept` entries keep their
   !> values; the others become `fill`, or are undefined without it. An array that is not allocated needs kept = 0; its
   !> first dimension, if it has two, becomes 2.
   interface grow
      procedure grow_bytes, grow_integers, grow_integer_table, grow_longs, grow_long_table, grow_reals, grow_real_table
   end interface grow

contains

   !> The other forms of `grow` differ only in kind and rank.
   pure subroutine grow_bytes(array, kept, n, fill)
      !> The array
      integer(bp), allocatable, intent(inout) :: array(:)
      !> Number of entries to keep, and of entries afterwards
      integer(ip), intent(in) :: kept, n
      !> Value of the other entries
      integer(bp), intent(in), optional :: fill
      integer(bp), allocatable :: longer(:)

      ! Memory that holds nothing to keep is freed first.
      if (kept == 0_ip .and. allocated(array)) deallocate (array)
      allocate (longer(n))
      if (kept > 0_ip) longer(:kept) = array(:kept)
      if (present(fill)) longer(kept + 1_ip:) = fill
      call move_alloc(longer, array)
   end subroutine grow_bytes

   pure subroutine grow_integers(array, kept, n, fill)
      integer(ip), allocatable, intent(inout) :: array(:)
      integer(ip), intent(in) :: kept, n
      integer(ip), intent(in), optional :: fill
      integer(ip), allocatable :: longer(:)

      if (kept == 0_ip .and. allocated(array)) deallocate (array)
      allocate (longer(n))
      if (kept > 0_ip) longer(:kept) = array(:kept)
      if (present(fill)) longer(kept + 1_ip:) = fill
      call move_alloc(longer, array)
   end subroutine grow_integers

   pure subroutine grow_integer_table(array, kept, n, fill)
      integer(ip), allocatable, intent(inout) :: array(:, :)
      integer(ip), intent(in) :: kept, n
      integer(ip), intent(in), optional :: fill
      integer(ip), allocatable :: longer(:, :)
      integer(ip) :: width

      width = 2_ip
      if (allocated(array)) width = size(array, 1, kind=ip)
      if (kept == 0_ip .and. allocated(array)) deallocate (array)
      allocate (longer(width, n))
      if (kept > 0_ip) longer(:, :kept) = array(:, :kept)
      if (present(fill)) longer(:, kept + 1_ip:) = fill
      call move_alloc(longer, array)
   end subroutine grow_integer_table

   pure subroutine grow_longs(array, kept, n, fill)
      integer(lp), allocatable, intent(inout) :: array(:)
      integer(ip), intent(in) :: kept, n
      integer(lp), intent(in), optional :: fill
      integer(lp), allocatable :: longer(:)

      if (kept == 0_ip .and. allocated(array)) deallocate (array)
      allocate (longer(n))
      if (kept > 0_ip) longer(:kept) = array(:kept)
      if (present(fill)) longer(kept + 1_ip:) = fill
      call move_alloc(longer, array)
   end subroutine grow_longs

   pure subroutine grow_long_table(array, kept, n, fill)
      integer(lp), allocatable, intent(inout) :: array(:, :)
      integer(ip), intent(in) :: kept, n
      integer(lp), intent(in), optional :: fill
      integer(lp), allocatable :: longer(:, :)
      integer(ip) :: width

      width = 2_ip
      if (allocated(array)) width = size(array, 1, kind=ip)
      if (kept == 0_ip .and. allocated(array)) deallocate (array)
      allocate (longer(width, n))
      if (kept > 0_ip) longer(:, :kept) = array(:, :kept)
      if (present(fill)) longer(:, kept + 1_ip:) = fill
      call move_alloc(longer, array)
   end subroutine grow_long_table

   pure subroutine grow_reals(array, kept, n, fill)
      real(wp), allocatable, intent(inout) :: array(:)
      integer(ip), intent(in) :: kept, n
      real(wp), intent(in), optional :: fill
      real(wp), allocatable :: longer(:)

      if (kept == 0_ip .and. allocated(array)) deallocate (array)
      allocate (longer(n))
      if (kept > 0_ip) longer(:kept) = array(:kept)
      if (present(fill)) longer(kept + 1_ip:) = fill
      call move_alloc(longer, array)
   end subroutine grow_reals

   pure subroutine grow_real_table(array, kept, n, fill)
      real(wp), allocatable, intent(inout) :: array(:, :)
      integer(ip), intent(in) :: kept, n
      real(wp), intent(in), optional :: fill
      real(wp), allocatable :: longer(:, :)
      integer(ip) :: width

      width = 2_ip
      if (allocated(array)) width = size(array, 1, kind=ip)
      if (kept == 0_ip .and. allocated(array)) deallocate (array)
      allocate (longer(width, n))
      if (kept > 0_ip) longer(:, :kept) = array(:, :kept)
      if (present(fill)) longer(:, kept + 1_ip:) = fill
      call move_alloc(longer, array)
   end subroutine grow_real_table

end module polydem_grow
