!> A periodic cell: the part of the plane that is repeated along one axis or both.
!>
!> Every body has one place in the cell, and every pair of bodies one vector, that to the nearest copy. No contact is
!> missed as long as half the cell is longer than two bodies reach together; then at most one copy of a body can touch.
!>
!> In a *sheared* cell the copies above and below move along x, the upper one by `shift` with the velocity `jump`
!> (A.W. Lees & S.F. Edwards, J. Phys. C 5 (1972) 1921). Both are closed functions of time, unless the cell is
!> stress-controlled. A cell at rest whose copies are displaced, at the start from a sheared result, is one with the
!> rate 0. While rate or height change, every body keeps its velocity relative to the shear (`kick`), else a body and
!> its copy would not.
!>
!> A *stress-controlled* cell has a size that follows a stress (`polydem_cell_load`).
module polydem_cell
   use polydem_driven, only: driven_t
   use polydem_kinds, only: ip, wp
   use polydem_ramp, only: ramp_t, window_t
   implicit none
   private
   public :: cell_t, cell_load_t, new_cell, grow_cell, minimum_image, find_minimum_images, shear_cell, copies_along_y, &
             shear_flow, into_cell, copies_within

   !> Control of the size of a cell by a stress, (x and y)
   type :: cell_load_t
      !> Whether the cell is stress-controlled along an axis
      logical :: is_controlled(2) = .false.
      !> Prescribed stress, positive in compression [N/m2]
      real(wp) :: stress(2) = 0.0_wp
      !> The size along each axis, and the window in which it is controlled; both have the same mass and damping
      type(driven_t) :: axis(2)
      !> Centre of the cell, which stays where it is [m]
      real(wp) :: centre(2) = 0.0_wp
      !> Least size for the largest body [m]
      real(wp) :: least = 0.0_wp
      !> Factor by which the size grows in this step
      real(wp) :: stretch(2) = 1.0_wp
      !> Unit of the sums over contacts of force times distance, a power of 2 [N]
      real(wp) :: unit = 1.0_wp
      !> Sums over steps of the powers of the elastic, the other normal and the tangential forces of contacts on the
      !> motion of the cell, and the last powers [W/m]
      real(wp) :: power_sum(3) = 0.0_wp, power(3) = 0.0_wp
   end type cell_load_t

   !> Periodic cell
   type :: cell_t
      !> Whether the plane is periodic along any axis
      logical :: is_periodic = .false.
      !> Lower left corner [m]
      real(wp) :: low(2) = 0.0_wp
      !> Width and height; 0 along an axis that is not periodic [m]
      real(wp) :: size(2) = 0.0_wp
      !> 1/size; 0 along an axis that is not periodic [1/m]
      real(wp) :: inverse(2) = 0.0_wp
      !> Whether the cell is sheared
      logical :: is_sheared = .false.
      !> Rate of the shear [1/s]
      real(wp) :: rate = 0.0_wp
      !> The window in which it acts, from time 0 on
      type(window_t) :: window
      !> Displacement of the copy above at time 0, that of the result from which the run starts [m]
      real(wp) :: first_shift = 0.0_wp
      !> Displacement of the copy above, from 0 to the width [m], and its velocity [m/s]
      real(wp) :: shift = 0.0_wp, jump = 0.0_wp
      !> Both at the start of the step; before the first one those of the state from which bodies enter the cell
      real(wp) :: former_shift = 0.0_wp, former_jump = 0.0_wp
      !> What a change of the shear within the step gives to bodies, over their height above the middle of the cell: a
      !> velocity [1/s], and the displacement that is left of that of the shear beyond the step times the new velocity
      real(wp) :: kick = 0.0_wp, lag = 0.0_wp
      !> The stress that controls its size; not allocated if the size is constant
      type(cell_load_t), allocatable :: load
   end type cell_t

   !> A number of such size that adding it rounds to whole numbers
   real(wp), parameter :: rounder = 1.5_wp*2.0_wp**(digits(1.0_wp) - 1)
   !> Difference of two lengths that count as the same
   real(wp), parameter :: same_length = 1.0e-6_wp

