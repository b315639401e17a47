!> Benchmark B17: a wave of falling dominoes.
!>
!> For given ratios of thickness and gap to the height h, the speed is sqrt(g h) times a constant (B.G. McLachlan et
!> al., SIAM Rev. 25 (1983) 403), so three sizes must agree. Stiffness and density are the same for all sizes, so the
!> runs are not copies of one run in other units. The expected constant is that of rigid dominoes with plastic
!> collisions that do not slip on the floor (`domino_train`). In this benchmark dominoes can slip: a hit above two
!> thirds of the height pushes the base backwards. At the chosen ratios mu = 0.5 prevents it.
!>
!> The tolerance is 5 %: the collisions of soft, damped dominoes are not quite plastic, and the wave is 3 % faster than
!> that of the rigid train.
module b17_dominoes
   use domino_train, only: domino_t, wave_speed
   use outlines, only: gravity
   use trial, only: area_law, begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_simulation, only: simulation_t, time_of
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_dominoes

   !> Number of dominoes, and the first and last domino of the measurement: after the start, and before the end
   integer(ip), parameter :: n = 18_ip, first = 8_ip, last = 16_ip
   real(wp), parameter :: mu = 0.5_wp

contains

   !> Run heights of 2, 4 and 8 cm.
   subroutine run_dominoes(table)
      !> Table to fill
      type(table_t), intent(inout) :: table
      real(wp), parameter :: heights(3) = [0.02_wp, 0.04_wp, 0.08_wp]
      real(wp) :: expected, numbers(3)
      integer :: k

      call table%begin('B17', 'a wave of dominoes, d/h = 0.15, s/h = 0.5, mu = 0.5')
      expected = wave_speed(row_of(1.0_wp))/sqrt(gravity)
      do k = 1, 3
         call topple(table, row_of(heights(k)), numbers(k))
         call table%expect_relative('h = '//to_text(heights(k), 1)//' m: speed/sqrt(g h)', expected, numbers(k), &
                                    0.05_wp)
      end do
      call table%expect_absolute('spread of the three over their mean', 0.0_wp, &
                                 (maxval(numbers) - minval(numbers))*3.0_wp/sum(numbers), 0.01_wp)
   end subroutine run_dominoes

   pure function row_of(height) result(row)
      real(wp), intent(in) :: height
      type(domino_t) :: row

      row = domino_t(height=height, thickness=0.15_wp*height, gap=0.5_wp*height, friction=mu, gravity=gravity)
   end function row_of

   !> Push the first domino and measure the ratio of the speed to sqrt(g h).
   subroutine topple(table, row, number)
      type(table_t), intent(inout) :: table
      type(domino_t), intent(in) :: row
      real(wp), intent(out) :: number
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: times(n), longest
      !> Angle at which a domino counts as hit [rad]
      real(wp), parameter :: hit = 0.02_wp
      integer(ip) :: next

      call build(row, simulation, error)
      longest = 2.0_wp*real(n, wp)*sqrt(row%height/gravity)
      times = 0.0_wp
      next = 1_ip
      do while (next <= last)
         if (.not. allocated(error)) call steps(simulation, 1, error)
         if (allocated(error) .or. time_of(simulation) > longest) exit
         if (simulation%bodies%angle(next) > -hit) cycle
         times(next) = time_of(simulation)
         next = next + 1_ip
      end do
      call table%note_error(error)
      number = (row%gap + row%thickness)*real(last - first, wp)/(times(last) - times(first))/sqrt(gravity*row%height)
   end subroutine topple

   !> Dominoes from left to right and then the floor; the first one falls to the right about its lower corner.
   subroutine build(row, simulation, error)
      type(domino_t), intent(in) :: row
      type(simulation_t), intent(out) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      real(wp) :: pitch, rate
      integer(ip) :: k

      pitch = row%gap + row%thickness
      rate = 2.0_wp*sqrt(gravity/row%height)
      do k = 1_ip, n
         if (k == 1_ip) then
            call list%append(block_at(0.0_wp, 0.5_wp*row%height, row%thickness, row%height, 0.0_wp), &
                             velocity=0.5_wp*rate*[row%height, row%thickness], angular_velocity=-rate)
         else
            call list%append(block_at(real(k - 1_ip, wp)*pitch, 0.5_wp*row%height, row%thickness, row%height, 0.0_wp))
         end if
      end do
      call list%append(block_at(0.5_wp*real(n, wp)*pitch, -0.5_wp*row%height, 2.0_wp*real(n, wp)*pitch, row%height, &
                                0.0_wp), fixed=.true.)
      call begin('&forces friction_coefficient = 0.5 damping_coefficient = 4 tangential_damping = 1 '// &
                 'stiffness = 1e7'//area_law//' /'// &
                 '&integrate duration = 1000 / &output energy_balance = .false. /', list, simulation, error)
   end subroutine build

end module b17_dominoes
