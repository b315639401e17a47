!> Bodies on their way through each other: the centre of one is inside the other, or their contact turns round.
!>
!> The overlap of a body that goes through a thin one pushes it back at first, then has no direction, and at last
!> pushes it out at the far side. So its direction turns by more than a right angle from one step to the next
!> while the bodies overlap all the time. Directions of the last step are remembered with the pairs, each packed into
!> one number; so what is found depends neither on processes nor on where a run was interrupted.
!>
!> Where the centre of a body is inside another, their overlap reaches from the centre to the outline; of 20 000 random
!> pairs of all shapes none was less deep than an eighth of the thinner body. Only contacts deeper than half of that are
!> looked at. Corners that touch in passing turn round, too, but are harmless.
module polydem_passing
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp, worth_threads
   use polydem_strings, only: to_text
   implicit none
   private
   public :: find_passing, passing_text, packed_direction, is_turned_round, centre_inside, least_depth

   !> Depth of contacts that are looked at, as a share of the thinner body
   real(wp), parameter :: least_depth = 0.0625_wp

contains

   !> Find the first contact whose bodies pass through each other, and whether any is deeper than a limit, in one go;
   !> and remember the directions.
   subroutine find_passing(bodies, contacts, thickness, radius, limit, remembered, found, any_deep)
      !> Bodies at the end of a step
      type(bodies_t), intent(in) :: bodies
      !> Contacts of the step
      type(contacts_t), intent(in) :: contacts
      !> Thickness of each body, (slot) [m]
      real(wp), intent(in) :: thickness(:)
      !> Greatest distance of a vertex from the centre of each body, (slot) [m]
      real(wp), intent(in) :: radius(:)
      !> Share of the thinner body
      real(wp), intent(in) :: limit
      !> Directions of the last step, packed; zero for bodies that did not overlap, (pair)
      real(wp), intent(inout) :: remembered(:)
      !> Place in the table of contacts, 0 if there is none
      integer(ip), intent(out) :: found
      !> Whether any contact is deeper than the limit
      logical, intent(out) :: any_deep
      real(wp) :: before, now, share
      integer(ip) :: c, first
      logical :: deep

      first = huge(first)
      deep = .false.
      !$omp parallel do if (contacts%n > worth_threads) schedule(static) default(none) &
      !$omp    shared(bodies, contacts, thickness, radius, limit, remembered) private(c, before, now, share) &
      !$omp    reduction(min:first) reduction(.or.:deep)
      do c = 1_ip, contacts%n
         now = packed_direction(contacts%direction(1, c), contacts%direction(2, c))
         before = remembered(contacts%pair(c))
         remembered(contacts%pair(c)) = now
         share = contacts%length(c)*min(thickness(contacts%first(c)), thickness(contacts%second(c)))
         if (contacts%area(c) <= least_depth*share) cycle
         deep = deep .or. contacts%area(c) > limit*share
         if (is_turned_round(before, now)) then
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

   !> What happens at a contact that was found, and what to do about it
   function passing_text(bodies, contacts, radius, c) result(text)
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Contacts of the step
      type(contacts_t), intent(in) :: contacts
      !> Greatest distance of a vertex from the centre of each body, (slot) [m]
      real(wp), intent(in) :: radius(:)
      !> Place in the table of contacts
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
               ') m turned by more than a right angle in the step'
         end if
      end associate
      text = text//': one may pass through the other. Take a greater stiffness, thicker or slower bodies, or a '// &
         'smaller dt'

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
      !> Slots of the body and of the other one
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

   !> A unit vector as one number from 1 to 5 that grows with its angle, by one for each right angle from any other
   pure real(wp) function packed_direction(x, y)
      !> The vector
      real(wp), intent(in) :: x, y
      real(wp) :: share

      share = y/(abs(x) + abs(y))
      packed_direction = merge(2.0_wp + share, 4.0_wp - share, x >= 0.0_wp)
   end function packed_direction

   !> Whether two directions are more than a right angle apart; no if the former is none
   pure logical function is_turned_round(before, now)
      !> The former direction packed by `packed_direction`, or 0 for none
      real(wp), intent(in) :: before
      !> The present direction, packed
      real(wp), intent(in) :: now

      is_turned_round = before > 0.0_wp .and. abs(now - before) > 1.0_wp .and. abs(now - before) < 3.0_wp
   end function is_turned_round

end module polydem_passing
