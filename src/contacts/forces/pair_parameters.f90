!> The parameters of contacts, for each pair of materials: those of &forces, &material and &contact_pair.
!>
!> A material that does not give a parameter has that of &forces. Two different materials are mixed by one rule per
!> parameter, unless a &contact_pair gives the value:
!>
!> * stiffness: harmonic mean, 2 E1 E2/(E1 + E2). Each body deforms as if it were half of the contact, and both halves
!>   bear the same force;
!> * restitution, friction coefficient and coefficient of rolling friction: the smaller one, since the more dissipative
!>   and the smoother body decide;
!> * damping coefficient and ratio of tangential stiffness: arithmetic mean;
!> * cohesion: geometric mean, so a material without cohesion sticks to none.
!>
!> Bodies without a material have number 0 and the values of &forces.
module polydem_pair_parameters
   use polydem_kinds, only: ip, wp
   use polydem_pair_value, only: new_pair_value, pair_value_t
   use polydem_settings, only: forces_settings_t, settings_t
   implicit none
   private
   public :: pair_parameters_t, pair_parameters, uniform_parameters, material_number, density_of

   !> Parameters of contacts
   type :: pair_parameters_t
      !> Number of materials besides number 0
      integer(ip) :: n_materials = 0_ip
      !> Young's modulus in two dimensions E [N/m2]
      type(pair_value_t) :: stiffness
      !> Restitution of an impact; 0: the damping coefficient is used
      type(pair_value_t) :: restitution
      !> Damping coefficient gamma
      type(pair_value_t) :: damping_coefficient
      !> Friction coefficient mu
      type(pair_value_t) :: friction_coefficient
      !> Tangential stiffness k_t [N/m2]
      type(pair_value_t) :: tangential_stiffness
      !> Attraction per length of a contact [N/m2]
      type(pair_value_t) :: cohesion
      !> Coefficient of rolling friction mu_r
      type(pair_value_t) :: rolling_friction
   end type pair_parameters_t

   !> Number of parameters
   integer, parameter :: n_parameters = 7

contains

   !> Parameters of the contacts of a run
   pure type(pair_parameters_t) function pair_parameters(settings) result(pairs)
      !> Settings: groups &forces, &material and &contact_pair
      type(settings_t), intent(in) :: settings
      real(wp), allocatable :: values(:, :), table(:, :, :)
      integer(ip) :: i, j, k, n

      pairs = uniform_parameters(settings%forces)
      if (.not. allocated(settings%material)) return
      n = size(settings%material, kind=ip)
      if (n == 0_ip) return
      allocate (values(n_parameters, 0:n), table(0:n, 0:n, n_parameters))
      do i = 0_ip, n
         values(:, i) = [settings%forces%stiffness, settings%forces%restitution, settings%forces%damping_coefficient, &
                         settings%forces%friction_coefficient, settings%forces%tangential_stiffness, &
                         settings%forces%cohesion, settings%forces%rolling_friction]
         if (i == 0_ip) cycle
         associate (material => settings%material(i))
            call take(values(1, i), material%stiffness)
            call take(values(2, i), material%restitution)
            call take(values(3, i), material%damping_coefficient)
            call take(values(4, i), material%friction_coefficient)
            call take(values(5, i), material%tangential_stiffness)
            call take(values(6, i), material%cohesion)
            call take(values(7, i), material%rolling_friction)
         end associate
      end do
      do j = 0_ip, n
         do i = 0_ip, n
            table(i, j, :) = mixed(values(:, i), values(:, j))
         end do
      end do
      do k = 1_ip, size(settings%contact_pair, kind=ip)
         associate (pair => settings%contact_pair(k))
            i = material_number(settings, pair%materials(1)%text)
            j = material_number(settings, pair%materials(2)%text)
            call take(table(i, j, 1), pair%stiffness)
            call take(table(i, j, 2), pair%restitution)
            call take(table(i, j, 3), pair%damping_coefficient)
            call take(table(i, j, 4), pair%friction_coefficient)
            call take(table(i, j, 5), pair%tangential_stiffness)
            call take(table(i, j, 6), pair%cohesion)
            call take(table(i, j, 7), pair%rolling_friction)
            table(j, i, :) = table(i, j, :)
         end associate
      end do
      pairs%n_materials = n
      pairs%stiffness = new_pair_value(table(:, :, 1), settings%forces%stiffness)
      pairs%restitution = new_pair_value(table(:, :, 2), 1.0_wp)
      pairs%damping_coefficient = new_pair_value(table(:, :, 3), 1.0_wp)
      pairs%friction_coefficient = new_pair_value(table(:, :, 4), 1.0_wp)
      pairs%tangential_stiffness = new_pair_value(table(:, :, 5)*table(:, :, 1), pairs%tangential_stiffness%one)
      pairs%cohesion = new_pair_value(table(:, :, 6), 1.0_wp)
      pairs%rolling_friction = new_pair_value(table(:, :, 7), 1.0_wp)
   end function pair_parameters

   !> Parameters of contacts between bodies without materials
   pure type(pair_parameters_t) function uniform_parameters(forces) result(pairs)
      !> Group &forces
      type(forces_settings_t), intent(in) :: forces

      pairs%stiffness%one = forces%stiffness
      pairs%restitution%one = forces%restitution
      pairs%damping_coefficient%one = forces%damping_coefficient
      pairs%friction_coefficient%one = forces%friction_coefficient
      pairs%tangential_stiffness%one = forces%tangential_stiffness*forces%stiffness
      pairs%cohesion%one = forces%cohesion
      pairs%rolling_friction%one = forces%rolling_friction
   end function uniform_parameters

   !> Take a value if it is given.
   pure subroutine take(value, given)
      real(wp), intent(inout) :: value
      !> Absent if it is an unallocated component
      real(wp), intent(in), optional :: given

      if (present(given)) value = given
   end subroutine take

   !> The parameters of a pair of materials by the rules above. Equal ones are not changed, not even by rounding, and
   !> both orders give the same bits.
   pure function mixed(a, b)
      !> Parameters of both materials
      real(wp), intent(in) :: a(n_parameters), b(n_parameters)
      real(wp) :: mixed(n_parameters)

      mixed = [2.0_wp*min(a(1), b(1))*(max(a(1), b(1))/(a(1) + b(1))), min(a(2), b(2)), &
               0.5_wp*(a(3) + b(3)), min(a(4), b(4)), 0.5_wp*(a(5) + b(5)), &
               sqrt(a(6))*sqrt(b(6)), min(a(7), b(7))]
      where (abs(a - b) <= 0.0_wp) mixed = a
   end function mixed

   !> Number of a material; 0 for an empty name
   pure integer(ip) function material_number(settings, name) result(number)
      type(settings_t), intent(in) :: settings
      !> Its name, or an empty text
      character(len=*), intent(in) :: name

      number = 0_ip
      if (name == '') return
      do number = size(settings%material, kind=ip), 1_ip, -1_ip
         if (settings%material(number)%name == name) return
      end do
   end function material_number

   !> Density of a material [kg/m3]: that of &scene if it gives none
   pure real(wp) function density_of(settings, number) result(density)
      type(settings_t), intent(in) :: settings
      !> Number of the material
      integer(ip), intent(in) :: number

      density = settings%scene%density
      if (number == 0_ip) return
      if (allocated(settings%material(number)%density)) density = settings%material(number)%density
   end function density_of

end module polydem_pair_parameters
