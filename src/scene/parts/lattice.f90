!> Positions for grains: points of a hexagonal lattice inside a convex outline, from the bottom up.
module polydem_lattice
   use polydem_elementary, only: hypotenuse
   use polydem_kinds, only: ip, wp
   use polydem_obstacles, only: obstacles_t
   implicit none
   private
   public :: fill_lattice, lattice_height, row_height

   !> Distance of neighbouring rows over distance of neighbouring points
   real(wp), parameter :: row_height = 0.866025403784438646763723170752936_wp

contains

   !> Find lattice points row by row, each row from left to right, until `centres` is full.
   !>
   !> Any two points are at least `spacing` apart. The distance of each point from the outline is at least half of it.
   pure subroutine fill_lattice(outline, spacing, centres, n_found, obstacles)
      !> Corners of the convex outline, anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: outline(:, :)
      !> Distance of neighbours [m]
      real(wp), intent(in) :: spacing
      !> Points, (2, point) [m]
      real(wp), intent(out) :: centres(:, :)
      !> Number of points found; less than size(centres, 2) if the outline has no room for more
      integer(ip), intent(out) :: n_found
      !> Bodies in the way, half a spacing from which there are no points; default: none
      type(obstacles_t), intent(in), optional :: obstacles
      real(wp) :: middle, left, right, shift, x, y
      integer(ip) :: row, column

      n_found = 0_ip
      middle = 0.5_wp*(minval(outline(1, :)) + maxval(outline(1, :)))
      row = 0_ip
      do
         y = minval(outline(2, :)) + (0.5_wp + row_height*real(row, wp))*spacing
         if (y > maxval(outline(2, :)) - 0.5_wp*spacing) return
         call find_row(outline, 0.5_wp*spacing, y, left, right)
         shift = middle + 0.5_wp*spacing*real(modulo(row, 2_ip), wp)
         column = ceiling((left - shift)/spacing, ip)
         do
            x = shift + spacing*real(column, wp)
            if (x > right) exit
            if (n_found == size(centres, 2)) return
            column = column + 1_ip
            if (present(obstacles)) then
               if (.not. obstacles%leaves([x, y], 0.5_wp*spacing)) cycle
            end if
            n_found = n_found + 1_ip
            centres(:, n_found) = [x, y]
         end do
         row = row + 1_ip
      end do
   end subroutine fill_lattice

   !> Height of an upright rectangle that holds n lattice points [m]; negative if it is too narrow for one point
   pure real(wp) function lattice_height(n, width, spacing)
      !> Number of points
      integer(ip), intent(in) :: n
      !> Width of the rectangle [m]
      real(wp), intent(in) :: width
      !> Distance of neighbours [m]
      real(wp), intent(in) :: spacing
      real(wp) :: half
      integer(ip) :: two_rows, rows

      lattice_height = -1.0_wp
      half = 0.5_wp*(width - spacing)/spacing
      if (half < 0.0_wp) return
      two_rows = 2_ip*floor(half, ip) + 1_ip + 2_ip*floor(half + 0.5_wp, ip)
      rows = 2_ip*((n + two_rows - 1_ip)/two_rows)
      lattice_height = (1.0_wp + row_height*real(rows, wp))*spacing
   end function lattice_height

   !> Find the part of a horizontal line that is inside a convex outline with a clearance from it. The part is empty if
   !> left > right.
   pure subroutine find_row(outline, clearance, y, left, right)
      real(wp), intent(in) :: outline(:, :), clearance, y
      real(wp), intent(out) :: left, right
      real(wp) :: edge(2), length, bound
      integer :: k, next

      left = minval(outline(1, :)) + clearance
      right = maxval(outline(1, :)) - clearance
      do k = 1, size(outline, 2)
         next = modulo(k, size(outline, 2)) + 1
         edge = outline(:, next) - outline(:, k)
         length = hypotenuse(edge(1), edge(2))
         if (abs(edge(2)) <= epsilon(1.0_wp)*length) cycle
         bound = outline(1, k) + (edge(1)*(y - outline(2, k)) - clearance*length)/edge(2)
         if (edge(2) > 0.0_wp) then
            right = min(right, bound)
         else
            left = max(left, bound)
         end if
      end do
   end subroutine find_row

end module polydem_lattice
