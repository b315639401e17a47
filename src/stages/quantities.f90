!> Quantities of the whole sample at the end of a step, from exact sums over all ranks.
!>
!> All ranks get the same bits for any number of ranks and threads and with any finder. Those that need contacts need
!> the table of contacts of the step (`advance` with `tabulate`).
module polydem_quantities
   use polydem_bodies, only: bodies_t
   use polydem_cell, only: cell_t, copies_within
   use polydem_communicator, only: communicator_t
   use polydem_contact_resultant, only: find_resultant
   use polydem_contacts, only: contact_force, contacts_t
   use polydem_elementary, only: hypotenuse
   use polydem_exact_all_reduce, only: all_reduce_exact_sums
   use polydem_exact_sum, only: exact_sum_t
   use polydem_force_sums, only: force_sums_t, total_forces
   use polydem_kinds, only: ip, lp, wp
   use polydem_ownership, only: owns_pair
   use polydem_sample_area, only: sample_area_t
   use polydem_sort, only: ascending_order
   implicit none
   private
   public :: kinetic_energy, unbalanced_force, coordination, count_grains, solid_fraction, stress, flow, &
      inertial_number

contains

   !> Find the kinetic energy per free body [J/m]; 0 if there is none. Collective.
   subroutine kinetic_energy(bodies, comm, energy)
      type(bodies_t), intent(in) :: bodies
      class(communicator_t), intent(inout) :: comm
      !> Mean kinetic energy of translation and rotation
      real(wp), intent(out) :: energy
      real(wp) :: total(2)
      type(exact_sum_t) :: sums(2)
      integer(ip) :: k

      do k = 1_ip, size(bodies%free, kind=ip)
         associate (s => bodies%free(k))
            call sums(1)%add(0.5_wp*bodies%mass(s)*(bodies%velocity(1, s)**2 + bodies%velocity(2, s)**2) &
                             + 0.5_wp*bodies%inertia(s)*bodies%angular_velocity(s)**2)
            call sums(2)%add(1.0_wp)
         end associate
      end do
      call all_reduce_exact_sums(comm, sums)
      total = sums%value()
      energy = ratio(total(1), total(2))
   end subroutine kinetic_energy

   !> Find the unbalanced force: the mean magnitude of the total force on a free body, with gravity, over the mean
   !> magnitude of the force of a contact. Huge if there is no contact. Collective.
   subroutine unbalanced_force(gravity, contacts, comm, bodies, force_sums, unbalanced)
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Table of the contacts of this step
      type(contacts_t), intent(in) :: contacts
      class(communicator_t), intent(inout) :: comm
      !> Bodies; the total forces are set
      type(bodies_t), intent(inout) :: bodies
      type(force_sums_t), intent(inout) :: force_sums
      !> Ratio of the means
      real(wp), intent(out) :: unbalanced
      type(exact_sum_t) :: sums(4)
      real(wp) :: total(4), force(2)
      integer(ip) :: c, k

      call total_forces(gravity, force_sums, bodies)
      do k = 1_ip, size(bodies%free, kind=ip)
         call sums(1)%add(hypotenuse(bodies%force(1, bodies%free(k)), bodies%force(2, bodies%free(k))))
         call sums(2)%add(1.0_wp)
      end do
      do c = 1_ip, contacts%n
         if (.not. owns_pair(bodies, contacts%row(c)%first, contacts%row(c)%second)) cycle
         force = contact_force(contacts, c)
         call sums(3)%add(hypotenuse(force(1), force(2)))
         call sums(4)%add(1.0_wp)
      end do
      call all_reduce_exact_sums(comm, sums)
      total = sums%value()
      unbalanced = huge(1.0_wp)
      if (total(3) > 0.0_wp) unbalanced = ratio(total(1), total(2))/ratio(total(3), total(4))
   end subroutine unbalanced_force

   !> Find the coordination: the mean number of bodies that a free body touches, also of fixed ones. Contacts of several
   !> pieces of the same two bodies count once. Collective.
   subroutine coordination(bodies, contacts, comm, number)
      type(bodies_t), intent(in) :: bodies
      !> Table of the contacts of this step
      type(contacts_t), intent(in) :: contacts
      class(communicator_t), intent(inout) :: comm
      !> Mean number of bodies
      real(wp), intent(out) :: number
      logical, allocatable :: is_another(:)
      integer(lp) :: counts(2)
      integer(ip) :: c

      counts = [0_lp, size(bodies%free, kind=lp)]
      if (bodies%pieces%most > 1_ip) call find_pairs(contacts, is_another)
      do c = 1_ip, contacts%n
         if (allocated(is_another)) then
            if (.not. is_another(c)) cycle
         end if
         counts(1) = counts(1) + merge(1_lp, 0_lp, is_mine(bodies, contacts%row(c)%first)) &
                     + merge(1_lp, 0_lp, is_mine(bodies, contacts%row(c)%second))
      end do
      call comm%all_reduce_sum(counts)
      number = ratio(real(counts(1), wp), real(counts(2), wp))
   end subroutine coordination

   !> Find out which contacts are the first ones of their two bodies in the table.
   pure subroutine find_pairs(contacts, is_another)
      type(contacts_t), intent(in) :: contacts
      !> Whether no contact before has the same two bodies, (contact)
      logical, allocatable, intent(out) :: is_another(:)
      integer(lp), allocatable :: pairs(:)
      integer(ip), allocatable :: order(:)
      integer(ip) :: k

      allocate (is_another(contacts%n), source=.true.)
      allocate (pairs(contacts%n), order(contacts%n))
      do k = 1_ip, contacts%n
         pairs(k) = ishft(int(contacts%row(k)%first, lp), 32) + int(contacts%row(k)%second, lp)
      end do
      order(:) = ascending_order(pairs)
      do k = 2_ip, contacts%n
         is_another(order(k)) = pairs(order(k)) /= pairs(order(k - 1_ip))
      end do
   end subroutine find_pairs

   !> Count the free bodies whose centres are in a rectangle; in a periodic cell each copy counts. Collective.
   subroutine count_grains(bodies, comm, low, high, number)
      type(bodies_t), intent(in) :: bodies
      class(communicator_t), intent(inout) :: comm
      !> Lower left and upper right corner of the rectangle, (2) [m]
      real(wp), intent(in) :: low(2), high(2)
      !> Their number
      real(wp), intent(out) :: number
      integer(lp) :: counts(1)
      integer(ip) :: k

      counts = 0_lp
      do k = 1_ip, size(bodies%free, kind=ip)
         counts = counts + int(copies_within(bodies%cell, low, high, bodies%position(:, bodies%free(k))), lp)
      end do
      call comm%all_reduce_sum(counts)
      number = real(counts(1), wp)
   end subroutine count_grains

   !> Find the solid fraction in an area: the area of the free bodies whose centres are in it, over its area.
   !> Collective.
   subroutine solid_fraction(bodies, comm, area, fraction)
      type(bodies_t), intent(in) :: bodies
      class(communicator_t), intent(inout) :: comm
      !> The area
      type(sample_area_t), intent(in) :: area
      !> The fraction; overlaps count twice
      real(wp), intent(out) :: fraction
      type(exact_sum_t) :: sums(1)
      real(wp) :: total(1)
      integer(ip) :: copies, k

      do k = 1_ip, size(bodies%free, kind=ip)
         associate (s => bodies%free(k))
            copies = copies_within(bodies%cell, area%low, area%high, bodies%position(:, s))
            if (copies > 0_ip) call sums(1)%add(real(copies, wp)*bodies%pieces%area_of(s))
         end associate
      end do
      call all_reduce_exact_sums(comm, sums)
      total = sums%value()
      fraction = total(1)/(area%size(1)*area%size(2))
   end subroutine solid_fraction

   !> Find the mean stress of the contacts in an area: the sum over the contacts of the free bodies in it of the outer
   !> product of the vector from the centre of the body to the point where the force acts and the force on the body,
   !> over the area, with the sign of soil mechanics: positive in compression. For contacts in equilibrium this is the
   !> formula of Love and Weber; it is symmetric unless contacts have a couple. Collective.
   subroutine stress(bodies, contacts, comm, area, tensor)
      type(bodies_t), intent(in) :: bodies
      !> Table of the contacts of this step
      type(contacts_t), intent(in) :: contacts
      class(communicator_t), intent(inout) :: comm
      !> Area of the sample
      type(sample_area_t), intent(in) :: area
      !> Stress, (direction of the vector, direction of the force) [N/m2]
      real(wp), intent(out) :: tensor(2, 2)
      type(exact_sum_t) :: sums(4)
      real(wp) :: force(2), shift(2), couple
      integer(ip) :: c, copies(2)

      do c = 1_ip, contacts%n
         copies = [copies_of(contacts%row(c)%first), copies_of(contacts%row(c)%second)]
         if (all(copies == 0_ip)) cycle
         force = contact_force(contacts, c)
         call find_resultant(bodies, contacts, c, shift, couple)
         call add(copies(1), contacts%row(c)%arm_first + shift, force)
         call add(copies(2), contacts%row(c)%arm_second + shift, -force)
      end do
      call all_reduce_exact_sums(comm, sums)
      tensor = reshape(-sums%value(), [2, 2])/area%size(1)/area%size(2)

   contains

      !> Add the outer product of an arm and a force for each copy.
      subroutine add(copies, arm, force)
         integer(ip), intent(in) :: copies
         real(wp), intent(in) :: arm(2), force(2)
         integer :: i, j

         if (copies == 0_ip) return
         do j = 1, 2
            do i = 1, 2
               call sums(2*(j - 1) + i)%add(real(copies, wp)*(arm(i)*force(j)))
            end do
         end do
      end subroutine add

      !> Number of copies of a body in the area; 0 if this rank does not move it
      pure integer(ip) function copies_of(s)
         !> Slot of the body
         integer(ip), intent(in) :: s

         copies_of = 0_ip
         if (is_mine(bodies, s)) copies_of = copies_within(bodies%cell, area%low, area%high, bodies%position(:, s))
      end function copies_of

   end subroutine stress

   !> Find the rate at which the bodies in an area shear: that of the linear field of velocities that fits them best, by
   !> least squares; and the mean size and density of these bodies. Along an axis of a periodic cell the field does not
   !> change, but for the jump at the border of a sheared cell. Collective.
   subroutine flow(bodies, comm, area, rate, diameter, density)
      type(bodies_t), intent(in) :: bodies
      class(communicator_t), intent(inout) :: comm
      !> Area of the sample
      type(sample_area_t), intent(in) :: area
      !> Difference of the principal rates of strain, which is the rate of a simple shear; 0 without bodies [1/s]
      real(wp), intent(out) :: rate
      !> Diameter of a circle with the mean area of the bodies [m], and their mass over their area [kg/m3]
      real(wp), intent(out) :: diameter, density
      !> Twice the square root of 1/pi
      real(wp), parameter :: diameter_of_area = 1.1283791670955126_wp
      type(exact_sum_t) :: sums(14)
      real(wp) :: total(14), x(2), v(2)
      integer(ip) :: copies, k
      integer :: i

      associate (cell => bodies%cell)
         do k = 1_ip, size(bodies%free, kind=ip)
            associate (s => bodies%free(k))
               copies = copies_within(cell, area%low, area%high, bodies%position(:, s))
               if (copies == 0_ip) cycle
               x = merge(0.0_wp, bodies%position(:, s) - area%low, cell%size > 0.0_wp)
               v = bodies%velocity(:, s)
               total = [1.0_wp, bodies%pieces%area_of(s), bodies%mass(s), x, v, &
                        x(1)*x(1), x(1)*x(2), x(2)*x(2), x(1)*v(1), x(1)*v(2), x(2)*v(1), x(2)*v(2)]
            end associate
            do i = 1, size(sums)
               call sums(i)%add(real(copies, wp)*total(i))
            end do
         end do
         call all_reduce_exact_sums(comm, sums)
         total = sums%value()
         diameter = diameter_of_area*sqrt(ratio(total(2), total(1)))
         density = ratio(total(3), total(2))
         rate = rate_of_shear(total/max(total(1), 1.0_wp), cell)
      end associate
   end subroutine flow

   !> Difference of the principal rates of strain of the field that fits velocities [1/s]
   pure real(wp) function rate_of_shear(mean, cell) result(rate)
      !> Means over bodies, in the order of `flow`
      real(wp), intent(in) :: mean(14)
      type(cell_t), intent(in) :: cell
      real(wp) :: moment(2, 2), mixed(2, 2), gradient(2, 2)

      moment(1, :) = mean([8, 9]) - mean(4)*mean(4:5)
      moment(2, :) = mean([9, 10]) - mean(5)*mean(4:5)
      mixed(1, :) = mean(11:12) - mean(4)*mean(6:7)
      mixed(2, :) = mean(13:14) - mean(5)*mean(6:7)
      gradient = fitted(moment, mixed)
      if (cell%is_sheared) gradient(2, 1) = cell%jump/cell%size(2)
      rate = hypotenuse(gradient(1, 1) - gradient(2, 2), gradient(1, 2) + gradient(2, 1))
   end function rate_of_shear

   !> Gradient of the field that fits velocities, (axis of the place, axis of the velocity); 0 along an axis along which
   !> the places do not differ
   pure function fitted(moment, mixed) result(gradient)
      !> Covariances of the places, and of places and velocities (axis of the place, other axis)
      real(wp), intent(in) :: moment(2, 2), mixed(2, 2)
      real(wp) :: gradient(2, 2), determinant
      integer :: i

      gradient = 0.0_wp
      determinant = moment(1, 1)*moment(2, 2) - moment(1, 2)*moment(1, 2)
      if (determinant > 1.0e-9_wp*moment(1, 1)*moment(2, 2)) then
         gradient(1, :) = (moment(2, 2)*mixed(1, :) - moment(1, 2)*mixed(2, :))/determinant
         gradient(2, :) = (moment(1, 1)*mixed(2, :) - moment(1, 2)*mixed(1, :))/determinant
         return
      end if
      do i = 1, 2
         if (moment(i, i) > moment(3 - i, 3 - i)) gradient(i, :) = mixed(i, :)/moment(i, i)
      end do
   end function fitted

   !> Inertial number of a flow in the plane, the shear rate times d sqrt(rho/P) (GDR MiDi, Eur. Phys. J. E 14 (2004)
   !> 341): the ratio of the time in which pressure moves a grain by its diameter to that of the shear
   pure real(wp) function inertial_number(shear_rate, diameter, density, pressure) result(number)
      !> Shear rate [1/s]
      real(wp), intent(in) :: shear_rate
      !> Diameter of a grain [m]
      real(wp), intent(in) :: diameter
      !> Density of a grain [kg/m3]
      real(wp), intent(in) :: density
      !> Pressure [N/m2]
      real(wp), intent(in) :: pressure

      number = huge(1.0_wp)
      if (pressure > 0.0_wp) number = abs(shear_rate)*diameter*sqrt(density/pressure)
   end function inertial_number

   !> Whether this rank moves a body
   pure logical function is_mine(bodies, s)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s

      is_mine = .not. (bodies%fixed(s) .or. bodies%in_halo(s))
   end function is_mine

   !> A quotient; 0 if the divisor is 0
   pure real(wp) function ratio(dividend, divisor)
      real(wp), intent(in) :: dividend, divisor

      ratio = 0.0_wp
      if (divisor > 0.0_wp) ratio = dividend/divisor
   end function ratio

end module polydem_quantities
