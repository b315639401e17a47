!> Guard of bodies that move so far in a step that they could pass through others. Once velocities are not finite, no
!> choice lets a run go on.
module polydem_displacement_guard
   use polydem_bodies, only: bodies_t
   use polydem_errors, only: error_t, raise, run_error
   use polydem_global_reductions, only: reduce_to_least
   use polydem_guard, only: shorter_step
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_motion_tests, only: is_finite, moves_within_limit, place_error
   use polydem_settings, only: guards_settings_t, settings_t
   use polydem_simulation, only: guard_t, simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: displacement_guard_t, displacement_limit

   !> Number of steps after which a fast body may have fallen for long
   integer(lp), parameter :: early = 1000_lp

   !> Guard of the displacement per step
   type, extends(guard_t) :: displacement_guard_t
   contains
      procedure :: configure
      procedure :: set_global_limits
      procedure :: respond_to_motion
      procedure :: look
      procedure :: check_motion
   end type displacement_guard_t

contains

   !> Set what the guard says of itself.
   subroutine configure(self, settings)
      class(displacement_guard_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings

      self%noun = 'step'
      self%finding = 'in which a body moved too far'
      self%choice = settings%guards%displacement
   end subroutine configure

   !> Limit the displacement of a step to a share of the thickness of the thinnest body of all ranks.
   subroutine set_global_limits(self, simulation)
      class(displacement_guard_t), intent(in) :: self
      type(simulation_t), intent(inout) :: simulation
      real(wp) :: limit(1)

      associate (unused => self)
      end associate
      limit = displacement_limit(simulation%settings%guards, simulation%bodies)
      call reduce_to_least(simulation%comm, limit)
      simulation%motion%limit = min(simulation%motion%limit, limit(1))
   end subroutine set_global_limits

   !> Maximum displacement of a point of a body per step; huge if it is not monitored [m]
   pure real(wp) function displacement_limit(settings, bodies) result(limit)
      type(guards_settings_t), intent(in) :: settings
      !> Bodies that may touch
      type(bodies_t), intent(in) :: bodies

      limit = huge(1.0_wp)
      if (settings%displacement == 'off' .or. bodies%n == 0_ip) return
      limit = settings%displacement_limit*minval(bodies%thickness)
   end function displacement_limit

   !> Respond to the first body that moves too far, in the step itself: its error reaches other ranks with those of the
   !> step.
   subroutine respond_to_motion(self, simulation, error)
      class(displacement_guard_t), intent(inout) :: self
      type(simulation_t), intent(in) :: simulation
      type(error_t), allocatable, intent(inout) :: error

      associate (s => simulation)
         call self%check_motion(s%motion%limit, shorter_step(s%settings%integrate), s%bodies, &
                                s%moving(:s%n_moving), s%step, s%dt, error)
      end associate
   end subroutine respond_to_motion

   !> Nothing is left to do after the step.
   subroutine look(self, simulation, error)
      class(displacement_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error

      associate (unused_self => self, unused_simulation => simulation)
      end associate
      if (allocated(error)) return
   end subroutine look

   !> Stop if the state of a body is not finite. Stop or warn if a body moves too far in a step.
   subroutine check_motion(self, limit, remedy, bodies, moving, step, dt, error)
      !> The guard; its warnings are counted
      class(displacement_guard_t), intent(inout) :: self
      !> Greatest displacement of a point in a step [m]
      real(wp), intent(in) :: limit
      !> Clause that says how to shorten the time step
      character(len=*), intent(in) :: remedy
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies that may move
      integer(ip), intent(in) :: moving(:)
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Names the body, its position and velocity, and the step
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, s
      logical :: is_first

      is_first = .true.
      do k = 1_ip, size(moving, kind=ip)
         s = moving(k)
         if (moves_within_limit(limit, bodies, s, dt)) cycle
         if (.not. is_finite(bodies, s, dt)) then
            call raise(error, run_error, motion_text(limit, remedy, bodies, s, step))
         else if (is_first) then
            call self%warning%respond(self%choice, motion_text(limit, remedy, bodies, s, step), error, &
                                      weight_of(bodies, s))
         end if
         if (allocated(error)) then
            call place_error(error, bodies, s)
            return
         end if
         is_first = .false.
      end do
   end subroutine check_motion

   !> Weight of a warning of a body. Of several ranks, the warning with the greatest weight is reported. The order is
   !> that of a serial run: free bodies before fixed ones, each in ascending order of global index.
   pure real(dp) function weight_of(bodies, s)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s

      weight_of = 0.0_dp
      if (.not. allocated(bodies%global_index)) return
      weight_of = -real(bodies%global_index(s), dp)
      if (bodies%fixed(s)) weight_of = weight_of - real(bodies%n_all, dp)
   end function weight_of

   !> Message about a body that moves too far
   function motion_text(limit, remedy, bodies, s, step) result(text)
      !> Greatest displacement of a point in a step [m]
      real(wp), intent(in) :: limit
      !> Clause that says how to shorten the time step
      character(len=*), intent(in) :: remedy
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      integer(lp), intent(in) :: step
      character(len=:), allocatable :: text

      text = 'step '//to_text(step)//': body '//to_text(bodies%id(s))//' at ('// &
         to_text(bodies%position(1, s))//', '//to_text(bodies%position(2, s))//') m has the velocity ('// &
         to_text(bodies%velocity(1, s))//', '//to_text(bodies%velocity(2, s))// &
         ') m/s and the angular velocity '//to_text(bodies%angular_velocity(s))// &
         ' 1/s; no point of it may move more than '//to_text(limit)// &
         ' m in a step, otherwise bodies could pass through each other. '
      if (bodies%fixed(s)) then
         text = text//'It is part of a wall: check the motion of the wall, or sign and unit of the load on it'
      else
         text = text//'Check for deep overlaps at the start, or '//remedy
         if (step > early) text = text//'. A body that has left the scene falls ever faster: add a wall that holds '// &
            'it, or a &sink where it leaves'
      end if
   end function motion_text

end module polydem_displacement_guard
