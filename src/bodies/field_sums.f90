!> Forces on bodies that are no contacts, as part of the sums of all forces.
module polydem_field_sums
   use polydem_bodies, only: bodies_t
   use polydem_force_sums, only: force_sums_t, of_normal, sum_torque, sum_x, sum_y
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: reserve_field, reserve_given, add_field, accelerate_by_fields

contains

   !> Make room for forces on n bodies that are no contacts. New ones are zero.
   subroutine reserve_field(n, sums)
      !> Number of bodies
      integer(ip), intent(in) :: n
      type(force_sums_t), intent(inout) :: sums

      sums%are_in_bodies = .false.
      call reserve(n, sums%field)
   end subroutine reserve_field

   !> Make room for the part of these forces that actions give to n bodies. New ones are zero.
   subroutine reserve_given(n, sums)
      !> Number of bodies
      integer(ip), intent(in) :: n
      type(force_sums_t), intent(inout) :: sums

      call reserve(n, sums%given)
   end subroutine reserve_given

   !> Allocate forces on n bodies with zeros, unless there are as many.
   subroutine reserve(n, forces)
      !> Number of bodies
      integer(ip), intent(in) :: n
      !> The forces, (3, n)
      real(wp), allocatable, intent(inout) :: forces(:, :)

      if (allocated(forces)) then
         if (size(forces, 2) == n) return
         deallocate (forces)
      end if
      allocate (forces(3, n), source=0.0_wp)
   end subroutine reserve

   !> Add the forces on some bodies that are no contacts to their sums, among the normal forces that are not elastic.
   !> Several threads may call it for different bodies.
   pure subroutine add_field(slots, force, sums)
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Forces along x and y [N/m] and torques [N], (3, body)
      real(wp), intent(in) :: force(:, :)
      !> Sums after `reserve_field`
      type(force_sums_t), intent(inout) :: sums
      integer(ip) :: k

      do k = 1_ip, size(slots, kind=ip)
         associate (s => slots(k))
            sums%field(:, s) = force(:, k)
            sums%value(sum_x(of_normal), s) = sums%value(sum_x(of_normal), s) + force(1, k)
            sums%value(sum_y(of_normal), s) = sums%value(sum_y(of_normal), s) + force(2, k)
            sums%value(sum_torque(of_normal), s) = sums%value(sum_torque(of_normal), s) + force(3, k)
            sums%has_terms(s) = .true.
         end associate
      end do
   end subroutine add_field

   !> Add the accelerations by forces that are no contacts to those by gravity.
   pure subroutine accelerate_by_fields(sums, bodies)
      !> Sums with the forces that are no contacts, if there are any
      type(force_sums_t), intent(in) :: sums
      !> Bodies with the accelerations by gravity
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: k

      if (.not. allocated(sums%field)) return
      do k = 1_ip, size(bodies%free, kind=ip)
         associate (s => bodies%free(k))
            bodies%acceleration(:, s) = bodies%acceleration(:, s) + sums%field(1:2, s)*bodies%inverse_mass(s)
            bodies%angular_acceleration(s) = sums%field(3, s)*bodies%inverse_inertia(s)
         end associate
      end do
   end subroutine accelerate_by_fields

end module polydem_field_sums
