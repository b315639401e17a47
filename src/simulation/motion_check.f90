!> Checks of every step: non-finite states, displacements that are too large, and contacts without direction.
module polydem_motion_check
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: is_degenerate
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t, raise, run_error
   use polydem_kinds, only: far, dp, ip, lp, wp
   use polydem_settings, only: guards_settings_t, integrate_settings_t
   use polydem_strings, only: to_text
   use polydem_warning, only: warning_t
   implicit none
   private
   public :: motion_check_t, new_motion_check, displacement_limit, have_valid_poses, check_poses, move_within_limit, &
      find_coasting, check_motion, check_contacts, place_of, greatest_displacement, shorter_step, warn_share

   !> Limit of the displacement of bodies per step
   type :: motion_check_t
      !> Maximum displacement of a point of a body per step [m]; huge if the displacement is not monitored
      real(wp) :: limit = 0.0_wp
      !> Entry `displacement` of &guards
      character(len=:), allocatable :: choice
      !> Warnings of too large displacements
      type(warning_t) :: warning
      !> Clause that says how to shorten the time step
      character(len=:), allocatable :: remedy
   end type motion_check_t

   !> Fraction of the stable time step above which a run warns
   real(wp), parameter :: warn_share = 0.5_wp

   !> Number of steps after which a fast body may have fallen for long
   integer(lp), parameter :: early = 1000_lp

