!> Detects bodies that pass through each other: the centre of one body is inside the other, or the direction of their
!> contact reverses.
!>
!> The overlap pushes a body that crosses a thin body back at first. Later the overlap has no direction, and finally it
!> pushes the body out on the far side. The direction therefore turns by more than a right angle from one step to the
!> next while the bodies overlap all the time. The contact history stores the direction of the last step, packed into
!> one number per pair. The result thus depends neither on the number of ranks nor on restarts.
!>
!> If the centre of a body is inside another body, their overlap reaches from the centre to the outline. In 20 000
!> random pairs of all shapes, the depth was never less than an eighth of the thickness of the thinner body. Only
!> contacts deeper than half of this value are tested. The contact direction of two corners that graze each other also
!> reverses, but this is harmless.
module polydem_passing
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_strings, only: to_text
   implicit none
   private
   public :: find_passing, passing_text, packed_direction, is_reversed, centre_inside, least_depth

   !> Minimum depth of the tested contacts, as a fraction of the thickness of the thinner body
   real(wp), parameter :: least_depth = 0.0625_wp

contains

   !> In one loop over all contacts, find the first contact whose bodies pass through each other, test whether any
   !> contact is deeper than a limit, and store the directions.
   subroutine find_passing(bodies, contacts, thickness, radius, limit, history, found, any_deep)
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> Contacts of the step
      type(contacts_t), intent(in) :: contacts
      !> Thickness of each body, (slot) [m]
      real(wp), intent(in) :: thickness(:)
      !> Greatest distance of a vertex from the centre of each body, (slot) [m]
      real(wp), intent(in) :: radius(:)
      !> Limit of the depth as a fraction of the thickness of the thinner body
      real(wp), intent(in) :: limit
      !> Packed directions of the pairs, 0 without overlap, (pair). On entry those of the last step, on return those of
      !> this step
      real(wp), intent(inout) :: history(:)
      !> Index of the contact, 0 if there is none
      integer(ip), intent(out) :: found
      !> Whether any contact is deeper than the limit
      logical, intent(out) :: any_deep
      real(wp) :: before, now, share
      integer(ip) :: c, first
      logical :: deep

      first = huge(first)
      deep = .false.
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(bodies, contacts, thickness, radius, limit, history) private(c, before, now, share) &
      !$omp    reduction(min:first) reduction(.or.:deep)
      do c = 1_ip, contacts%n
         now = packed_direction(contacts%direction(1, c), contacts%direction(2, c))
         before = history(contacts%pair(c))
         history(contacts%pair(c)) = now
         share = contacts%length(c)*min(thickness(contacts%first(c)), thickness(contacts%second(c)))
         if (contacts%area(c) <= least_depth*share) cycle
         deep = deep .or. contacts%area(c) > limit*share
         if (is_reversed(before, now)) then
            first = min(first, c)
         else if (centre_inside(bodies, radius, contacts%first(c), contacts%second(c))) then
            first = min(first, c)
         else if (centre_inside(bodies, radius, contacts%second(c), contacts%first(c))) then
            first = min(first, c)
         end if
      end do
      !$omp end parallel do
      found = 0_ip
      if (first < huge(first)) found = first
      any_deep = deep
   end subroutine find_passing

   !> Message about a contact whose bodies pass through each other
   function passing_text(bodies, contacts, radius, c) result(text)
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Contacts of the step
      type(contacts_t), intent(in) :: contacts
      !> Greatest distance of a vertex from the centre of each body, (slot) [m]
      real(wp), intent(in) :: radius(:)
      !> Index of the contact
      integer(ip), intent(in) :: c
      character(len=:), allocatable :: text

      associate (i => contacts%first(c), j => contacts%second(c))
         if (centre_inside(bodies, radius, i, j)) then
            text = centre_text(i, j)
         else if (centre_inside(bodies, radius, j, i)) then
            text = centre_text(j, i)
         else
            text = 'the contact of the bodies '//to_text(bodies%id(i))//' and '//to_text(bodies%id(j))//' at ('// &
               to_text(bodies%position(1, i) + contacts%arm_first(1, c))//', '// &
               to_text(bodies%position(2, i) + contacts%arm_first(2, c))// &
               ') m changed its direction by more than 90 degrees in the step'
         end if
      end associate
      text = text//': one may pass through the other. Increase the stiffness, use thicker or slower bodies, or '// &
         'reduce dt'

   contains

      function centre_text(s, other) result(words)
         integer(ip), intent(in) :: s, other
         character(len=:), allocatable :: words

         words = 'the centre of body '//to_text(bodies%id(s))//' at ('//to_text(bodies%position(1, s))//', '// &
            to_text(bodies%position(2, s))//') m is inside body '//to_text(bodies%id(other))
      end function centre_text

   end function passing_text

   !> Whether the centre of a body is inside another body
   pure logical function centre_inside(bodies, radius, s, other)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Greatest distance of a vertex from the centre of each body, (slot) [m]
      real(wp), intent(in) :: radius(:)
      !> Slots of the body and of the other body
      integer(ip), intent(in) :: s, other
      real(wp) :: x, y, cross
      integer(ip) :: v, w

      x = bodies%position(1, s) - bodies%position(1, other)
      y = bodies%position(2, s) - bodies%position(2, other)
      centre_inside = x*x + y*y < radius(other)*radius(other)
      if (.not. centre_inside) return
      w = bodies%vertex_start(other + 1_ip) - 1_ip
      do v = bodies%vertex_start(other), bodies%vertex_start(other + 1_ip) - 1_ip
         cross = (bodies%turned(1, v) - bodies%turned(1, w))*(y - bodies%turned(2, w)) &
            - (bodies%turned(2, v) - bodies%turned(2, w))*(x - bodies%turned(1, w))
         centre_inside = cross > 0.0_wp
         if (.not. centre_inside) return
         w = v
      end do
   end function centre_inside

   !> Direction of a vector packed into one number from 1 to 5. The number increases with the angle, and any two
   !> perpendicular directions differ by 1 (modulo 4).
   pure real(wp) function packed_direction(x, y)
      !> Components of the vector
      real(wp), intent(in) :: x, y
      real(wp) :: share

      share = y/(abs(x) + abs(y))
      packed_direction = merge(2.0_wp + share, 4.0_wp - share, x >= 0.0_wp)
   end function packed_direction

   !> Whether two directions differ by more than a right angle; false if there is no previous direction
   pure logical function is_reversed(before, now)
      !> Previous direction packed by `packed_direction`; 0: none
      real(wp), intent(in) :: before
      !> Present direction, packed
      real(wp), intent(in) :: now

      is_reversed = before > 0.0_wp .and. abs(now - before) > 1.0_wp .and. abs(now - before) < 3.0_wp
   end function is_reversed

end module polydem_passing
