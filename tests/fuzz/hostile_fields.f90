!> Data sets of an HDF5 file that was sound: contents, shapes, types and layouts changed at random.
module hostile_fields
   use, intrinsic :: ieee_arithmetic, only: ieee_negative_inf, ieee_positive_inf, ieee_quiet_nan, ieee_value
   use polydem_kinds, only: dp, ip, wp
   use hdf5, only: hsize_t
   use polydem_random, only: random_t
   implicit none
   private
   public :: field_t, new_field, new_text, spoil_fields

   !> How a field is stored: as it is; with another type; in compressed chunks; as nothing but its shape, which may
   !> be huge; as a null space; a group, a link or nothing at all in its place
   integer, parameter, public :: as_it_is = 0, other_type = 1, in_chunks = 2, shape_only = 3, as_null = 4, &
      as_group = 5, as_link = 6, absent = 7

   !> A data set to be
   type :: field_t
      !> Its name
      character(len=:), allocatable :: name
      !> Shape, fastest dimension first
      integer(hsize_t), allocatable :: extent(:)
      !> Values in order
      real(dp), allocatable :: value(:)
      !> Whether they are integers
      logical :: whole = .false.
      !> A text in their place; empty: none
      character(len=:), allocatable :: text
      !> One of the ways of storing it
      integer :: storage = as_it_is
   end type field_t

contains

   !> A sound field
   function new_field(name, extent, value, whole) result(field)
      !> Its name
      character(len=*), intent(in) :: name
      !> Shape, fastest dimension first
      integer, intent(in) :: extent(:)
      !> As many values
      real(dp), intent(in) :: value(:)
      !> Whether they are integers
      logical, intent(in) :: whole
      type(field_t) :: field

      field%name = name
      field%extent = int(extent, hsize_t)
      field%value = value
      field%whole = whole
      field%text = ''
   end function new_field

   !> A sound text
   function new_text(name, text) result(field)
      !> Its name
      character(len=*), intent(in) :: name
      !> What it says
      character(len=*), intent(in) :: text
      type(field_t) :: field

      field = new_field(name, [integer ::], [0.0_dp], .false.)
      field%text = text
   end function new_text

   !> Spoil none to three things.
   subroutine spoil_fields(random, fields)
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> The fields
      type(field_t), intent(inout) :: fields(:)
      integer(ip) :: k, which

      do k = 1_ip, random%whole(0_ip, 3_ip)
         which = random%whole(1_ip, size(fields, kind=ip))
         select case (random%whole(1_ip, 12_ip))
         case (1, 2, 3, 4)
            call spoil_values(random, fields(which)%value)
         case (5, 6)
            call spoil_extent(random, fields(which)%extent)
         case (7)
            call spoil_name(random, fields, which)
         case (8)
            fields(which)%storage = absent
         case (9)
            fields(which)%storage = in_chunks
         case (10)
            fields(which)%storage = other_type
         case (11)
            call make_huge(random, fields(which))
         case default
            fields(which)%storage = random%whole(as_null, as_link)
         end select
      end do
   end subroutine spoil_fields

   subroutine spoil_values(random, value)
      type(random_t), intent(inout) :: random
      real(dp), intent(inout) :: value(:)
      real(dp) :: extreme
      integer(ip) :: n, place

      n = size(value, kind=ip)
      if (n == 0_ip) return
      place = random%whole(1_ip, n)
      extreme = extreme_number(random)
      select case (random%whole(1_ip, 5_ip))
      case (1, 2)
         value(place) = extreme
      case (3)
         value(place) = value(random%whole(1_ip, n))
      case (4)
         value(place:) = extreme
      case default
         value = value*extreme
      end select
   end subroutine spoil_values

   real(dp) function extreme_number(random) result(number)
      type(random_t), intent(inout) :: random

      select case (random%whole(1_ip, 16_ip))
      case (1)
         number = ieee_value(number, ieee_quiet_nan)
      case (2)
         number = ieee_value(number, ieee_positive_inf)
      case (3)
         number = ieee_value(number, ieee_negative_inf)
      case (4)
         number = 0.0_dp
      case (5)
         number = -1.0_dp
      case (6)
         number = huge(number)
      case (7)
         number = tiny(number)
      case (8)
         number = 2147483647.0_dp + real(random%whole(-1_ip, 2_ip), dp)
      case (9)
         number = -2147483648.0_dp + real(random%whole(-1_ip, 2_ip), dp)
      case (10)
         number = 9.3e18_dp
      case (11, 12)
         number = 10.0_dp**random%whole(-300_ip, 300_ip)
      case (13, 14)
         number = real(random%between(-1.0_wp, 1.0_wp), dp)
      case default
         number = real(random%whole(-3_ip, 12_ip), dp)
      end select
   end function extreme_number

   subroutine spoil_extent(random, extent)
      type(random_t), intent(inout) :: random
      integer(hsize_t), allocatable, intent(inout) :: extent(:)
      integer(ip) :: k

      select case (random%whole(1_ip, 6_ip))
      case (1)
         if (product(real(extent, dp)) < 1.0e18_dp) extent = [product(extent)]
      case (2)
         extent = [extent, 1_hsize_t]
      case (3)
         extent = extent(size(extent):1:-1)
      case (4)
         extent = [integer(hsize_t) ::]
      case default
         if (size(extent) == 0) return
         k = random%whole(1_ip, size(extent, kind=ip))
         extent(k) = max(0_hsize_t, extent(k) + int(random%whole(-2_ip, 2_ip), hsize_t))
      end select
   end subroutine spoil_extent

   subroutine spoil_name(random, fields, which)
      type(random_t), intent(inout) :: random
      type(field_t), intent(inout) :: fields(:)
      integer(ip), intent(in) :: which

      select case (random%whole(1_ip, 4_ip))
      case (1)
         fields(which)%name = fields(which)%name//'x'
      case (2)
         fields(which)%name = repeat('name', random%whole(1_ip, 10000_ip))
      case (3)
         fields(which)%name = 'group/'//fields(which)%name
      case default
         fields(which)%name = fields(random%whole(1_ip, size(fields, kind=ip)))%name
      end select
   end subroutine spoil_name

   !> Claim a shape without any values, often one that no memory can hold.
   subroutine make_huge(random, field)
      type(random_t), intent(inout) :: random
      type(field_t), intent(inout) :: field
      integer(ip) :: k, lot, power

      field%storage = shape_only
      if (size(field%extent) == 0) return
      k = random%whole(1_ip, size(field%extent, kind=ip))
      power = random%whole(1_ip, 62_ip)
      lot = random%whole(1_ip, 8_ip)
      ! What is just believed takes long to read: one in eight is enough.
      if (power > 12_ip .and. power < 22_ip .and. lot > 1_ip) power = power + 20_ip
      select case (random%whole(1_ip, 3_ip))
      case (1)
         field%extent(k) = 2_hsize_t**power
      case (2)
         field%extent = 2_hsize_t**power
      end select
   end subroutine make_huge

end module hostile_fields
