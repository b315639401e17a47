!> What stops or warns a run before its results become nonsense.
module polydem_guards
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_bodies, only: bodies_t
   use polydem_boxes, only: far
   use polydem_body_sizes, only: measure_body
   use polydem_contacts, only: contacts_t, is_degenerate
   use polydem_errors, only: error_t, raise, run_error
   use polydem_kinds, only: dp, ip, lp, wp, worth_threads
   use polydem_settings, only: guards_settings_t
   use polydem_strings, only: to_text
   use polydem_warnings, only: warning_t
   implicit none
   private
   public :: motion_guard_t, new_motion_guard, check_places, check_motion, check_step, check_contacts, &
      place_of, greatest_move

   !> What is needed to see whether bodies move too far in a step
   type :: motion_guard_t
      !> Greatest distance that a point of a body may move in a step [m]; huge if that is not watched
      real(wp) :: limit = 0.0_wp
      !> Entry `displacement` of &guards
      character(len=:), allocatable :: choice
      !> Warnings so far
      type(warning_t) :: warning
      !> Greatest distance of a vertex from the centre of each body [m]
      real(wp), allocatable :: radius(:)
      !> Slots of the bodies that may move
      integer(ip), allocatable :: moving(:)
   end type motion_guard_t

   !> Share of the stable step above which a run warns
   real(wp), parameter :: warn_share = 0.5_wp

