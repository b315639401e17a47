!> Measures of the boxes of a scene that set up a quadtree.
module polydem_quadtree_measures
   use polydem_boxes, only: boxes_t
   use polydem_exponential, only: exponential, logarithm
   use polydem_kinds, only: dp, ip, wp
   implicit none
   private
   public :: finest_cell, half_side, measure_reaches, shorter_axis

   !> Side of the cells of one level in units of the typical (geometric mean) reach. These are the largest cells that
   !> contain one centre each in a packing; others give up to 1.6 times as many candidates (measured)
   real(dp), parameter :: typical_share = 1.2_dp
   !> Largest number of levels below that level
   integer, parameter :: most_levels = 12

contains

   !> Side of the finest cells [m]: at most the smallest reach, but not less than a limit set by `most_levels`
   pure real(dp) function finest_cell(boxes)
      !> Boxes of the first step
      type(boxes_t), intent(in) :: boxes
      real(dp) :: typical, least
      integer :: level

      call measure_reaches(boxes, typical, least)
      finest_cell = 1.0_dp
      if (.not. typical > 0.0_dp) return
      finest_cell = typical_share*typical
      do level = 1, most_levels
         if (finest_cell <= least) exit
         finest_cell = 0.5_dp*finest_cell
      end do
   end function finest_cell

   !> Geometric mean and smallest value of the positive reaches [m]; 0 and a large number if there are none
   pure subroutine measure_reaches(boxes, typical, least)
      !> Boxes of the first step
      type(boxes_t), intent(in) :: boxes
      !> Mean, and smallest value
      real(dp), intent(out) :: typical, least
      real(dp) :: logarithms, reach
      integer(ip) :: i, n

      n = 0_ip
      logarithms = 0.0_dp
      least = huge(1.0_dp)
      do i = 1_ip, boxes%n
         reach = real(boxes%reach(i), dp)
         if (.not. (reach > 0.0_dp .and. reach < huge(1.0_dp))) cycle
         n = n + 1_ip
         logarithms = logarithms + logarithm(reach)
         least = min(least, reach)
      end do
      typical = 0.0_dp
      if (n > 0_ip) typical = exponential(logarithms/real(n, dp))
   end subroutine measure_reaches

   !> Axis along which the scene is shorter: 1 (x) or 2 (y)
   pure integer function shorter_axis(boxes)
      !> Boxes of the first step
      type(boxes_t), intent(in) :: boxes
      real(wp) :: extent(2)
      integer :: a

      extent = 0.0_wp
      if (boxes%n > 0_ip) then
         do a = 1, 2
            extent(a) = maxval(boxes%bounds(a + 2, 1:boxes%n)) - minval(boxes%bounds(a, 1:boxes%n))
         end do
      end if
      shorter_axis = merge(1, 2, extent(1) < extent(2))
   end function shorter_axis

   !> Half of the longer side of a box [m]
   pure real(wp) function half_side(box)
      !> Its bounds [m]
      real(wp), intent(in) :: box(4)

      half_side = 0.5_wp*max(box(3) - box(1), box(4) - box(2))
   end function half_side

end module polydem_quadtree_measures
