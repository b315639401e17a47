!> Velocity Verlet whose sums over steps do not drift: position and velocity are carried as two numbers each.
!>
!> Every addition to a position or velocity is split without error into its rounded sum and what rounding cost
!> (D.E. Knuth, The Art of Computer Programming 2, Sec. 4.2.2, Theorem B); the cost enters the next addition
!> (W. Kahan, Commun. ACM 8 (1965) 40). So millions of steps lose no more than one. The larger part of each number
!> is what everybody else sees. It takes a compiler that leaves sums as they stand (no -ffast-math).
module polydem_compensated_verlet
   use polydem_archive, only: archive_t
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: ip, wp, worth_threads
   use polydem_velocity_verlet, only: velocity_verlet_t
   implicit none
   private
   public :: compensated_verlet_t

   !> Velocity Verlet with compensated sums; its stability is that of the plain scheme
   type, extends(velocity_verlet_t) :: compensated_verlet_t
      private
      !> What rounding took from positions and angle, (3, slot) [m, m, rad]
      real(wp), allocatable :: lost_place(:, :)
      !> The same of velocities, at the end of a step or half a step back like `half`, (3, slot) [m/s, m/s, rad/s]
      real(wp), allocatable :: lost_speed(:, :)
   contains
      procedure :: start
      procedure :: predict
      procedure :: correct
      procedure :: keep
   end type compensated_verlet_t

contains

   !> Start from positions and velocities that are exact.
   subroutine start(self, bodies)
      class(compensated_verlet_t), intent(inout) :: self
      !> Bodies at the start
      type(bodies_t), intent(in) :: bodies

      call self%velocity_verlet_t%start(bodies)
      if (allocated(self%lost_place)) deallocate (self%lost_place, self%lost_speed)
      allocate (self%lost_place(3, bodies%n), self%lost_speed(3, bodies%n))
      self%lost_place = 0.0_wp
      self%lost_speed = 0.0_wp
   end subroutine start

   !> Move to the end of the step and predict the velocities there.
   subroutine predict(self, dt, bodies)
      class(compensated_verlet_t), intent(inout) :: self
      !> Step [s]
      real(wp), intent(in) :: dt
      !> Bodies; position, angle and velocities of the free ones change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: k, s

      !$omp parallel do if (bodies%n > worth_threads) schedule(static) default(none) &
      !$omp    shared(self, bodies, dt) private(k, s)
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         call move(dt, bodies%acceleration(1, s), bodies%position(1, s), bodies%velocity(1, s), self%half(1, s), &
                   self%lost_place(1, s), self%lost_speed(1, s))
         call move(dt, bodies%acceleration(2, s), bodies%position(2, s), bodies%velocity(2, s), self%half(2, s), &
                   self%lost_place(2, s), self%lost_speed(2, s))
         call move(dt, bodies%angular_acceleration(s), bodies%angle(s), bodies%angular_velocity(s), self%half(3, s), &
                   self%lost_place(3, s), self%lost_speed(3, s))
      end do
      !$omp end parallel do
   end subroutine predict

   !> Final velocities and accelerations from the forces at the end of the step.
   subroutine correct(self, dt, bodies)
      class(compensated_verlet_t), intent(inout) :: self
      !> Step [s]
      real(wp), intent(in) :: dt
      !> Bodies; velocities and accelerations of the free ones change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: k, s
      real(wp) :: h

      h = 0.5_wp*dt
      !$omp parallel do if (bodies%n > worth_threads) schedule(static) default(none) &
      !$omp    shared(self, bodies, h) private(k, s)
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         bodies%acceleration(1, s) = bodies%force(1, s)*bodies%inverse_mass(s)
         bodies%acceleration(2, s) = bodies%force(2, s)*bodies%inverse_mass(s)
         bodies%angular_acceleration(s) = bodies%torque(s)*bodies%inverse_inertia(s)
         bodies%velocity(:, s) = self%half(1:2, s)
         bodies%angular_velocity(s) = self%half(3, s)
         call add(h*bodies%acceleration(1, s), bodies%velocity(1, s), self%lost_speed(1, s))
         call add(h*bodies%acceleration(2, s), bodies%velocity(2, s), self%lost_speed(2, s))
         call add(h*bodies%angular_acceleration(s), bodies%angular_velocity(s), self%lost_speed(3, s))
      end do
      !$omp end parallel do
   end subroutine correct

   !> Keep what rounding took.
   subroutine keep(self, archive)
      class(compensated_verlet_t), intent(inout) :: self
      !> Archive
      class(archive_t), intent(inout) :: archive

      call archive%keep('/bodies/lost_place', self%lost_place, 'm, m, rad', 'what rounding took from places and angles')
      call archive%keep('/bodies/lost_speed', self%lost_speed, 'm/s, m/s, rad/s', 'the same of velocities')
   end subroutine keep

   !> One coordinate: its velocity in the middle of the step, its place at the end, its velocity predicted there.
   pure subroutine move(dt, acceleration, place, velocity, half, lost_place, lost_speed)
      real(wp), intent(in) :: dt, acceleration
      real(wp), intent(inout) :: place, velocity, half, lost_place, lost_speed
      real(wp) :: gain

      gain = 0.5_wp*dt*acceleration
      half = velocity
      call add(gain, half, lost_speed)
      call add(dt*half + dt*lost_speed, place, lost_place)
      velocity = half + gain
   end subroutine move

   !> Add a number and what was lost so far to a total; what the rounding of the total costs is lost from now on.
   pure subroutine add(number, total, lost)
      real(wp), intent(in) :: number
      real(wp), intent(inout) :: total, lost
      real(wp) :: addend, rounded, arrived

      addend = number + lost
      rounded = total + addend
      arrived = rounded - total
      lost = (total - (rounded - arrived)) + (addend - arrived)
      total = rounded
   end subroutine add

end module polydem_compensated_verlet
