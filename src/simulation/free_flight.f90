!> Free flight: what a step leaves out for bodies that nothing touches, in scenes without gravity. No bit changes.
!>
!> Without gravity bodies often fly alone. A body without pairs needs no turned vertices: its box follows from its
!> extreme corners. A body without acceleration and forces coasts: it only drifts, and needs no correction. Both save
!> most of the memory that a step of a large dilute scene reads and writes. With gravity a step leaves nothing out.
module polydem_free_flight
   use polydem_bodies, only: block_size, bodies_t, turn_bodies
   use polydem_body_runs, only: find_run, list_others
   use polydem_box_maker, only: turn_and_bound_block, turn_and_bound_in_cell
   use polydem_extreme_corners, only: bound_block, extreme_corners_t, forget_corners
   use polydem_integrator, only: drift, integrator_t
   use polydem_kinds, only: ip, wp
   use polydem_motion_tests, only: find_coasting
   use polydem_neighbour_search, only: neighbour_search_t
   use polydem_pair_list, only: pair_list_t
   implicit none
   private
   public :: free_flight_t

   !> What is left out for the bodies of a rank
   type :: free_flight_t
      private
      !> Whether there is no gravity
      logical :: is_weightless = .false.
      !> Whether vertices of bodies without pairs are not turned in this step, since few bodies have pairs
      logical :: is_dilute = .false.
      !> Whether bodies that coast only drift: there is no gravity, and the integrator moves them exactly
      logical :: skips_coasting = .false.
      !> Whether a body coasts in this step unless a force acts on it, and, between steps, whether it has coasted in the
      !> last one, (slot)
      logical, allocatable :: coasts(:)
      !> Extreme corners of the bodies
      type(extreme_corners_t) :: corners
   contains
      procedure :: start
      procedure :: forget_velocities
      procedure :: n_coasting
      procedure :: begin_step
      procedure :: predict
      procedure :: bound
      procedure :: turn_joined
      procedure :: corrects_all
      procedure :: list_accelerated
   end type free_flight_t

   !> A scene is dilute if at most one of so many bodies has pairs. Otherwise reading all vertices in sequence is faster
   integer(ip), parameter :: dilution = 4_ip

