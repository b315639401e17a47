!> What stops or warns a run before its results become nonsense.
module polydem_guards
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t, raise, run_error
   use polydem_kinds, only: ip, lp, wp, worth_threads
   use polydem_polygon, only: diameter
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_motion, check_step, check_contacts, greatest_move

   !> Greatest move in one step, as a share of the smallest free body; beyond it bodies could pass through each other
   real(wp), parameter :: move_share = 0.25_wp
   !> Share of the stable step above which a run warns
   real(wp), parameter :: warn_share = 0.5_wp

contains

   !> Greatest distance that a body may move in one step [m].
   pure real(wp) function greatest_move(bodies)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      integer(ip) :: k

      greatest_move = huge(1.0_wp)
      do k = 1_ip, size(bodies%free, kind=ip)
         associate (s => bodies%free(k))
            greatest_move = min(greatest_move, move_share* &
                                diameter(bodies%shape(:, bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip)))
         end associate
      end do
   end function greatest_move

   !> Stop if a free body has left the finite numbers or is too fast for the step.
   subroutine check_motion(bodies, step, dt, limit, error)
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Step [s]
      real(wp), intent(in) :: dt
      !> greatest_move(bodies) [m]
      real(wp), intent(in) :: limit
      !> Names body, position, velocity and step
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: fastest
      integer(ip) :: k, s
      logical :: good

      fastest = (limit/dt)**2
      good = .true.
      !$omp parallel do if (bodies%n > worth_threads) schedule(static) default(none) &
      !$omp    shared(bodies, fastest) private(k, s) reduction(.and.:good)
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         good = good .and. is_good(bodies, s, fastest)
      end do
      !$omp end parallel do
      if (good) return
      do k = 1_ip, size(bodies%free, kind=ip)
         s = bodies%free(k)
         if (is_good(bodies, s, fastest)) cycle
         call raise(error, run_error, 'step '//to_text(step)//': body '//to_text(bodies%id(s))//' at ('// &
                    to_text(bodies%position(1, s))//', '//to_text(bodies%position(2, s))//') m has the velocity ('// &
                    to_text(bodies%velocity(1, s))//', '//to_text(bodies%velocity(2, s))// &
                    ') m/s and the angular velocity '//to_text(bodies%angular_velocity(s))// &
                    ' 1/s; it may move at most '//to_text(limit)// &
                    ' m in a step. Take a smaller dt, or look for deep overlaps at the start')
         return
      end do
   end subroutine check_motion

   pure logical function is_good(bodies, s, fastest)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      real(wp), intent(in) :: fastest
      real(wp) :: size

      size = abs(bodies%position(1, s)) + abs(bodies%position(2, s)) + abs(bodies%angle(s)) &
         + abs(bodies%angular_velocity(s))
      is_good = size <= huge(size) .and. bodies%velocity(1, s)**2 + bodies%velocity(2, s)**2 <= fastest
   end function is_good

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
      !> Says how many there are
      type(error_t), allocatable, intent(inout) :: error

      if (contacts%n_degenerate == 0_ip .or. degenerate == 'push') return
      associate (i => contacts%first(contacts%first_degenerate), j => contacts%second(contacts%first_degenerate))
         call raise(error, run_error, 'step '//to_text(step)//': '//to_text(contacts%n_degenerate)// &
                    ' contacts have no direction, the first of the bodies '//to_text(bodies%id(i))//' and '// &
                    to_text(bodies%id(j))//' near ('//to_text(bodies%position(1, i))//', '// &
                    to_text(bodies%position(2, i))//') m: one body is inside the other, or they cross. '// &
                    'Set degenerate = ''push'' in &overlap to go on')
      end associate
   end subroutine check_contacts

end module polydem_guards
