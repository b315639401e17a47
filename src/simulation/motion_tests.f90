!> Tests of bodies in every step: poses and velocities that are not finite, and displacements beyond a limit.
module polydem_motion_tests
   use polydem_bodies, only: bodies_t
   use polydem_errors, only: error_t, raise, run_error
   use polydem_kinds, only: far, ip, lp, wp
   use polydem_strings, only: to_text
   implicit none
   private
   public :: have_valid_poses, check_poses, move_within_limit, moves_within_limit, is_finite, find_coasting, &
      place_error, place_of, greatest_displacement

contains

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
   pure logical function move_within_limit(limit, bodies, first, last, dt)
      !> Greatest displacement of a point in a step [m]
      real(wp), intent(in) :: limit
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> First and last slot
      integer(ip), intent(in) :: first, last
      !> Time step [s]
      real(wp), intent(in) :: dt
      integer(ip) :: s, n_beyond

      n_beyond = 0_ip
      do s = first, last
         n_beyond = n_beyond + merge(0_ip, 1_ip, move_of(bodies, s, dt) <= limit)
      end do
      move_within_limit = n_beyond == 0_ip
   end function move_within_limit

   !> Find which bodies of a run coast unless a force acts on them: they have no acceleration, and do not move too far.
   !> Several threads may call it for different runs.
   pure subroutine find_coasting(limit, bodies, first, last, dt, coasts)
      !> Greatest displacement of a point in a step [m]
      real(wp), intent(in) :: limit
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
                         abs(bodies%angular_acceleration(s))) <= 0.0_wp .and. move_of(bodies, s, dt) <= limit
      end do
   end subroutine find_coasting

   !> Set the priority of an error among ranks from the body, or the pair, that it names. Of several failing ranks, the
   !> error with the smallest place is reported.
   pure subroutine place_error(error, bodies, first, second)
      type(error_t), intent(inout) :: error
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body, or of the first body of the pair
      integer(ip), intent(in) :: first
      !> Slot of the second body of the pair
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

   !> Whether the state of a body is finite and no point of it moves too far in a step; false for NaN
   pure logical function moves_within_limit(limit, bodies, s, dt)
      !> Greatest displacement of a point in a step [m]
      real(wp), intent(in) :: limit
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Time step [s]
      real(wp), intent(in) :: dt

      moves_within_limit = is_finite(bodies, s, dt) .and. move_of(bodies, s, dt) <= limit
   end function moves_within_limit

   !> Whether position, angle and velocities of a body are finite
   pure logical function is_finite(bodies, s, dt)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> Time step [s]
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

end module polydem_motion_tests
