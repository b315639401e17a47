!> Benchmark B3: momentum and angular momentum of a closed gas.
!>
!> The only external forces are those of the four fixed walls. So momentum minus the impulses of the walls, taken from
!> the balance of the run, is constant if and only if the two forces of every contact are opposite and act at one point.
!> Errors are shares of the sums of |m v| and of |m r x v + I w| over the bodies at the start.
!>
!> The elastic gas has the conservative law. With the area law, which does work on closed paths (B5), it heats up until
!> bodies are too fast for the step, after 9e5 of a million steps.
module b03_momentum
   use trial, only: steps
   use verification_table, only: table_t
   use polydem_energy_balance, only: balance_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_read_settings, only: read_settings_text
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t, compute_balance
   use polydem_start, only: new_simulation
   implicit none
   private
   public :: run_momentum

contains

   !> Without friction and damping, and with both.
   subroutine run_momentum(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to take a million steps instead of 20 000
      logical, intent(in) :: thorough
      integer :: n_steps

      n_steps = merge(1000000, 20000, thorough)
      call table%begin('B3', 'momentum of a closed gas of 40 grains and 4 walls, '// &
                       trim(merge('1e6 steps', '2e4 steps', thorough)))
      call fly(table, n_steps, 'mu = 0, elastic', 'law = ''conservative'' damping = ''none'' friction = ''none''')
      call fly(table, n_steps, 'mu = 0.5, damped', 'damping_coefficient = 0.1 friction_coefficient = 0.5')
   end subroutine run_momentum

   subroutine fly(table, n_steps, name, forces)
      type(table_t), intent(inout) :: table
      integer, intent(in) :: n_steps
      character(len=*), intent(in) :: name, forces
      character(len=1) :: no_overrides(0)
      type(settings_t) :: settings
      type(simulation_t) :: simulation
      type(balance_t) :: start, end
      type(error_t), allocatable :: error
      real(wp) :: missing(3), scale(2)
      integer(ip) :: k, s

      call read_settings_text('gas.nml', &
                              '&scene name = ''gas'' bodies = 40 solid_fraction = 0.2 speed = 0.5 spin = 20 / '// &
                              '&forces gravity = 0, 0 '//forces//' / &integrate duration = 1000 /', &
                              no_overrides, settings, error)
      if (.not. allocated(error)) call new_simulation(settings, simulation, error)
      if (.not. allocated(error)) then
         call compute_balance(simulation, start)
         scale = 0.0_wp
         associate (bodies => simulation%bodies)
            do k = 1_ip, size(bodies%free, kind=ip)
               s = bodies%free(k)
               scale(1) = scale(1) + bodies%mass(s)*norm2(bodies%velocity(:, s))
               scale(2) = scale(2) + abs(bodies%mass(s)*(bodies%position(1, s)*bodies%velocity(2, s) &
                                                         - bodies%position(2, s)*bodies%velocity(1, s)) &
                                         + bodies%inertia(s)*bodies%angular_velocity(s))
            end do
         end associate
         call steps(simulation, n_steps, error)
      end if
      call table%note_error(error)
      if (allocated(error)) return
      call compute_balance(simulation, end)
      missing(:2) = end%momentum - start%momentum - end%impulse
      missing(3) = end%angular_momentum - start%angular_momentum - end%angular_impulse
      call table%expect_absolute(name//': momentum that is missing, over its sum', 0.0_wp, &
                                 norm2(missing(:2))/scale(1), 1.0e-11_wp)
      call table%expect_absolute(name//': angular momentum that is missing, over its sum', 0.0_wp, &
                                 abs(missing(3))/scale(2), 1.0e-11_wp)
      call table%show(name//': impulse of the walls, over the sum of momenta', norm2(end%impulse)/scale(1))
      call table%show(name//': kinetic energy at the end over that at the start', end%kinetic/start%kinetic)
   end subroutine fly

end module b03_momentum
