!> The speed at which bodies are expected to meet, for the choice of the time step.
!>
!> It is the greatest of three: the difference of the velocities of any two bodies at the start, including their spins;
!> the speed after a fall of the highest free body or source to the lowest point of the scene or the top of a sink (with
!> moving walls: through the whole extent), with what shaken gravity adds; and the greatest speed of a wall. Each is an
!> upper bound that does not depend on the frame of reference. Gravity that turns points along either axis.
module polydem_expected_speed
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_elementary, only: hypotenuse, pi
   use polydem_global_reductions, only: reduce_to_greatest, reduce_to_least
   use polydem_kinds, only: ip, wp
   use polydem_run_duration, only: longest_run
   use polydem_settings, only: settings_t, source_settings_t
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: find_expected_speed


contains

   !> Set the expected speed and its origin: the entry `speed` of &integrate, or an estimate. Collective; all ranks get
   !> the same.
   subroutine find_expected_speed(self)
      !> The simulation with settings, ranks, bodies and walls; `expected` is set
      type(simulation_t), intent(inout) :: self
      real(wp) :: start, fall, wall
      integer :: k

      associate (expected => self%expected)
         expected%speed = self%settings%integrate%speed
         expected%origin = 'speed in &integrate'
         if (expected%speed > 0.0_wp) return
         call find_start_speed(self%settings%source, self%bodies, self%comm, start)
         fall = 0.0_wp
         call consider_fall(self, self%forces%gravity, fall)
         do k = 1, size(self%settings%stage)
            if (size(self%settings%stage(k)%gravity) == 2) then
               call consider_fall(self, self%settings%stage(k)%gravity, fall)
            else
               call consider_fall(self, self%settings%forces%gravity, fall)
            end if
         end do
         associate (forces => self%forces)
            if (forces%shake_frequency > 0.0_wp) &
               fall = fall + hypotenuse(forces%shake(1), forces%shake(2))/(pi*forces%shake_frequency)
         end associate
         wall = self%walls%greatest_speed(self%bodies, longest_run(self%settings))
         expected%speed = max(start, fall, wall)
         expected%origin = 'the velocities at the start'
         if (fall > start) expected%origin = 'a fall through the scene'
         if (wall > max(start, fall)) expected%origin = 'the speed of the walls'
      end associate
   end subroutine find_expected_speed

   !> Find an upper bound of the difference of the velocities of any points of two bodies at the start [m/s].
   subroutine find_start_speed(sources, bodies, comm, speed)
      type(source_settings_t), intent(in) :: sources(:)
      type(bodies_t), intent(in) :: bodies
      class(communicator_t), intent(inout) :: comm
      real(wp), intent(out) :: speed
      real(wp) :: least(2), greatest(2), spin
      integer(ip) :: s
      integer :: k

      least = huge(1.0_wp)
      greatest = -huge(1.0_wp)
      do s = 1_ip, bodies%n
         spin = bodies%radius(s)*abs(bodies%angular_velocity(s))
         least = min(least, bodies%velocity(:, s) - spin)
         greatest = max(greatest, bodies%velocity(:, s) + spin)
      end do
      do k = 1, size(sources)
         least = min(least, sources(k)%velocity, 0.0_wp)
         greatest = max(greatest, sources(k)%velocity, 0.0_wp)
      end do
      call reduce_to_least(comm, least)
      call reduce_to_greatest(comm, greatest)
      speed = 0.0_wp
      if (all(greatest >= least)) speed = hypotenuse(greatest(1) - least(1), greatest(2) - least(2))
   end subroutine find_start_speed

   !> Take the speed of a fall if it is greater, in each quarter of a turn if gravity turns [m/s].
   subroutine consider_fall(self, gravity, greatest)
      type(simulation_t), intent(inout) :: self
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Greatest speed so far
      real(wp), intent(inout) :: greatest
      real(wp) :: turned(2), speed
      integer :: k

      turned = gravity
      do k = 1, merge(4, 1, abs(self%forces%turn_rate) > 0.0_wp)
         call find_fall_speed(self%settings, self%bodies, self%walls%any_driven(), self%comm, turned, speed)
         greatest = max(greatest, speed)
         turned = [-turned(2), turned(1)]
      end do
   end subroutine consider_fall

   !> Find the speed after a fall of the highest free body to the lowest point of the scene [m/s].
   subroutine find_fall_speed(settings, bodies, has_walls, comm, gravity, speed)
      !> Settings: groups &source and &sink
      type(settings_t), intent(in) :: settings
      type(bodies_t), intent(in) :: bodies
      !> Whether there are moving walls
      logical, intent(in) :: has_walls
      class(communicator_t), intent(inout) :: comm
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      real(wp), intent(out) :: speed
      real(wp) :: strength, up(2), highest(1), lowest(1), height
      integer(ip) :: s, v
      integer :: k

      speed = 0.0_wp
      strength = hypotenuse(gravity(1), gravity(2))
      if (.not. strength > 0.0_wp) return
      up = -gravity/strength
      highest = -huge(1.0_wp)
      lowest = huge(1.0_wp)
      do s = 1_ip, bodies%n
         do v = bodies%pieces%vertex_start(s), bodies%pieces%vertex_start(s + 1_ip) - 1_ip
            height = sum(up*(bodies%position(:, s) + bodies%pieces%turned(:, v)))
            lowest = min(lowest, height)
            if (.not. bodies%fixed(s) .or. has_walls) highest = max(highest, height)
         end do
      end do
      do k = 1, size(settings%source)
         associate (low => settings%source(k)%low, high => settings%source(k)%high)
            highest = max(highest, sum(max(up*low, up*high)))
            lowest = min(lowest, sum(min(up*low, up*high)))
         end associate
      end do
      ! Bodies fall on as far as the sinks.
      do k = 1, size(settings%sink)
         associate (low => settings%sink(k)%low, high => settings%sink(k)%high)
            lowest = min(lowest, sum(max(up*low, up*high)))
         end associate
      end do
      call reduce_to_greatest(comm, highest)
      call reduce_to_least(comm, lowest)
      speed = sqrt(2.0_wp*strength*max(0.0_wp, highest(1) - lowest(1)))
   end subroutine find_fall_speed

end module polydem_expected_speed
