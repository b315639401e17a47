!> The greatest static pressure of a scene: that by which the stiffness of its contacts is judged, or chosen.
!>
!> It is the greatest of three: the weight of the free bodies under their full height along gravity, of all stages the
!> greatest; the stress of a load, or its force over the width of its wall, with the weight of a wall whose mass is
!> given; and the stress that controls a cell. It is that of the bodies at the start.
module polydem_static_pressure
   use polydem_driven, only: along_angle
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t, input_error, raise
   use polydem_global_reductions, only: reduce_to_greatest, reduce_to_least
   use polydem_kinds, only: ip, wp
   use polydem_settings, only: load_settings_t
   use polydem_simulation, only: simulation_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: to_text
   implicit none
   private
   public :: find_static_pressure, choose_stiffness, load_pressure

   !> Greatest stiffness, as in the table of entries [N/m2]
   real(wp), parameter :: stiffest = 1.0e30_wp
   !> Origin of the pressure of the weight of the free bodies
   character(len=*), parameter :: of_bodies = 'under the full height of the free bodies'

contains

   !> Set the static pressure and its origin. Collective; all ranks get the same.
   subroutine find_static_pressure(self)
      !> The simulation with settings, ranks, bodies and walls; `pressure` is set
      type(simulation_t), intent(inout) :: self
      real(wp) :: density(1)
      integer :: k

      self%pressure%origin = ''
      density = 0.0_wp
      associate (bodies => self%bodies)
         do k = 1, size(bodies%free)
            associate (s => bodies%free(k))
               density = max(density, bodies%mass(s)/bodies%pieces%area_of(s))
            end associate
         end do
      end associate
      call reduce_to_greatest(self%comm, density)
      call consider_weight(self, self%forces%gravity, density(1))
      do k = 1, size(self%settings%stage)
         if (size(self%settings%stage(k)%gravity) == 2) then
            call consider_weight(self, self%settings%stage(k)%gravity, density(1))
         else
            call consider_weight(self, self%settings%forces%gravity, density(1))
         end if
      end do
      call self%walls%find_slots(self%bodies)
      do k = 1, size(self%settings%load)
         associate (load => self%settings%load(k))
            call consider(self, load_pressure(self, load, k), 'of &load '//load%name)
         end associate
      end do
      if (self%settings%cell%stress_controlled /= 'none') &
         call consider(self, maxval(abs(self%settings%cell%stress)), 'of &cell')
   end subroutine find_static_pressure

   !> Set the stiffness if it is given in units of the static pressure.
   subroutine choose_stiffness(self, error)
      !> The simulation with its static pressure
      type(simulation_t), intent(inout) :: self
      !> Allocated if there is no such pressure, or if the stiffness is out of range
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: beginning

      associate (forces => self%forces, pressure => self%pressure%greatest)
         if (.not. allocated(forces%stiffness_over_pressure)) return
         beginning = place_of(self%settings, 'forces', 'stiffness_over_pressure')// &
            ': ''stiffness_over_pressure'' in &forces '
         if (.not. pressure > 0.0_wp) then
            call raise(error, input_error, beginning//'needs a static pressure, but neither gravity on free bodies '// &
                       'nor a load or a cell with a stress gives one; give ''stiffness'' instead')
         else if (pressure > stiffest/max(forces%stiffness_over_pressure, 1.0_wp)) then
            call raise(error, input_error, beginning//'gives a stiffness beyond '//to_text(stiffest)//' N/m2 with '// &
                       'the static pressure '//to_text(pressure)//' N/m2')
         else
            forces%stiffness = forces%stiffness_over_pressure*pressure
         end if
      end associate
   end subroutine choose_stiffness

   !> Take the pressure of the weight of the free bodies if it is greater.
   subroutine consider_weight(self, gravity, density)
      type(simulation_t), intent(inout) :: self
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Greatest density of a free body [kg/m3]
      real(wp), intent(in) :: density
      real(wp) :: strength, down(2), highest(1), lowest(1), depth
      integer(ip) :: s, v
      integer :: k

      strength = hypotenuse(gravity(1), gravity(2))
      if (.not. (strength > 0.0_wp .and. density > 0.0_wp)) return
      down = gravity/strength
      highest = huge(1.0_wp)
      lowest = -huge(1.0_wp)
      associate (bodies => self%bodies)
         do k = 1, size(bodies%free)
            s = bodies%free(k)
            do v = bodies%pieces%vertex_start(s), bodies%pieces%vertex_start(s + 1_ip) - 1_ip
               depth = sum(down*(bodies%position(:, s) + bodies%pieces%turned(:, v)))
               highest = min(highest, depth)
               lowest = max(lowest, depth)
            end do
         end do
      end associate
      call reduce_to_least(self%comm, highest)
      call reduce_to_greatest(self%comm, lowest)
      call consider(self, density*strength*(lowest(1) - highest(1)), of_bodies)
   end subroutine consider_weight

   !> Take a pressure if it is greater than those before.
   subroutine consider(self, pressure, origin)
      type(simulation_t), intent(inout) :: self
      !> Pressure [N/m2]
      real(wp), intent(in) :: pressure
      !> What it is, a clause for the log
      character(len=*), intent(in) :: origin

      if (.not. pressure > self%pressure%greatest) return
      self%pressure%greatest = pressure
      self%pressure%origin = origin
      self%pressure%is_of_bodies = origin == of_bodies
   end subroutine consider

   !> Pressure of a load on its wall, with the weight of the wall if its mass is given; 0 of a torque [N/m2]
   function load_pressure(self, load, number) result(pressure)
      type(simulation_t), intent(in) :: self
      !> The load
      type(load_settings_t), intent(in) :: load
      !> Its number
      integer, intent(in) :: number
      real(wp) :: pressure, force, extent(2)

      pressure = abs(load%stress)
      if (.not. allocated(self%walls%loads)) return
      associate (wall => self%walls%loads(number)%wall, axis => self%walls%loads(number)%direction)
         if (axis == along_angle) return
         force = abs(load%force)
         if (load%weight) force = force + load%mass*abs(self%forces%gravity(axis))
         extent = self%walls%wall(wall)%extent(3 - axis, self%bodies)
         if (extent(2) > extent(1)) pressure = pressure + force/(extent(2) - extent(1))
      end associate
   end function load_pressure

end module polydem_static_pressure