contains

   !> Start with nothing known of the bodies.
   subroutine start(self, gravity, has_fields, integrator, n)
      class(free_flight_t), intent(inout) :: self
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Whether forces act on bodies that are no contacts, or bodies have several pieces, of which pairs are made
      logical, intent(in) :: has_fields
      class(integrator_t), intent(in) :: integrator
      !> Number of bodies
      integer(ip), intent(in) :: n

      self%is_weightless = .not. (has_fields .or. any(abs(gravity) > 0.0_wp))
      self%is_dilute = .false.
      self%skips_coasting = self%is_weightless .and. integrator%coasts_exactly
      self%coasts = spread(.false., 1, n)
      if (self%is_weightless) call forget_corners(self%corners, n)
   end subroutine start

   !> Forget which bodies have coasted. Who changes velocities between steps must call this.
   pure subroutine forget_velocities(self)
      class(free_flight_t), intent(inout) :: self

      self%coasts = .false.
   end subroutine forget_velocities

   !> Number of bodies that have coasted in the last step
   pure integer(ip) function n_coasting(self)
      class(free_flight_t), intent(in) :: self

      n_coasting = count(self%coasts, kind=ip)
   end function n_coasting

   !> Begin a step: decide whether vertices of bodies without pairs are turned.
   pure subroutine begin_step(self, pairs, n)
      class(free_flight_t), intent(inout) :: self
      !> Pairs of the last step
      type(pair_list_t), intent(in) :: pairs
      !> Number of bodies
      integer(ip), intent(in) :: n

      self%is_dilute = self%is_weightless .and. pairs%n_paired <= n/dilution
   end subroutine begin_step

   !> Predict up to `block_size` bodies; those that have coasted only drift. Several threads may call it for different
   !> bodies.
   subroutine predict(self, integrator, limit, dt, slots, bodies)
      class(free_flight_t), intent(inout) :: self
      class(integrator_t), intent(inout) :: integrator
      !> Greatest displacement of a point in a step, which a body that coasts does not exceed [m]
      real(wp), intent(in) :: limit
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: n, next, first, last, others(block_size)

      if (.not. self%skips_coasting) then
         next = 1_ip
         do while (next <= size(slots, kind=ip))
            call find_run(slots, size(slots, kind=ip), next, first, last)
            call integrator%predict(dt, first, last, bodies)
         end do
         return
      end if
      call list_others(size(slots, kind=ip), slots, self%coasts, n, others)
      if (n < size(slots, kind=ip)) call drift_list(self%coasts, dt, slots, bodies)
      next = 1_ip
      do while (next <= n)
         call find_run(others, n, next, first, last)
         call integrator%predict(dt, first, last, bodies)
         call find_coasting(limit, bodies, first, last, dt, self%coasts)
      end do
   end subroutine predict

   !> Move those of some bodies that have coasted.
   subroutine drift_list(coasts, dt, slots, bodies)
      !> Whether a body has coasted, (slot)
      logical, intent(in), contiguous :: coasts(:)
      real(wp), intent(in) :: dt
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: next, first, last

      next = 1_ip
      do while (next <= size(slots, kind=ip))
         call find_run(slots, size(slots, kind=ip), next, first, last)
         call drift(dt, last - first + 1_ip, coasts(first:last), bodies%velocity(1, first), &
                    bodies%angular_velocity(first), bodies%position(1, first), bodies%angle(first))
      end do
   end subroutine drift_list

   !> Update the boxes of up to `block_size` bodies, and turn their vertices as far as they are needed. Several threads
   !> may call it for different bodies.
   subroutine bound(self, slots, search, bodies)
      class(free_flight_t), intent(inout) :: self
      !> Slots of the bodies, ascending
      integer(ip), intent(in), contiguous :: slots(:)
      !> Pairs of the last step; only the bounds of the boxes change
      type(neighbour_search_t), intent(inout) :: search
      !> Bodies; only `turned` changes
      type(bodies_t), intent(inout) :: bodies

      associate (maker => search%maker, boxes => search%boxes)
         if (self%is_dilute) then
            call bound_block(self%corners, maker, slots, search%neighbours%pairs%pairs_of, bodies, boxes)
         else if (bodies%cell%is_periodic) then
            call turn_and_bound_in_cell(maker, slots, bodies, boxes)
         else
            call turn_and_bound_block(maker, slots, bodies, boxes)
         end if
      end associate
   end subroutine bound

   !> Turn the vertices of the bodies that have pairs since this step; those of other bodies with pairs are turned.
   subroutine turn_joined(self, pairs, bodies)
      class(free_flight_t), intent(in) :: self
      !> Pairs of this step
      type(pair_list_t), intent(in) :: pairs
      !> Bodies; only `turned` changes
      type(bodies_t), intent(inout) :: bodies

      if (self%is_dilute .and. pairs%n_joined > 0_ip) call turn_bodies(bodies, pairs%joined(:pairs%n_joined))
   end subroutine turn_joined

   !> Whether all bodies need the correction from the forces: none coasts
   pure logical function corrects_all(self)
      class(free_flight_t), intent(in) :: self

      corrects_all = .not. self%skips_coasting
   end function corrects_all

   !> List those of up to `block_size` bodies that do not coast; the others need no correction. Several threads may call
   !> it for different bodies.
   pure subroutine list_accelerated(self, n, slots, has_terms, n_chosen, chosen)
      class(free_flight_t), intent(inout) :: self
      !> Number of bodies
      integer(ip), intent(in) :: n
      !> Their slots, ascending
      integer(ip), intent(in) :: slots(n)
      !> Whether a force of a contact acts on a body, (slot)
      logical, intent(in), contiguous :: has_terms(:)
      !> Number of the bodies that do not coast
      integer(ip), intent(out) :: n_chosen
      !> Their slots
      integer(ip), intent(inout) :: chosen(block_size)
      integer(ip) :: k

      n_chosen = 0_ip
      do k = 1_ip, n
         associate (s => slots(k))
            if (self%coasts(s) .and. .not. has_terms(s)) cycle
            n_chosen = n_chosen + 1_ip
            chosen(n_chosen) = s
            self%coasts(s) = .false.
         end associate
      end do
   end subroutine list_accelerated

end module polydem_free_flight
