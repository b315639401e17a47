!> The list of the verification benchmarks, the only file with all of them.
!>
!> To add a benchmark, write a module with a procedure that fills the table (see `b09_stopping.f90`), and name it here
!> and in `CMakeLists.txt`.
module benchmarks
   use b01_free_flight, only: run_free_flight
   use b02_mass_properties, only: run_mass_properties
   use b03_momentum, only: run_momentum
   use b04_energy, only: run_energy
   use b05_closed_loops, only: run_closed_loops
   use b06_area_rate, only: run_area_rate
   use b07_reversal, only: run_reversal
   use b08_incline, only: run_incline
   use b09_stopping, only: run_stopping
   use b10_stick_slip, only: run_stick_slip
   use b11_sliding_to_rolling, only: run_sliding_to_rolling
   use b12_rolling_polygons, only: run_rolling_polygons
   use b13_rocking_block, only: run_rocking_block
   use b14_stack, only: run_stack
   use b15_overhang, only: run_overhang
   use b16_arch, only: run_arch
   use b17_dominoes, only: run_dominoes
   use b18_cooling_gas, only: run_cooling_gas
   use b19_hopper, only: run_hopper
   use b20_heap, only: run_heap
   use b21_drum_froude, only: run_drum_froude
   use b22_automatic_step, only: run_automatic_step
   use b23_rest, only: run_rest
   use b24_cut_floor, only: run_cut_floor
   use b25_periodic_cell, only: run_periodic_cell
   use b26_sheared_cell, only: run_sheared_cell
   use b27_sources, only: run_sources
   use b28_pieces, only: run_pieces
   use b29_accelerations, only: run_accelerations
   use b30_loads, only: run_loads
   use b31_materials, only: run_materials
   use b32_rolling_resistance, only: run_rolling_resistance
   use b33_controlled_cell, only: run_controlled_cell
   use b34_arches, only: run_arches
   use s32_flat_impact, only: run_flat_impact
   use s33_corner_impact, only: run_corner_impact
   use s34_oblique_impact, only: run_oblique_impact
   use verification_table, only: table_t
   implicit none
   private
   public :: benchmark_names, long_names, run_benchmark

   !> Names in the order in which they run
   character(len=8), parameter :: benchmark_names(*) = [character(len=8) :: &
      'B1', 'B2', 'B3', '3.2', '3.3', '3.4', 'B4', 'B5', 'B6', 'B7', 'B8', 'B9', 'B10', 'B11', 'B12', 'B13', &
      'B14', 'B15', 'B16', 'B17', 'B18', 'B19', 'B20', 'B21', 'B22', 'B23', 'B24', 'B25', 'B26', 'B27', 'B28', &
      'B29', 'B30', 'B31', 'B32', 'B33', 'B34']
   !> Benchmarks without a short version
   character(len=8), parameter :: long_names(*) = [character(len=8) :: 'B17', 'B19', 'B20', 'B21']

contains

   !> Run one benchmark.
   subroutine run_benchmark(name, table, thorough)
      !> One of benchmark_names
      character(len=*), intent(in) :: name
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to run the long version; `long_names` have no short version
      logical, intent(in) :: thorough

      select case (name)
      case ('B1')
         call run_free_flight(table, thorough)
      case ('B2')
         call run_mass_properties(table, thorough)
      case ('B3')
         call run_momentum(table, thorough)
      case ('3.2')
         call run_flat_impact(table, thorough)
      case ('3.3')
         call run_corner_impact(table)
      case ('3.4')
         call run_oblique_impact(table)
      case ('B4')
         call run_energy(table)
      case ('B5')
         call run_closed_loops(table)
      case ('B6')
         call run_area_rate(table, thorough)
      case ('B7')
         call run_reversal(table)
      case ('B8')
         call run_incline(table, thorough)
      case ('B9')
         call run_stopping(table)
      case ('B10')
         call run_stick_slip(table)
      case ('B11')
         call run_sliding_to_rolling(table)
      case ('B12')
         call run_rolling_polygons(table, thorough)
      case ('B13')
         call run_rocking_block(table, thorough)
      case ('B14')
         call run_stack(table, thorough)
      case ('B15')
         call run_overhang(table, thorough)
      case ('B16')
         call run_arch(table, thorough)
      case ('B17')
         call run_dominoes(table)
      case ('B18')
         call run_cooling_gas(table, thorough)
      case ('B19')
         call run_hopper(table)
      case ('B20')
         call run_heap(table)
      case ('B21')
         call run_drum_froude(table)
      case ('B22')
         call run_automatic_step(table, thorough)
      case ('B23')
         call run_rest(table, thorough)
      case ('B24')
         call run_cut_floor(table, thorough)
      case ('B25')
         call run_periodic_cell(table, thorough)
      case ('B26')
         call run_sheared_cell(table, thorough)
      case ('B27')
         call run_sources(table, thorough)
      case ('B28')
         call run_pieces(table, thorough)
      case ('B29')
         call run_accelerations(table)
      case ('B30')
         call run_loads(table, thorough)
      case ('B31')
         call run_materials(table)
      case ('B32')
         call run_rolling_resistance(table, thorough)
      case ('B33')
         call run_controlled_cell(table, thorough)
      case ('B34')
         call run_arches(table, thorough)
      end select
   end subroutine run_benchmark

end module benchmarks