contains

   !> Clause that says how to shorten the time step: 'reduce dt' if the user chose it
   pure function shorter_step(settings) result(clause)
      type(integrate_settings_t), intent(in) :: settings
      character(len=:), allocatable :: clause

      clause = 'reduce dt'
      if (.not. settings%dt > 0.0_wp) clause = 'reduce safety_factor in &integrate'
   end function shorter_step

   !> Prepare the check for the present bodies.
   subroutine new_motion_check(check, settings, bodies, remedy)
      !> Limit of the displacement
      type(motion_check_t), intent(out) :: check
      type(guards_settings_t), intent(in) :: settings
      !> Bodies at the start
      type(bodies_t), intent(in) :: bodies
      !> Clause that says how to shorten the time step
      character(len=*), intent(in) :: remedy

      check%choice = settings%displacement
      check%remedy = remedy
      check%limit = displacement_limit(settings, bodies)
   end subroutine new_motion_check

   !> Maximum displacement of a point of a body per step; huge if it is not monitored [m]
   pure real(wp) function displacement_limit(settings, bodies) result(limit)
      type(guards_settings_t), intent(in) :: settings
      !> Bodies that may touch
      type(bodies_t), intent(in) :: bodies

      limit = huge(1.0_wp)
      if (settings%displacement == 'off' .or. bodies%n == 0_ip) return
      limit = settings%displacement_limit*minval(bodies%thickness)
   end function displacement_limit

   !> Whether all bodies of a run have valid poses
   pure logical function have_valid_poses(bodies, first, last)
      !> Bodies in the middle of a step
      type(bodies_t), intent(in) :: bodies
      !> First and last slot
      integer(ip), intent(in) :: first, last
      integer(ip) :: s, n_invalid

      n_invalid = 0_ip
      do s = first, last
         n_invalid = n_invalid + merge(0_ip, 1_ip, has_valid_pose(bodies, s))
      end do
      have_valid_poses = n_invalid == 0_ip
   end function have_valid_poses

   !> Stop if a body has an invalid pose, before boxes and neighbours are computed from it.
   subroutine check_poses(bodies, moving, step, error)
      !> Bodies in the middle of a step
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies that may move
      integer(ip), intent(in) :: moving(:)
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Names the body and the step
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k

      do k = 1_ip, size(moving, kind=ip)
         associate (s => moving(k))
            if (has_valid_pose(bodies, s)) cycle
            call raise(error, run_error, 'step '//to_text(step)//': body '//to_text(bodies%id(s))//' at ('// &
                       to_text(bodies%position(1, s))//', '//to_text(bodies%position(2, s))//') m with angle '// &
                       to_text(bodies%angle(s))//' has an invalid pose: position and angle must be finite and '// &
                       'at most '//to_text(far)//' in magnitude. Check its velocity and force in the previous step')
            call place_error(error, bodies, s)
         end associate
         return
      end do
   end subroutine check_poses

   !> Whether position and angle of a body are finite and small enough to compute boxes; false for NaN
   pure logical function has_valid_pose(bodies, s)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s

      has_valid_pose = abs(bodies%position(1, s)) <= far .and. abs(bodies%position(2, s)) <= far &
                       .and. abs(bodies%angle(s)) <= far
   end function has_valid_pose

   !> Whether the velocities of all bodies of a run are finite and none moves too far in a step. Positions and angles
   !> are not read: those of the middle of the step were finite, and an infinite correction of them is one of the
   !> velocities, too.
   pure logical function move_within_limit(check, bodies, first, last, dt)
      !> Limit of the displacement
      type(motion_check_t), intent(in) :: check
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> First and last slot
      integer(ip), intent(in) :: first, last
      !> Time step [s]
      real(wp), intent(in) :: dt
      integer(ip) :: s, n_beyond

      n_beyond = 0_ip
      do s = first, last
         n_beyond = n_beyond + merge(0_ip, 1_ip, move_of(bodies, s, dt) <= check%limit)
      end do
      move_within_limit = n_beyond == 0_ip
   end function move_within_limit

   !> Find which bodies of a run coast unless a force acts on them: they have no acceleration, and do not move too far.
   !> Several threads may call it for different runs.
   pure subroutine find_coasting(check, bodies, first, last, dt, coasts)
      !> Limit of the displacement
      type(motion_check_t), intent(in) :: check
      !> Bodies in the middle of a step
      type(bodies_t), intent(in) :: bodies
      !> First and last slot
      integer(ip), intent(in) :: first, last
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Whether a body coasts, (slot); those of the run are set
      logical, intent(inout), contiguous :: coasts(:)
      integer(ip) :: s

      do s = first, last
         coasts(s) = max(abs(bodies%acceleration(1, s)), abs(bodies%acceleration(2, s)), &
                         abs(bodies%angular_acceleration(s))) <= 0.0_wp .and. move_of(bodies, s, dt) <= check%limit
      end do
   end subroutine find_coasting

   !> Stop if the state of a body is not finite. Stop or warn if a body moves too far in a step.
   subroutine check_motion(check, bodies, moving, step, dt, error)
      !> Limit of the displacement
      type(motion_check_t), intent(inout) :: check
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
         if (moves_within_limit(check, bodies, s, dt)) cycle
         if (.not. is_finite(bodies, s, dt)) then
            call raise(error, run_error, motion_text(check, bodies, s, step))
         else if (is_first) then
            call check%warning%respond(check%choice, motion_text(check, bodies, s, step), error, weight_of(bodies, s))
         end if
         if (allocated(error)) then
            call place_error(error, bodies, s)
            return
         end if
         is_first = .false.
      end do
   end subroutine check_motion

   !> Set the priority of an error among ranks from the body, or the pair, that it names. Of several failing ranks, the
   !> error with the smallest place is reported.
   pure subroutine place_error(error, bodies, first, second)
      type(error_t), intent(inout) :: error
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: first
      integer(ip), intent(in), optional :: second

      error%place = place_of(bodies, first, second)
   end subroutine place_error

   !> Order of a body among all bodies of the run, or of a pair among all pairs; huge if unknown
   pure integer(lp) function place_of(bodies, first, second)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body, or of the first body of the pair
      integer(ip), intent(in) :: first
      !> Slot of the second body of the pair
      integer(ip), intent(in), optional :: second

      place_of = huge(place_of)
      if (.not. allocated(bodies%global_index)) return
      place_of = shiftl(int(bodies%global_index(first), lp), 31)
      if (present(second)) place_of = place_of + int(bodies%global_index(second), lp)
   end function place_of

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
   function motion_text(check, bodies, s, step) result(text)
      !> Limit of the displacement
      type(motion_check_t), intent(in) :: check
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      integer(lp), intent(in) :: step
      character(len=:), allocatable :: text

      text = 'step '//to_text(step)//': body '//to_text(bodies%id(s))//' at ('// &
         to_text(bodies%position(1, s))//', '//to_text(bodies%position(2, s))//') m has the velocity ('// &
         to_text(bodies%velocity(1, s))//', '//to_text(bodies%velocity(2, s))// &
         ') m/s and the angular velocity '//to_text(bodies%angular_velocity(s))// &
         ' 1/s; no point of it may move more than '//to_text(check%limit)// &
         ' m in a step, otherwise bodies could pass through each other. '
      if (bodies%fixed(s)) then
         text = text//'It is part of a wall: check the motion of the wall, or sign and unit of the load on it'
      else
         text = text//'Check for deep overlaps at the start, or '//check%remedy
         if (step > early) text = text//'. A body that has left the scene falls ever faster: add a wall that holds '// &
            'it, or a &sink where it leaves'
      end if
   end function motion_text

   !> Whether the state of a body is finite and no point of it moves too far in a step; false for NaN
   pure logical function moves_within_limit(check, bodies, s, dt)
      !> Limit of the displacement
      type(motion_check_t), intent(in) :: check
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: dt

      moves_within_limit = is_finite(bodies, s, dt) .and. move_of(bodies, s, dt) <= check%limit
   end function moves_within_limit

   !> Whether position, angle and velocities of a body are finite
   pure logical function is_finite(bodies, s, dt)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: dt

      is_finite = abs(move_of(bodies, s, dt) &
                      + (bodies%position(1, s) + bodies%position(2, s) + bodies%angle(s))) <= huge(dt)
   end function is_finite

   !> Greatest displacement per step of a point of any moving body, at the present velocities [m]
   pure subroutine greatest_displacement(bodies, slots, dt, move, slot)
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies to compare
      integer(ip), intent(in) :: slots(:)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> The displacement, 0 if no body moves [m]
      real(wp), intent(out) :: move
      !> Slot of the body, 0 if no body moves
      integer(ip), intent(out) :: slot
      integer(ip) :: k

      move = 0.0_wp
      slot = 0_ip
      do k = 1_ip, size(slots, kind=ip)
         if (.not. move_of(bodies, slots(k), dt) > move) cycle
         slot = slots(k)
         move = move_of(bodies, slot, dt)
      end do
   end subroutine greatest_displacement

   !> Upper bound of the displacement of a point of a body in a step [m]
   pure real(wp) function move_of(bodies, s, dt)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: dt

      move_of = dt*(abs(bodies%velocity(1, s)) + abs(bodies%velocity(2, s)) &
                    + bodies%radius(s)*abs(bodies%angular_velocity(s)))
   end function move_of

   !> Stop if a contact has no direction and `degenerate` is 'stop'.
   subroutine check_contacts(degenerate, bodies, contacts, step, error)
      !> Entry `degenerate` of &overlap: 'push' or 'stop'
      character(len=*), intent(in) :: degenerate
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Names the bodies of the first such contact
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: c

      if (contacts%n_degenerate == 0_ip .or. degenerate == 'push') return
      do c = 1_ip, contacts%n
         if (is_degenerate(contacts%row(c))) exit
      end do
      associate (i => contacts%row(c)%first, j => contacts%row(c)%second)
         call raise(error, run_error, 'step '//to_text(step)//': the contact of the bodies '//to_text(bodies%id(i))// &
                    ' and '//to_text(bodies%id(j))//' near ('//to_text(bodies%position(1, i))//', '// &
                    to_text(bodies%position(2, i))//') m has no direction: one body is inside the other, or they '// &
                    'cross. Set degenerate = ''push'' in &overlap to continue')
         call place_error(error, bodies, i, j)
      end associate
   end subroutine check_contacts

end module polydem_motion_check
