!> Benchmark B4: energy of an elastic impact, which separates the error of the model from that of integration.
!>
!> A square falls on a corner, eccentrically and without friction, and leaves with a spin. The conservative law has a
!> potential, so the missing energy at any time is the error of integration, which falls with the square of the step.
!> The area law has no potential: the impact changes the kinetic energy by an amount that does not depend on the step.
module b04_energy
   use outlines, only: pi
   use trial, only: begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_energy_balance, only: balance_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t, compute_balance
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_energy

   real(wp), parameter :: width = 0.01_wp
   !> Frequency of the square on a face [1/s], the unit of the reciprocal steps
   real(wp), parameter :: frequency = sqrt(0.5_wp*1.0e7_wp/(2500.0_wp*width**2))

contains

   !> Run four time steps for each law.
   subroutine run_energy(table)
      !> Table to fill
      type(table_t), intent(inout) :: table
      real(wp), parameter :: products(*) = [0.2_wp, 0.1_wp, 0.05_wp, 0.025_wp]
      real(wp) :: worst(size(products)), change(size(products))
      integer :: k

      call table%begin('B4', 'energy of an elastic impact on a corner')
      do k = 1, size(products)
         call fall(table, 'conservative', products(k)/frequency, worst(k), change(k))
         call table%show('conservative law, w0 dt = '//to_text(products(k), 2)//': greatest relative error of energy', &
                         worst(k))
      end do
      call table%expect_least('conservative law: order of that, last three halvings', 1.9_wp, &
                              log(worst(1)/worst(4))/log(8.0_wp))
      do k = 1, size(products)
         call fall(table, 'area', products(k)/frequency, worst(k), change(k))
         call table%show('area law, w0 dt = '//to_text(products(k), 2)//': relative error of energy after impact', &
                         change(k))
      end do
      call table%expect_relative('area law: that error at the largest step over that at the smallest', 1.0_wp, &
                                 change(1)/change(4), 0.05_wp)
   end subroutine run_energy

   !> Greatest missing energy in the balance, where elastic work counts as stored energy, and final loss of kinetic
   !> energy.
   subroutine fall(table, law, dt, worst, change)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: law
      real(wp), intent(in) :: dt
      real(wp), intent(out) :: worst, change
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      type(balance_t) :: balance
      real(wp) :: first
      integer :: k

      call list%append(block_at(0.0_wp, -width, 20.0_wp*width, 2.0_wp*width, 0.0_wp), fixed=.true.)
      call list%append(block_at(0.0_wp, 0.72_wp*width, width, width, 0.25_wp*pi + 0.1_wp), velocity=[0.05_wp, -0.3_wp])
      call begin("&forces gravity = 0, 0 damping = 'none' friction = 'none' law = '"//law//"' / &integrate dt = "// &
                 to_text(dt, 17)//' duration = 1 /', list, simulation, error)
      worst = 0.0_wp
      change = 0.0_wp
      if (.not. allocated(error)) then
         call compute_balance(simulation, balance)
         first = balance%kinetic
         do k = 1, nint(0.012_wp/dt)
            call steps(simulation, 1, error)
            if (allocated(error)) exit
            call compute_balance(simulation, balance)
            worst = max(worst, abs(balance%energy_residual)/first)
         end do
         change = abs(balance%kinetic - first)/first
      end if
      call table%note_error(error)
   end subroutine fall

end module b04_energy