contains

   !> Prepare to watch bodies.
   subroutine new_motion_guard(guard, settings, bodies, moving)
      !> The guard
      type(motion_guard_t), intent(out) :: guard
      !> Group &guards
      type(guards_settings_t), intent(in) :: settings
      !> Bodies at the start
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies that may move
      integer(ip), intent(in) :: moving(:)
      real(wp) :: thickness
      integer(ip) :: s

      guard%choice = settings%displacement
      guard%moving = moving
      guard%limit = huge(1.0_wp)
      allocate (guard%radius(bodies%n))
      do s = 1_ip, bodies%n
         call measure_body(bodies, s, thickness, guard%radius(s))
         if (guard%choice /= 'off') guard%limit = min(guard%limit, settings%displacement_limit*thickness)
      end do
   end subroutine new_motion_guard

   !> Stop if a body is nowhere, before anybody looks for it by its place.
   subroutine check_places(guard, bodies, step, error)
      !> The guard
      type(motion_guard_t), intent(in) :: guard
      !> Bodies in the middle of a step
      type(bodies_t), intent(in) :: bodies
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Names body and step
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k
      logical :: good

      good = .true.
      !$omp parallel do if (bodies%n > worth_threads) schedule(static) default(none) &
      !$omp    shared(guard, bodies) private(k) reduction(.and.:good)
      do k = 1_ip, size(guard%moving, kind=ip)
         good = good .and. is_somewhere(bodies, guard%moving(k))
      end do
      !$omp end parallel do
      if (good) return
      do k = 1_ip, size(guard%moving, kind=ip)
         associate (s => guard%moving(k))
            if (is_somewhere(bodies, s)) cycle
            call raise(error, run_error, 'step '//to_text(step)//': body '//to_text(bodies%id(s))//' at ('// &
                       to_text(bodies%position(1, s))//', '//to_text(bodies%position(2, s))//') m, turned by '// &
                       to_text(bodies%angle(s))//', is nowhere: these must be numbers up to '//to_text(far)// &
                       '. Look at its velocity and forces in the step before')
            call place_error(error, bodies, s)
         end associate
         return
      end do
   end subroutine check_places

   !> Whether place and angle of a body are numbers with which boxes can be made
   pure logical function is_somewhere(bodies, s)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s

      is_somewhere = ieee_is_finite(bodies%position(1, s) + bodies%position(2, s) + bodies%angle(s))
      if (is_somewhere) is_somewhere = abs(bodies%position(1, s)) <= far .and. abs(bodies%position(2, s)) <= far &
                                       .and. abs(bodies%angle(s)) <= far
   end function is_somewhere

   !> Stop if a body has left the finite numbers; stop or warn if it moves too far in a step.
   subroutine check_motion(guard, bodies, step, dt, error)
      !> The guard
      type(motion_guard_t), intent(inout) :: guard
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Step [s]
      real(wp), intent(in) :: dt
      !> Names body, position, velocity and step
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, s
      logical :: good, is_first

      good = .true.
      !$omp parallel do if (bodies%n > worth_threads) schedule(static) default(none) &
      !$omp    shared(guard, bodies, dt) private(k) reduction(.and.:good)
      do k = 1_ip, size(guard%moving, kind=ip)
         good = good .and. is_good(guard, bodies, guard%moving(k), dt)
      end do
      !$omp end parallel do
      if (good) return
      is_first = .true.
      do k = 1_ip, size(guard%moving, kind=ip)
         s = guard%moving(k)
         if (is_good(guard, bodies, s, dt)) cycle
         if (.not. is_finite(guard, bodies, s, dt)) then
            call raise(error, run_error, motion_text(guard, bodies, s, step))
         else if (is_first) then
            call guard%warning%respond(guard%choice, motion_text(guard, bodies, s, step), error, weight_of(bodies, s))
         end if
         if (allocated(error)) then
            call place_error(error, bodies, s)
            return
         end if
         is_first = .false.
      end do
   end subroutine check_motion

   !> Say where among all of the run the body stands that an error names, or the first and the second body of a pair.
   pure subroutine place_error(error, bodies, first, second)
      type(error_t), intent(inout) :: error
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: first
      integer(ip), intent(in), optional :: second

      error%place = place_of(bodies, first, second)
   end subroutine place_error

   !> Place of a body among all of the run, or of a pair among all pairs; huge if that is not known
   pure integer(lp) function place_of(bodies, first, second)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body, or of the first of the pair
      integer(ip), intent(in) :: first
      !> Slot of the second body of the pair
      integer(ip), intent(in), optional :: second

      place_of = huge(place_of)
      if (.not. allocated(bodies%row)) return
      place_of = shiftl(int(bodies%row(first), lp), 31)
      if (present(second)) place_of = place_of + int(bodies%row(second), lp)
   end function place_of

   !> Weight of a warning of a body: of several, a lone process warns of the first, of free ones before walls
   pure real(dp) function weight_of(bodies, s)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s

      weight_of = 0.0_dp
      if (.not. allocated(bodies%row)) return
      weight_of = -real(bodies%row(s), dp)
      if (bodies%fixed(s)) weight_of = weight_of - real(bodies%n_all, dp)
   end function weight_of

   !> How a body moves, and what to do about it
   function motion_text(guard, bodies, s, step) result(text)
      type(motion_guard_t), intent(in) :: guard
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      integer(lp), intent(in) :: step
      character(len=:), allocatable :: text

      text = 'step '//to_text(step)//': body '//to_text(bodies%id(s))//' at ('// &
         to_text(bodies%position(1, s))//', '//to_text(bodies%position(2, s))//') m has the velocity ('// &
         to_text(bodies%velocity(1, s))//', '//to_text(bodies%velocity(2, s))// &
         ') m/s and the angular velocity '//to_text(bodies%angular_velocity(s))// &
         ' 1/s; no point of it may move more than '//to_text(guard%limit)// &
         ' m in a step, or bodies could pass through each other. Take a smaller dt, or look for deep '// &
         'overlaps at the start'
   end function motion_text

   !> Whether a body is finite and none of its points moves too far in a step; false for NaN
   pure logical function is_good(guard, bodies, s, dt)
      type(motion_guard_t), intent(in) :: guard
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: dt

      is_good = is_finite(guard, bodies, s, dt)
      if (is_good) is_good = move_of(guard, bodies, s, dt) <= guard%limit
   end function is_good

   !> Whether place, angle and velocities of a body are finite
   pure logical function is_finite(guard, bodies, s, dt)
      type(motion_guard_t), intent(in) :: guard
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: dt

      is_finite = ieee_is_finite(move_of(guard, bodies, s, dt) &
                                 + (bodies%position(1, s) + bodies%position(2, s) + bodies%angle(s)))
   end function is_finite

   !> Greatest distance that a point of any body that may move goes in a step at its present velocity [m]
   pure subroutine greatest_move(guard, bodies, dt, move, slot)
      !> The guard
      type(motion_guard_t), intent(in) :: guard
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Step [s]
      real(wp), intent(in) :: dt
      !> The distance, 0 if nothing moves [m]
      real(wp), intent(out) :: move
      !> Slot of the body, 0 if nothing moves
      integer(ip), intent(out) :: slot
      integer(ip) :: k

      move = 0.0_wp
      slot = 0_ip
      do k = 1_ip, size(guard%moving, kind=ip)
         if (.not. move_of(guard, bodies, guard%moving(k), dt) > move) cycle
         slot = guard%moving(k)
         move = move_of(guard, bodies, slot, dt)
      end do
   end subroutine greatest_move

   !> Greatest distance that a point of a body moves in a step [m]
   pure real(wp) function move_of(guard, bodies, s, dt)
      type(motion_guard_t), intent(in) :: guard
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: dt

      move_of = dt*(abs(bodies%velocity(1, s)) + abs(bodies%velocity(2, s)) &
                    + guard%radius(s)*abs(bodies%angular_velocity(s)))
   end function move_of

   !> Compare the step with the stable step of the contacts: a warning above a half, an error above one.
   subroutine check_step(bodies, contacts, step, dt, stable, critical, warning, error)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts
      type(contacts_t), intent(in) :: contacts
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Step in use [s]
      real(wp), intent(in) :: dt
      !> Stable step [s]
      real(wp), intent(in) :: stable
      !> The contact that sets it, 0 if there is none
      integer(ip), intent(in) :: critical
      !> Set if the step is a large share of the stable one
      character(len=:), allocatable, intent(out) :: warning
      !> Names the contact if the step is unstable
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text

      if (critical == 0_ip .or. dt <= warn_share*stable) return
      associate (i => contacts%first(critical), j => contacts%second(critical))
         text = 'step '//to_text(step)//': dt = '//to_text(dt)//' s is '//to_text(dt/stable, 3)// &
            ' of the stable step, set by the contact of the bodies '//to_text(bodies%id(i))//' and '// &
            to_text(bodies%id(j))//' at ('//to_text(bodies%position(1, i) + contacts%arm_first(1, critical))//', '// &
            to_text(bodies%position(2, i) + contacts%arm_first(2, critical))//') m'
      end associate
      if (dt > stable) then
         call raise(error, run_error, text//'. Take a smaller dt')
      else
         warning = text
      end if
   end subroutine check_step

   !> Stop if a contact has no direction and the settings ask for it.
   subroutine check_contacts(degenerate, bodies, contacts, step, error)
      !> Entry `degenerate` of &overlap: 'push' or 'stop'
      character(len=*), intent(in) :: degenerate
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts
      type(contacts_t), intent(in) :: contacts
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Names the first one
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: c

      if (contacts%n_degenerate == 0_ip .or. degenerate == 'push') return
      do c = 1_ip, contacts%n
         if (is_degenerate(contacts, c)) exit
      end do
      associate (i => contacts%first(c), j => contacts%second(c))
         call raise(error, run_error, 'step '//to_text(step)//': the contact of the bodies '//to_text(bodies%id(i))// &
                    ' and '//to_text(bodies%id(j))//' near ('//to_text(bodies%position(1, i))//', '// &
                    to_text(bodies%position(2, i))//') m has no direction: one body is inside the other, or they '// &
                    'cross. Set degenerate = ''push'' in &overlap to go on')
         call place_error(error, bodies, i, j)
      end associate
   end subroutine check_contacts

end module polydem_guards