contains

   !> A cell that is periodic along some axes
   pure function new_cell(axes, low, size, rate, ramp, first_shift) result(cell)
      !> 'none', 'x', 'y' or 'xy'
      character(len=*), intent(in) :: axes
      !> Lower left corner, and width and height; only those along periodic axes are used [m]
      real(wp), intent(in) :: low(2), size(2)
      !> Rate of the shear, 0 if there is none [1/s], and its ramp [s]
      real(wp), intent(in) :: rate, ramp
      !> Displacement of the copy above at time 0 [m]
      real(wp), intent(in) :: first_shift
      type(cell_t) :: cell
      integer :: axis

      do axis = 1, 2
         if (axes == 'none' .or. scan(axes, 'xy'(axis:axis)) == 0) cycle
         cell%is_periodic = .true.
         cell%low(axis) = low(axis)
         cell%size(axis) = size(axis)
         cell%inverse(axis) = 1.0_wp/size(axis)
      end do
      cell%first_shift = merge(first_shift, 0.0_wp, all(cell%size > 0.0_wp))
      cell%is_sheared = abs(rate) > 0.0_wp .or. abs(cell%first_shift) > 0.0_wp
      cell%rate = rate
      cell%window%ramp = ramp
      call shear_cell(cell, 0.0_wp, 0.0_wp)
   end function new_cell

   !> Shear the cell for a step. Nothing is done if it is not sheared. The velocity of a stress-controlled cell is no
   !> closed function of time; its displacement is summed by the trapezoidal rule.
   elemental subroutine shear_cell(cell, from, to)
      type(cell_t), intent(inout) :: cell
      !> Simulated time at the start and at the end of the step [s]
      real(wp), intent(in) :: from, to

      if (.not. cell%is_sheared) return
      if (.not. allocated(cell%load)) then
         call find_shear(cell, from, cell%former_shift, cell%former_jump)
         call find_shear(cell, to, cell%shift, cell%jump)
      else
         cell%former_shift = cell%shift
         cell%former_jump = cell%jump
         call find_shear(cell, to, cell%shift, cell%jump)
         cell%shift = modulo(cell%former_shift + 0.5_wp*(to - from)*(cell%former_jump + cell%jump), cell%size(1))
      end if
      call find_kick(to - from, cell)
   end subroutine shear_cell

   !> Find what a change of the shear gives to bodies. Both are exactly 0 if the copies keep their velocity.
   pure subroutine find_kick(dt, cell)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Cell with shift and jump of the start and the end of the step
      type(cell_t), intent(inout) :: cell
      real(wp) :: slide

      cell%kick = (cell%jump - cell%former_jump)/cell%size(2)
      cell%lag = 0.0_wp
      if (.not. abs(cell%kick) > 0.0_wp) return
      slide = 0.5_wp*dt*(cell%former_jump + cell%jump)
      slide = slide + remainder_of(cell%shift - cell%former_shift - slide, cell%size(1))
      cell%lag = (slide - dt*cell%jump)/cell%size(2)
   end subroutine find_kick

   !> What is left of a length when the nearest multiple of a period is taken off [m]
   elemental real(wp) function remainder_of(length, period) result(rest)
      real(wp), intent(in) :: length, period

      rest = length - period*anint(length/period)
   end function remainder_of

   !> Change the size of a stress-controlled cell by its motion in a step, by velocity Verlet.
   pure subroutine grow_cell(dt, cell)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> A cell with a load; the velocity of its size is predicted
      type(cell_t), intent(inout) :: cell
      real(wp) :: former(2)

      associate (load => cell%load)
         former = cell%size
         call load%axis%predict(dt)
         cell%size = load%axis%place
         load%stretch = cell%size/former
         cell%low = load%centre - 0.5_wp*cell%size
         cell%inverse = 1.0_wp/cell%size
      end associate
   end subroutine grow_cell

   !> Find displacement and velocity of the copy above at a time.
   elemental subroutine find_shear(cell, time, shift, jump)
      type(cell_t), intent(in) :: cell
      !> Simulated time [s]
      real(wp), intent(in) :: time
      !> Displacement [m] and velocity [m/s]
      real(wp), intent(out) :: shift, jump
      type(ramp_t) :: ramp

      ramp = cell%window%ramp_at(time)
      jump = cell%rate*cell%size(2)*ramp%factor
      shift = modulo(cell%first_shift + cell%rate*cell%size(2)*ramp%elapsed, cell%size(1))
   end subroutine find_shear

   !> The minimum image of a vector: that to the nearest copy of where it leads [m]
   pure function minimum_image(cell, inverse_period, vector) result(nearest)
      type(cell_t), intent(in) :: cell
      !> 1/size along both axes, or 0 along axes along which there are no copies [1/m]
      real(wp), intent(in) :: inverse_period(2)
      !> The vector [m]
      real(wp), intent(in) :: vector(2)
      real(wp) :: nearest(2), copies

      copies = rounded(vector(2)*inverse_period(2))
      nearest(2) = vector(2) - copies*cell%size(2)
      nearest(1) = vector(1) - copies*cell%shift
      nearest(1) = nearest(1) - rounded(nearest(1)*inverse_period(1))*cell%size(1)
   end function minimum_image

   !> Motion of the shear at a height: velocity along x and y [m/s], and rate of turn [rad/s]. It is at rest in the
   !> middle of the cell, grows linearly by the jump from border to border, and turns with half of its gradient,
   !> clockwise if this is positive. What a body has beyond it is the same for all copies of the body.
   pure function shear_flow(cell, height) result(flow)
      type(cell_t), intent(in) :: cell
      !> Place along y [m]
      real(wp), intent(in) :: height
      real(wp) :: flow(3), gradient

      flow = 0.0_wp
      if (.not. cell%is_sheared) return
      gradient = cell%jump/cell%size(2)
      flow(1) = gradient*(height - (cell%low(2) + 0.5_wp*cell%size(2)))
      flow(3) = -0.5_wp*gradient
   end function shear_flow

   !> The copy of a point that is in the cell [m]
   pure function into_cell(cell, point) result(place)
      type(cell_t), intent(in) :: cell
      !> The point [m]
      real(wp), intent(in) :: point(2)
      real(wp) :: place(2), crossed

      crossed = real(floor((point(2) - cell%low(2))*cell%inverse(2), ip), wp)
      place(2) = point(2) - crossed*cell%size(2)
      place(1) = point(1) - crossed*cell%shift
      place(1) = place(1) - real(floor((place(1) - cell%low(1))*cell%inverse(1), ip), wp)*cell%size(1)
   end function into_cell

   !> Number of copies of a point that are in a rectangle, its lower and left edges included; in the plane 1 or 0
   pure integer(ip) function copies_within(cell, low, high, point) result(n)
      type(cell_t), intent(in) :: cell
      !> Lower left and upper right corner [m]
      real(wp), intent(in) :: low(2), high(2)
      !> The point [m]
      real(wp), intent(in) :: point(2)
      integer(ip) :: rows(2), columns(2), row

      n = 0_ip
      rows = copies_between(low(2), high(2), point(2), cell%size(2))
      do row = rows(1), rows(2)
         columns = copies_between(low(1), high(1), point(1) + real(row, wp)*cell%shift, cell%size(1))
         n = n + max(0_ip, columns(2) - columns(1) + 1_ip)
      end do
   end function copies_within

   !> Numbers of the first and the last copy of a place that are in an interval, its lower end included. An interval as
   !> long as the cell has one copy of each place, whatever the rounding.
   pure function copies_between(low, high, place, period) result(copies)
      !> Ends of the interval, and the place [m]
      real(wp), intent(in) :: low, high, place
      !> Distance of copies; 0: there are none [m]
      real(wp), intent(in) :: period
      integer(ip) :: copies(2)

      if (period > 0.0_wp) then
         copies = [ceiling((low - place)/period, ip), ceiling((high - place)/period, ip) - 1_ip]
         if (abs(high - low - period) <= same_length*period) copies(2) = copies(1)
      else
         copies = [0_ip, merge(0_ip, -1_ip, place >= low .and. place < high)]
      end if
   end function copies_between

   !> Number of cells along y to the copy from which a distance leads to the nearest one
   elemental real(wp) function copies_along_y(cell, distance)
      type(cell_t), intent(in) :: cell
      !> Distance along y [m]
      real(wp), intent(in) :: distance

      copies_along_y = rounded(distance*cell%inverse(2))
   end function copies_along_y

   !> The nearest whole number; the bits are the same with every instruction set
   elemental real(wp) function rounded(number)
      real(wp), intent(in) :: number

      rounded = (number + rounder) - rounder
   end function rounded

   !> Replace the vectors between the bodies of some pairs by their minimum images.
   pure subroutine find_minimum_images(cell, n, first, second, inverse_period, offset)
      type(cell_t), intent(in) :: cell
      !> Number of pairs, and slots of their bodies
      integer(ip), intent(in) :: n, first(:), second(:)
      !> That of each body, as in `bodies_t`, (2, slot) [1/m]
      real(wp), intent(in), contiguous :: inverse_period(:, :)
      !> Vectors from the first to the second body, (pair, x or y) [m]
      real(wp), intent(inout) :: offset(:, :)
      integer(ip) :: c

      do c = 1_ip, n
         offset(c, :) = minimum_image(cell, min(inverse_period(:, first(c)), inverse_period(:, second(c))), &
                                      offset(c, :))
      end do
   end subroutine find_minimum_images

end module polydem_cell
