!> Table of poses over time: displacements and angle, between which a cubic Hermite polynomial interpolates.
!>
!> Its slope at a row is that of the parabola through the row and its neighbours, and zero at the first and the last
!> row. Velocities are therefore continuous: the motion begins and ends at rest.
module polydem_motion_table
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: motion_table_t, prepare_table, evaluate_table, greatest_rates, greatest_values

   !> Rows of the table, with the slopes there
   type :: motion_table_t
      !> Time of each row since the start of the motion, ascending [s]
      real(wp), allocatable :: time(:)
      !> Displacements along x and y [m] and angle [rad], (3, row)
      real(wp), allocatable :: value(:, :)
      !> Their derivatives with respect to time, (3, row)
      real(wp), allocatable :: slope(:, :)
   end type motion_table_t

contains

   !> Compute the slopes of a table.
   pure subroutine prepare_table(table)
      !> A table with times and values; the slopes are set
      type(motion_table_t), intent(inout) :: table
      real(wp) :: before, behind
      integer :: k

      table%slope = 0.0_wp*table%value
      do k = 2, size(table%time) - 1
         before = table%time(k) - table%time(k - 1)
         behind = table%time(k + 1) - table%time(k)
         table%slope(:, k) = ((table%value(:, k + 1) - table%value(:, k))*(before/behind) &
                              + (table%value(:, k) - table%value(:, k - 1))*(behind/before))/(before + behind)
      end do
   end subroutine prepare_table

   !> Evaluate the table at a time. Before the first row and after the last one the pose is that of the row, at rest.
   pure subroutine evaluate_table(table, time, value, rate, growth)
      type(motion_table_t), intent(in) :: table
      !> Time since the start of the motion [s]
      real(wp), intent(in) :: time
      !> Displacements along x and y [m] and angle [rad]
      real(wp), intent(out) :: value(3)
      !> Their first derivatives
      real(wp), intent(out) :: rate(3)
      !> Their second derivatives
      real(wp), intent(out) :: growth(3)
      real(wp) :: u, step, change(3)
      integer(ip) :: k, n

      n = size(table%time, kind=ip)
      rate = 0.0_wp
      growth = 0.0_wp
      if (time <= table%time(1)) then
         value = table%value(:, 1)
         return
      else if (time >= table%time(n)) then
         value = table%value(:, n)
         return
      end if
      k = row_at(table%time, time)
      step = table%time(k + 1_ip) - table%time(k)
      u = (time - table%time(k))/step
      change = table%value(:, k + 1_ip) - table%value(:, k)
      associate (first => step*table%slope(:, k), second => step*table%slope(:, k + 1_ip))
         value = table%value(:, k) + u*(first + u*((3.0_wp*change - 2.0_wp*first - second) &
                                                   + u*(first + second - 2.0_wp*change)))
         rate = (first + u*(2.0_wp*(3.0_wp*change - 2.0_wp*first - second) &
                            + u*(3.0_wp*(first + second - 2.0_wp*change))))/step
         growth = (2.0_wp*(3.0_wp*change - 2.0_wp*first - second) &
                   + u*(6.0_wp*(first + second - 2.0_wp*change)))/step**2
      end associate
   end subroutine evaluate_table

   !> The last row whose time is at most a given one, found by bisection
   pure integer(ip) function row_at(times, time) result(low)
      real(wp), intent(in) :: times(:)
      !> A time between those of the first and the last row [s]
      real(wp), intent(in) :: time
      integer(ip) :: high, middle

      low = 1_ip
      high = size(times, kind=ip)
      do while (high - low > 1_ip)
         middle = (low + high)/2_ip
         if (times(middle) <= time) then
            low = middle
         else
            high = middle
         end if
      end do
   end function row_at

   !> Upper bounds of the rates of the three values: the derivative is a parabola within its three control values
   pure function greatest_rates(table) result(rates)
      type(motion_table_t), intent(in) :: table
      real(wp) :: rates(3)
      integer :: k

      rates = 0.0_wp
      do k = 1, size(table%time) - 1
         rates = max(rates, abs(table%slope(:, k)), abs(table%slope(:, k + 1)), &
                     abs(3.0_wp*(table%value(:, k + 1) - table%value(:, k))/(table%time(k + 1) - table%time(k)) &
                         - table%slope(:, k) - table%slope(:, k + 1)))
      end do
   end function greatest_rates

   !> Upper bounds of the absolute values: those of the control values of each cubic polynomial
   pure function greatest_values(table) result(values)
      type(motion_table_t), intent(in) :: table
      real(wp) :: values(3)
      real(wp) :: step
      integer :: k

      values = abs(table%value(:, 1))
      do k = 1, size(table%time) - 1
         step = (table%time(k + 1) - table%time(k))/3.0_wp
         values = max(values, abs(table%value(:, k + 1)), abs(table%value(:, k) + step*table%slope(:, k)), &
                      abs(table%value(:, k + 1) - step*table%slope(:, k + 1)))
      end do
   end function greatest_values

end module polydem_motion_table
