!> The parameters of contacts, for each pair of materials: those of &forces, &material and &contact_pair.
!>
!> A material that does not give a parameter has that of &forces. Two different materials are mixed by the rule that the
!> row of the parameter in `entries.txt` has, unless a &contact_pair gives the value:
!>
!> * harmonic mean 2 E1 E2/(E1 + E2) of the stiffness: each body deforms as if it were half of the contact, and both
!>   halves bear the same force;
!> * the least restitution, friction coefficient and coefficient of rolling friction: the more dissipative and the
!>   smoother body decide;
!> * mean of damping coefficient and ratio of tangential stiffness;
!> * geometric mean of cohesion, so a material without cohesion sticks to none.
!>
!> Bodies without a material have number 0 and the values of &forces.
module polydem_pair_parameters
   use polydem_kinds, only: ip, wp
   use polydem_pair_entries, only: at_stiffness, at_tangential_stiffness, common_values, mixed_values, n_pair_entries, &
      take_contact_pair, take_material
   use polydem_pair_values, only: pair_parameters_t, set_parameters
   use polydem_settings, only: forces_settings_t, settings_t
   implicit none
   private
   public :: pair_parameters_t, pair_parameters, uniform_parameters, material_number, density_of

contains

   !> Parameters of the contacts of a run
   pure type(pair_parameters_t) function pair_parameters(settings, forces) result(pairs)
      !> Settings: groups &material and &contact_pair
      type(settings_t), intent(in) :: settings
      !> Group &forces
      type(forces_settings_t), intent(in) :: forces
      real(wp), allocatable :: values(:, :), table(:, :, :)
      integer(ip) :: i, j, k, n

      n = 0_ip
      if (allocated(settings%material)) n = size(settings%material, kind=ip)
      allocate (values(n_pair_entries, 0:n), table(0:n, 0:n, n_pair_entries))
      do i = 0_ip, n
         values(:, i) = common_values(forces)
         if (i > 0_ip) call take_material(settings%material(i), values(:, i))
      end do
      do j = 0_ip, n
         do i = 0_ip, n
            table(i, j, :) = mixed_values(values(:, i), values(:, j))
         end do
      end do
      if (n > 0_ip) then
         do k = 1_ip, size(settings%contact_pair, kind=ip)
            associate (pair => settings%contact_pair(k))
               i = material_number(settings, pair%materials(1)%text)
               j = material_number(settings, pair%materials(2)%text)
               call take_contact_pair(pair, table(i, j, :))
               table(j, i, :) = table(i, j, :)
            end associate
         end do
      end if
      call set_parameters(pairs, with_tangential(table), common_factors(forces))
   end function pair_parameters

   !> Parameters of contacts between bodies without materials
   pure type(pair_parameters_t) function uniform_parameters(forces) result(pairs)
      !> Group &forces
      type(forces_settings_t), intent(in) :: forces
      real(wp) :: table(0:0, 0:0, n_pair_entries)

      table(0, 0, :) = common_values(forces)
      call set_parameters(pairs, with_tangential(table), common_factors(forces))
   end function uniform_parameters

   !> The table with the tangential stiffness in N/m2, not in units of the stiffness
   pure function with_tangential(table) result(changed)
      !> Values of each pair of materials, as in the namelist, (0:n, 0:n, parameter)
      real(wp), intent(in) :: table(0:, 0:, :)
      real(wp), allocatable :: changed(:, :, :)

      changed = table
      changed(:, :, at_tangential_stiffness) = table(:, :, at_tangential_stiffness)*table(:, :, at_stiffness)
   end function with_tangential

   !> Factor that all values of a parameter have in common where they differ: stiffnesses in units of that of &forces
   pure function common_factors(forces) result(factors)
      type(forces_settings_t), intent(in) :: forces
      real(wp) :: factors(n_pair_entries)

      factors = 1.0_wp
      factors(at_stiffness) = forces%stiffness
      factors(at_tangential_stiffness) = forces%tangential_stiffness*forces%stiffness
   end function common_factors

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
