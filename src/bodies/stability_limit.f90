!> Greatest stable time step of an integration scheme as a function of the damping ratio, from a table.
module polydem_stability_limit
   use polydem_kinds, only: wp
   implicit none
   private
   public :: stability_table_t, limit_at

   !> Greatest stable product of angular frequency and time step against the damping ratio, piecewise linear
   type :: stability_table_t
      !> Damping ratios, ascending from 0
      real(wp), allocatable :: damping_ratio(:)
      !> Greatest stable product at each damping ratio; beyond the last it falls like 1/ratio
      real(wp), allocatable :: limit(:)
   end type stability_table_t

contains

   !> Greatest stable product of angular frequency and time step at a damping ratio
   pure real(wp) function limit_at(table, ratio)
      !> Table of the integration scheme
      type(stability_table_t), intent(in) :: table
      !> Damping ratio, >= 0
      real(wp), intent(in) :: ratio
      integer :: k, n
      real(wp) :: share

      n = size(table%limit)
      if (ratio >= table%damping_ratio(n)) then
         limit_at = table%limit(n)*table%damping_ratio(n)/ratio
         return
      end if
      do k = 2, n - 1
         if (ratio < table%damping_ratio(k)) exit
      end do
      share = (ratio - table%damping_ratio(k - 1))/(table%damping_ratio(k) - table%damping_ratio(k - 1))
      limit_at = table%limit(k - 1) + share*(table%limit(k) - table%limit(k - 1))
   end function limit_at

end module polydem_stability_limit
