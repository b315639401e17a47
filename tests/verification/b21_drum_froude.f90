!> Benchmark B21: the flow in a drum is the same at a tenth of the gravity and the same Froude number.
!>
!> Without cohesion and for stiff grains the flow depends on the Froude number w^2 R/g alone (P. Sunday et al., Mon.
!> Not. R. Astron. Soc. 498 (2020) 1062). The benchmark compares the mean angle between the vertical and the direction
!> of the centre of mass of the grains, over a revolution. Grains are stiff if E/(rho g R) is at least some thousands.
!> Here it is about 35000 and 350000. With a tenth of that, two samples of three seeds differed by 0.5 and 1.0 degrees;
!> with a hundredth, 400 grains of one seed by 2.8 degrees.
module b21_drum_froude
   use outlines, only: gravity, pi
   use trial, only: area_law, steps
   use verification_table, only: table_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_read_settings, only: read_settings_text
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start, only: new_simulation
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_drum_froude

contains

   !> Run a drum of 250 grains at both gravities, from three seeds.
   subroutine run_drum_froude(table)
      !> Table to fill
      type(table_t), intent(inout) :: table
      integer(ip), parameter :: n_seeds = 3_ip
      real(wp) :: angles(n_seeds, 2), means(2)
      integer(ip) :: seed

      call table%begin('B21', 'a drum of 250 grains at equal Froude numbers, 0.5 revolutions per second at 9.81 m/s2')
      do seed = 1_ip, n_seeds
         call turn(table, 1.0_wp, seed, angles(seed, 1))
         call turn(table, 0.1_wp, seed, angles(seed, 2))
      end do
      means = sum(angles, 1)/real(n_seeds, wp)
      call table%show('at g: angle of the centre of mass, mean over 3 seeds [degrees]', means(1))
      call table%show('at g: range of the seeds [degrees]', maxval(angles(:, 1)) - minval(angles(:, 1)))
      call table%show('at g/10: range of the seeds [degrees]', maxval(angles(:, 2)) - minval(angles(:, 2)))
      call table%expect_absolute('at g/10: angle, mean over 3 seeds [degrees]', means(1), means(2), 1.0_wp)
   end subroutine run_drum_froude

   !> Mean angle from 1 s to 3 s, or the same number of free-fall times at other gravities
   subroutine turn(table, share, seed, angle)
      type(table_t), intent(inout) :: table
      real(wp), intent(in) :: share
      integer(ip), intent(in) :: seed
      real(wp), intent(out) :: angle
      integer, parameter :: samples = 200
      character(len=1) :: no_overrides(0)
      type(settings_t) :: settings
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: stretch, centre(2)
      integer :: k

      stretch = 1.0_wp/sqrt(share)
      call read_settings_text('drum.nml', '&scene name = ''drum'' bodies = 250 seed = '//to_text(seed)// &
                              ' / &motion name = ''turn'' kind = ''rotation'' rate = '//to_text(0.5_wp/stretch, 17)// &
                              ' start = '//to_text(0.3_wp*stretch, 17)// &
                              ' ramp = '//to_text(0.1_wp*stretch, 17)// &
                              ' / &forces gravity = 0, '//to_text(-share*gravity, 17)// &
                              ' friction_coefficient = 0.4 damping_coefficient = 0.5 stiffness = 1e8'//area_law// &
                              ' / &integrate duration = '//to_text(3.0_wp*stretch, 17)// &
                              ' / &output energy_balance = .false. /', no_overrides, settings, error)
      if (.not. allocated(error)) call new_simulation(settings, simulation, error)
      if (.not. allocated(error)) call steps(simulation, int(simulation%n_steps/3), error)
      angle = 0.0_wp
      do k = 1, samples
         if (.not. allocated(error)) call steps(simulation, int(simulation%n_steps*2/(3*samples)), error)
         if (allocated(error)) exit
         centre = centre_of_mass(simulation)
         angle = angle + atan2(centre(1), -centre(2))*180.0_wp/pi/real(samples, wp)
      end do
      call table%note_error(error)
   end subroutine turn

   pure function centre_of_mass(simulation) result(centre)
      type(simulation_t), intent(in) :: simulation
      real(wp) :: centre(2), total
      integer(ip) :: k

      centre = 0.0_wp
      total = 0.0_wp
      do k = 1_ip, size(simulation%bodies%free, kind=ip)
         associate (s => simulation%bodies%free(k))
            centre = centre + simulation%bodies%mass(s)*simulation%bodies%position(:, s)
            total = total + simulation%bodies%mass(s)
         end associate
      end do
      centre = centre/total
   end function centre_of_mass

end module b21_drum_froude
