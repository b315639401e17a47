!> Simulations of complete scenes, for the tests of guards.
module guarded
   use polydem_errors, only: error_t
   use polydem_read_settings, only: read_settings_text
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start, only: new_simulation
   implicit none
   private
   public :: settings_of, start, soft, stack

   !> Polygons with deep initial overlaps
   character(len=*), parameter :: soft = &
      "&scene name = 'gas' bodies = 60 solid_fraction = 0.4 overlap = .true. speed = 0 /"// &
      '&forces gravity = 0, 0 /&integrate dt = 1e-6 duration = 1e-3 /'
   !> A stack of squares at rest
   character(len=*), parameter :: stack = "&scene name = 'stack' bodies = 5 width = 0.01 height = 0.01 /"// &
      '&integrate duration = 1 /'

contains

   !> Settings from a namelist and overrides
   subroutine settings_of(text, overrides, settings, error)
      !> Groups of the namelist
      character(len=*), intent(in) :: text
      !> Each 'group.key=value'
      character(len=*), intent(in) :: overrides(:)
      !> The settings
      type(settings_t), intent(out) :: settings
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      call read_settings_text('test.nml', text, overrides, settings, error)
   end subroutine settings_of

   !> Start a simulation from a namelist and overrides.
   subroutine start(text, overrides, simulation, error)
      !> Groups of the namelist
      character(len=*), intent(in) :: text
      !> Each 'group.key=value'
      character(len=*), intent(in) :: overrides(:)
      !> The simulation
      type(simulation_t), intent(out) :: simulation
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings

      call settings_of(text, overrides, settings, error)
      if (.not. allocated(error)) call new_simulation(settings, simulation, error)
   end subroutine start

end module guarded
