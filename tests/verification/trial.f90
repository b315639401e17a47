!> Simulations of a few bodies for the tests, from a namelist text and a list of polygons.
module trial
   use serial_simulation, only: start_simulation
   use polydem_bodies, only: bodies_t
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_energy_balance, only: balance_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_motion, only: motion_t
   use polydem_read_settings, only: read_settings_text
   use polydem_settings, only: settings_t
   use polydem_simulation, only: compute_balance, simulation_t
   use polydem_start, only: new_simulation
   use polydem_time_step, only: advance
   use polydem_walls, only: walls_t
   implicit none
   private
   public :: begin, begin_scene, steps, find_missing_energy, block_at

   !> Entries of &forces of the model that most expected values are for: the area law, with damping of its rate alone
   character(len=*), parameter, public :: area_law = " law = 'area' tilt_damping = 0"

contains

   !> Create a simulation from a list of bodies and a namelist without the group &scene.
   subroutine begin(text, list, simulation, error, motion, moved)
      !> Groups of the namelist
      character(len=*), intent(in) :: text
      !> Bodies
      type(body_list_t), intent(in) :: list
      !> Ready to advance
      type(simulation_t), intent(out) :: simulation
      !> What went wrong
      type(error_t), allocatable, intent(inout) :: error
      !> Prescribed motion of some bodies
      class(motion_t), intent(in), optional :: motion
      !> Slots of the bodies that the motion moves, given with it
      integer(ip), intent(in), optional :: moved(:)
      type(settings_t) :: settings
      type(bodies_t) :: bodies
      type(walls_t) :: walls
      character(len=1) :: no_overrides(0)

      call read_settings_text('trial.nml', "&scene name = 'file' bodies_file = 'none' /"//new_line('a')//text, &
                              no_overrides, settings, error)
      if (allocated(error)) return
      call new_bodies(list, bodies, error)
      if (allocated(error)) return
      allocate (walls%wall(0), walls%motions(merge(1, 0, present(motion))))
      if (present(motion)) then
         allocate (walls%motions(1)%motion, source=motion)
         call walls%append(bodies, bodies%id(moved), [1], [integer ::])
      end if
      call start_simulation(settings, bodies, simulation, error, walls)
   end subroutine begin

   !> Create the simulation of a whole namelist.
   subroutine begin_scene(text, simulation, error)
      !> Groups of the namelist
      character(len=*), intent(in) :: text
      !> Ready to advance
      type(simulation_t), intent(out) :: simulation
      !> What went wrong
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings
      character(len=1) :: no_overrides(0)

      call read_settings_text('trial.nml', text, no_overrides, settings, error)
      if (.not. allocated(error)) call new_simulation(settings, simulation, error)
   end subroutine begin_scene

   !> Advance by a number of steps, or until an error.
   subroutine steps(simulation, n, error)
      !> The simulation
      type(simulation_t), intent(inout) :: simulation
      !> Number of steps
      integer, intent(in) :: n
      !> What went wrong
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, n
         call advance(simulation, error)
         if (allocated(error)) return
      end do
   end subroutine steps

   !> Find the energy that is missing at the end of two runs of a scene, and the work of walls or cell in the second.
   subroutine find_missing_energy(coarse, fine, missing, work, error)
      !> Groups of the namelist, with a time step and with a half of it
      character(len=*), intent(in) :: coarse, fine
      !> Absolute energy that is missing with either step [J/m]
      real(wp), intent(out) :: missing(2)
      !> Work [J/m]
      real(wp), intent(out) :: work
      !> What went wrong
      type(error_t), allocatable, intent(inout) :: error
      type(simulation_t) :: simulation
      type(balance_t) :: balance
      integer :: k

      missing = huge(missing)
      work = 0.0_wp
      do k = 1, 2
         if (k == 1) call begin_scene(coarse, simulation, error)
         if (k == 2) call begin_scene(fine, simulation, error)
         if (.not. allocated(error)) call steps(simulation, int(simulation%n_steps), error)
         if (allocated(error)) return
         call compute_balance(simulation, balance)
         missing(k) = abs(balance%energy_residual)
         work = balance%wall_work
      end do
   end subroutine find_missing_energy

   !> Corners of a rectangle around a centre, turned by an angle, (2, 4) [m]
   pure function block_at(x, y, width, height, angle) result(vertices)
      !> Centre [m]
      real(wp), intent(in) :: x, y
      !> Sides [m]
      real(wp), intent(in) :: width, height
      !> Angle [rad]
      real(wp), intent(in) :: angle
      real(wp) :: vertices(2, 4)
      real(wp) :: corner(2)
      integer(ip) :: k

      do k = 1_ip, 4_ip
         corner(1) = merge(0.5_wp, -0.5_wp, k == 2_ip .or. k == 3_ip)*width
         corner(2) = merge(0.5_wp, -0.5_wp, k >= 3_ip)*height
         vertices(1, k) = x + cos(angle)*corner(1) - sin(angle)*corner(2)
         vertices(2, k) = y + sin(angle)*corner(1) + cos(angle)*corner(2)
      end do
   end function block_at

end module trial
