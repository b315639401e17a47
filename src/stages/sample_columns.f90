!> Columns of the series of a run for the whole sample, and lines of the log with some of them.
module polydem_sample_columns
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
   use polydem_kinds, only: wp
   use polydem_named_values, only: named_values_t
   use polydem_quantities, only: coordination, flow, inertial_number, kinetic_energy, solid_fraction, stress, &
      unbalanced_force
   use polydem_sample_area, only: find_area, has_area, sample_area_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: index_of, to_text
   implicit none
   private
   public :: set_sample_columns, sample_text

contains

   !> Set the columns of the sample at the end of a step. Collective.
   subroutine set_sample_columns(simulation, row)
      !> The simulation with the table of contacts of this step
      type(simulation_t), intent(inout) :: simulation
      !> Row of the series
      type(named_values_t), intent(inout) :: row
      real(wp) :: value

      call kinetic_energy(simulation%bodies, simulation%comm, value)
      call row%set('kinetic_energy', value, 'J/m', 'mean kinetic energy of a free body')
      call unbalanced_force(simulation%forces%gravity, simulation%contacts, simulation%comm, &
                            simulation%bodies, simulation%loop%force_sums, value)
      call row%set('unbalanced_force', defined(value), '1', &
                   'mean total force on a free body over the mean force of a contact')
      call coordination(simulation%bodies, simulation%contacts, simulation%comm, value)
      call row%set('coordination', value, '1', 'mean number of bodies that a free body touches')
      if (has_area(simulation)) call set_averages(simulation, row)
   end subroutine set_sample_columns

   !> Write how the sample is: its forces, and with an area its averages there. Collective.
   subroutine sample_text(simulation, text)
      !> The simulation with the table of contacts of this step
      type(simulation_t), intent(inout) :: simulation
      !> One line, or two with an area
      character(len=:), allocatable, intent(out) :: text
      type(named_values_t) :: row

      call set_sample_columns(simulation, row)
      text = '           unbalanced '//value_of('unbalanced_force')//', coordination '//value_of('coordination')
      if (has_area(simulation)) text = text//new_line('a')//'           solid fraction '// &
         value_of('solid_fraction')//', stress xx '//value_of('stress_xx')//', xy '//value_of('stress_xy')// &
         ', yy '//value_of('stress_yy')//' N/m2, inertial number '//value_of('inertial_number')

   contains

      !> A value of the row; a dash if it is not defined
      pure function value_of(name) result(value)
         character(len=*), intent(in) :: name
         character(len=:), allocatable :: value

         associate (number => real(row%value(index_of(name, row%label%name)), wp))
            value = '-'
            if (ieee_is_finite(number)) value = to_text(number, 3)
         end associate
      end function value_of

   end subroutine sample_text

   !> Set the columns of averages over the area of the sample. Collective.
   subroutine set_averages(simulation, row)
      type(simulation_t), intent(inout) :: simulation
      type(named_values_t), intent(inout) :: row
      type(sample_area_t) :: area
      real(wp) :: tensor(2, 2), fraction, rate, diameter, density, number

      call find_area(simulation, area)
      call solid_fraction(simulation%bodies, simulation%comm, area, fraction)
      call stress(simulation%bodies, simulation%contacts, simulation%comm, area, tensor)
      call flow(simulation%bodies, simulation%comm, area, rate, diameter, density)
      number = inertial_number(rate, diameter, density, 0.5_wp*(tensor(1, 1) + tensor(2, 2)))
      call row%set('sample_width', area%size(1), 'm', 'width of the area of the sample')
      call row%set('sample_height', area%size(2), 'm', 'height of the area of the sample')
      call row%set('solid_fraction', fraction, '1', 'area of the free bodies in the sample over its area')
      call row%set('stress_xx', tensor(1, 1), 'N/m2', 'mean stress of the contacts of these bodies')
      call row%set('stress_xy', tensor(1, 2), 'N/m2', 'force along y on a face across x')
      call row%set('stress_yx', tensor(2, 1), 'N/m2', 'force along x on a face across y')
      call row%set('stress_yy', tensor(2, 2), 'N/m2', 'positive in compression')
      call row%set('shear_rate', rate, '1/s', 'difference of the principal rates of strain of these bodies')
      call row%set('inertial_number', defined(number), '1', 'shear rate times d sqrt(density/pressure)')
   end subroutine set_averages

   !> A ratio, which is not a number if its divisor is 0
   real(wp) function defined(value)
      !> The ratio, huge if its divisor is 0
      real(wp), intent(in) :: value

      defined = value
      if (value >= huge(1.0_wp)) defined = ieee_value(defined, ieee_quiet_nan)
   end function defined

end module polydem_sample_columns
