!> A stress-controlled periodic cell.
!>
!> Each controlled axis has one degree of freedom, the size L. With the stress s of the contacts
!> (Love-Weber, without the motion of the bodies), the prescribed stress p, mass M and damping c of the cell
!>
!>     M d2L/dt2 = (s - p) L' - c dL/dt,
!>
!> L' being the size along the other axis (H.C. Andersen, J. Chem. Phys. 72 (1980) 2384, with a damping), integrated as
!> the wall of a load is (`polydem_driven`). The kinetic energy of the cell is in no balance: that of the bodies has the
!> work of the contacts on it.
!>
!> The stress is a sum over all contacts in each step. Each product of force and distance is rounded to a multiple of a
!> unit, so that the sum is one of integers: it has the same bits for any number of threads and ranks. The unit is 2^-44
!> of E d2, d being the greatest diameter; a sum may reach 5e5 of this product.
module polydem_cell_load
   use polydem_cell, only: cell_load_t, cell_t
   use polydem_communicator, only: communicator_t
   use polydem_contact_block, only: contact_block_t
   use polydem_force_sums, only: contact_terms_t, of_elastic, of_normal, of_tangential, sum_x, sum_y
   use polydem_kinds, only: ip, lp, wp
   use polydem_ramp, only: ramp_t
   use polydem_serializer, only: serializer_t
   implicit none
   private
   public :: set_cell_mass, add_virial, accelerate_cell, serialize_cell

   !> Logarithm to base 2 of E d2 over the unit
   integer, parameter :: unit_bits = 44

contains

   !> Set mass, damping and unit of a stress-controlled cell.
   pure subroutine set_cell_mass(usual, stiffness, diameter, load)
      !> Mass of a cell without a mass of its own [kg/m]
      real(wp), intent(in) :: usual
      !> Stiffness E of the contacts [N/m2]
      real(wp), intent(in) :: stiffness
      !> Greatest diameter of a body [m]
      real(wp), intent(in) :: diameter
      type(cell_load_t), intent(inout) :: load

      call load%axis%set_mass(usual, stiffness, 1.0_wp)
      load%unit = scale(1.0_wp, exponent(stiffness*diameter*diameter) - unit_bits)
   end subroutine set_cell_mass

   !> Add force times distance of the contacts of a block.
   pure subroutine add_virial(unit, block, terms, counts, virial)
      !> Unit of the sums [N]
      real(wp), intent(in) :: unit
      type(contact_block_t), intent(in) :: block
      !> Their terms
      type(contact_terms_t), intent(in) :: terms
      !> Whether each contact counts on this rank, (contact)
      logical, intent(in) :: counts(:)
      !> Sums of the elastic, the other normal and the tangential forces on the first bodies times the distance to the
      !> second ones, (axis, kind of force) [unit]
      integer(lp), intent(inout) :: virial(2, 3)
      real(wp) :: distance(2), force(2, 3)
      integer(ip) :: c
      integer :: k

      do c = 1_ip, block%n
         if (.not. counts(c)) cycle
         distance = (block%arm_first(c, :) - block%arm_second(c, :))/unit
         force(1, :) = terms%first([sum_x(of_elastic), sum_x(of_normal), sum_x(of_tangential)], c)
         force(2, :) = terms%first([sum_y(of_elastic), sum_y(of_normal), sum_y(of_tangential)], c)
         force(:, 2) = force(:, 2) - force(:, 1)
         do k = 1, 3
            virial(:, k) = virial(:, k) + rounded(distance*force(:, k))
         end do
      end do
   end subroutine add_virial

   !> The nearest integer, with bounds that no sensible contact reaches
   elemental integer(lp) function rounded(number)
      real(wp), intent(in) :: number
      real(wp), parameter :: most = 2.0_wp**56

      rounded = int(min(max(number, -most), most) + sign(0.5_wp, number), lp)
   end function rounded

   !> Find the velocity of the size from the contacts. The size does not change. Collective.
   subroutine accelerate_cell(comm, dt, time, virial, cell)
      class(communicator_t), intent(inout) :: comm
      !> Time step; 0 at the start of the run [s]
      real(wp), intent(in) :: dt
      !> Time at the end of the step [s]
      real(wp), intent(in) :: time
      !> Sums of the contacts of this rank as in `add_virial`
      integer(lp), intent(in) :: virial(2, 3)
      !> A cell with a load
      type(cell_t), intent(inout) :: cell
      integer(lp) :: sums(6)
      real(wp) :: total(2, 3), force
      integer :: axis

      sums = reshape(virial, [6])
      call comm%all_reduce_sum(sums)
      associate (load => cell%load)
         total = load%unit*real(reshape(sums, [2, 3]), wp)
         do axis = 1, 2
            if (.not. load%is_controlled(axis)) cycle
            ! In compression the forces are against the distances.
            force = -sum(total(axis, :))/cell%size(axis) - present_stress(load, axis, time)*cell%size(3 - axis)
            call load%axis(axis)%correct(dt, time, force)
         end do
         load%power = -matmul(load%axis%speed/cell%size, total)
         if (dt > 0.0_wp) load%power_sum = load%power_sum + load%power
         if (.not. dt > 0.0_wp) load%power_sum = 0.5_wp*load%power
      end associate
   end subroutine accelerate_cell

   !> Prescribed stress along an axis at a time [N/m2]
   pure real(wp) function present_stress(load, axis, time) result(stress)
      type(cell_load_t), intent(in) :: load
      integer, intent(in) :: axis
      real(wp), intent(in) :: time
      type(ramp_t) :: ramp

      ramp = load%axis(axis)%ramp_at(time)
      stress = load%stress(axis)*ramp%factor
   end function present_stress

   !> Serialize the motion of a stress-controlled cell.
   subroutine serialize_cell(cell, serializer)
      !> A cell with a load
      type(cell_t), intent(inout) :: cell
      class(serializer_t), intent(inout) :: serializer
      real(wp) :: values(11)

      values = [cell%size, cell%load%axis%speed, cell%load%axis%change, cell%shift, cell%jump, cell%load%power_sum]
      call serializer%field('/run/cell', values, '1', 'size of the periodic cell, its velocity and acceleration, '// &
                            'shift and jump, and sums of powers, in SI units')
      if (.not. serializer%is_reading .or. allocated(serializer%error)) return
      cell%size = values(1:2)
      cell%load%axis%place = cell%size
      cell%load%axis%speed = values(3:4)
      cell%load%axis%change = values(5:6)
      cell%shift = values(7)
      cell%jump = values(8)
      cell%load%power_sum = values(9:11)
      cell%load%power = 0.0_wp
      cell%low = cell%load%centre - 0.5_wp*cell%size
      cell%inverse = 1.0_wp/cell%size
   end subroutine serialize_cell

end module polydem_cell_load
