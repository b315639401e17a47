!> Initial velocities and angular velocities of grains.
module polydem_start_velocities
   use polydem_kinds, only: ip, wp
   use polydem_random, only: random_t
   implicit none
   private
   public :: draw_velocities, draw_spins, choose_moving_grains, remove_momentum, set_speed

contains

   !> Draw velocities from a normal distribution.
   subroutine draw_velocities(random, speed, velocities)
      type(random_t), intent(inout) :: random
      !> Expected root mean square speed [m/s]
      real(wp), intent(in) :: speed
      !> Velocities, (2, grain) [m/s]
      real(wp), intent(out) :: velocities(:, :)
      integer :: k

      do k = 1, size(velocities, 2)
         velocities(1, k) = sqrt(0.5_wp)*speed*random%normal()
         velocities(2, k) = sqrt(0.5_wp)*speed*random%normal()
      end do
   end subroutine draw_velocities

   !> Draw angular velocities from a normal distribution and scale them to a given root mean square.
   subroutine draw_spins(random, spin, spins)
      type(random_t), intent(inout) :: random
      !> Root mean square of the angular velocities [rad/s]
      real(wp), intent(in) :: spin
      !> Angular velocities, (grain) [rad/s]
      real(wp), intent(out) :: spins(:)
      real(wp) :: squares
      integer :: k

      spins = 0.0_wp
      if (.not. spin > 0.0_wp) return
      squares = 0.0_wp
      do k = 1, size(spins)
         spins(k) = random%normal()
         squares = squares + spins(k)**2
      end do
      spins = spin*sqrt(real(size(spins), wp)/squares)*spins
   end subroutine draw_spins

   !> Choose the grains that move. They are evenly spaced in the order of the grains; a single one is in the middle. If
   !> the scene has only one grain, this grain rests unless `moving_grains` is 1.
   pure function choose_moving_grains(n, moving_grains) result(moves)
      !> Number of grains
      integer(ip), intent(in) :: n
      !> Number of grains that move, at most n; 0: all
      integer(ip), intent(in) :: moving_grains
      logical :: moves(n)
      integer(ip) :: k

      moves = moving_grains == 0_ip .and. n > 1_ip
      do k = 1_ip, moving_grains
         moves(ceiling((real(k, wp) - 0.5_wp)*real(n, wp)/real(moving_grains, wp), ip)) = .true.
      end do
   end function choose_moving_grains

   !> Subtract the velocity of the common centre of mass of the moving grains. At least one grain must move. All grains
   !> have the same density.
   pure subroutine remove_momentum(areas, moves, velocities)
      !> Area of each grain, (grain) [m2]
      real(wp), intent(in) :: areas(:)
      !> Whether each grain moves, (grain)
      logical, intent(in) :: moves(:)
      !> Velocities, (2, grain) [m/s]
      real(wp), intent(inout) :: velocities(:, :)
      real(wp) :: drift(2), area
      integer :: k

      drift = 0.0_wp
      area = 0.0_wp
      do k = 1, size(areas)
         if (.not. moves(k)) cycle
         drift = drift + areas(k)*velocities(:, k)
         area = area + areas(k)
      end do
      drift = drift/area
      do k = 1, size(areas)
         velocities(:, k) = velocities(:, k) - drift
      end do
   end subroutine remove_momentum

   !> Scale the velocities of the moving grains to a given root mean square speed, and set those of the other grains to
   !> zero. If all speeds are 0 they stay 0.
   pure subroutine set_speed(speed, moves, velocities)
      !> Root mean square speed [m/s]
      real(wp), intent(in) :: speed
      !> Whether each grain moves, (grain)
      logical, intent(in) :: moves(:)
      !> Velocities, (2, grain) [m/s]
      real(wp), intent(inout) :: velocities(:, :)
      real(wp) :: squares
      integer :: k, n_moving

      squares = 0.0_wp
      n_moving = 0
      do k = 1, size(velocities, 2)
         if (.not. moves(k)) velocities(:, k) = 0.0_wp
         if (.not. moves(k)) cycle
         squares = squares + velocities(1, k)**2 + velocities(2, k)**2
         n_moving = n_moving + 1
      end do
      if (squares > 0.0_wp) velocities = speed*sqrt(real(n_moving, wp)/squares)*velocities
   end subroutine set_speed

end module polydem_start_velocities
