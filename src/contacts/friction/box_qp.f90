!> Friction of a contact network as a quadratic programme with bounds.
!>
!> The tangential forces f minimise 1/2 f' h W f + f' u_free subject to |f| <= mu F_n. The gradient of this function is
!> the slip velocity u. At the minimum, u = 0 where |f| < mu F_n, and u is opposed to f at the bound. Apart from the
!> motion of walls, the function is the kinetic energy over h: friction removes as much of it as possible. The
!> programme is convex. The velocities and the sums of forces on the bodies are unique. Single forces are not unique
!> where contacts brace each other; they stay near the forces at the start of the search.
!>
!> The solver alternates between two methods.
!>
!> * Sweeps of projected Gauss-Seidel find the contacts that stick. They start from the forces of the last step and
!>   solve easy networks in a few sweeps, but a column of n blocks takes about n^2 sweeps.
!> * When sweeps gain little, conjugate gradients, preconditioned by an incomplete factor of the mobilities
!>   (`polydem_friction_factor`), search among the contacts off their bounds. The search starts again with the
!>   remaining contacts whenever some reach their bounds. It ends at the minimum among them, or when releasing the
!>   contacts at their bounds gains much more. Then sweeps continue.
!>
!> This is the scheme of J.J. More & G. Toraldo, SIAM J. Optim. 1 (1991) 93, with sweeps in place of projected
!> gradients, and with the release test of Z. Dostal, SIAM J. Optim. 7 (1997) 871. Every step lowers the function and
!> sweeps alone converge, so the scheme converges. Once the contacts at bounds are known, a search takes at most as
!> many iterations as there are other contacts.
!>
!> Sums run over fixed blocks and then over the blocks in order. The result has the same bits for any number of threads.
module polydem_box_qp
   use omp_lib, only: omp_get_max_threads
   use polydem_contact_incidence, only: incidence_t
   use polydem_friction_factor, only: apply_factor, build_factor, friction_factor_t
   use polydem_friction_network, only: friction_network_t, measure_slip, push_bodies, &
      slip_of_contacts, sweep_contacts, within, worth_sharing
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: box_qp_t, solve_box_qp, reserve_box_qp

   !> Sums and extrema over all contacts at one point of a search
   type :: search_state_t
      !> Squared steepest descent of the contacts off their bounds, and of the contacts that would leave their bounds
      real(wp) :: descent = 0.0_wp, bound_descent = 0.0_wp
      !> Decrease of the function along the search direction at its start, curvature, and step length to the first bound
      real(wp) :: slope = 0.0_wp, curvature = 0.0_wp, max_length = 0.0_wp
      !> Greatest slip of the contacts off their bounds [m/s]
      real(wp) :: slip = 0.0_wp
   end type search_state_t

   !> A programme, its solution and the state of the solver
   type :: box_qp_t
      !> Velocities of bodies without friction, (3, slot) [m/s, m/s, rad/s]
      real(wp), allocatable :: free(:, :)
      !> Velocities of bodies with friction, (3, slot) [m/s, m/s, rad/s]
      real(wp), allocatable :: velocity(:, :)
      !> Tangential force of each contact of the network, (contact) [N/m]
      real(wp), allocatable :: force(:)
      !> Largest accepted avoidable slip, as a share of the greatest slip velocity that friction removes from a contact
      real(wp) :: tolerance = 0.0_wp
      !> Largest number of rounds of sweeps and a search, at least 1
      integer :: most_rounds = 1000
      !> Remaining avoidable slip, as a share like `tolerance`
      real(wp) :: residual = 0.0_wp
      !> Numbers of sweeps, of searches by conjugate gradients and of their iterations so far
      integer(lp) :: n_sweeps = 0_lp, n_searches = 0_lp, n_iterations = 0_lp
      !> Slip velocities, their negative off the bounds, and the changes of force that the factor yields, (contact)
      real(wp), allocatable, private :: slip(:), residue(:), change(:)
      !> Search direction and its slip, (contact)
      real(wp), allocatable, private :: direction(:), response(:)
      !> Approximate factor of the mobilities off the bounds
      type(friction_factor_t), private :: factor
      !> Velocities of bodies due to the search direction, (3, slot)
      real(wp), allocatable, private :: push(:, :)
      !> Sums, maxima or minima over each block of contacts, (6, block)
      real(wp), allocatable, private :: block_values(:, :)
      !> Slip below which a search ends [m/s]
      real(wp), private :: slip_tolerance = 0.0_wp
      !> Whether the search has reached a bound, and the state of the search there
      logical, private :: is_blocked = .false.
      type(search_state_t), private :: last
   end type box_qp_t

   !> Contacts per block of a sum
   integer(ip), parameter :: block = 256_ip
   !> Sweeps continue while each reduces the slip to at most this share
   real(wp), parameter :: sweep_ratio = 0.3_wp
   !> Contacts stay at their bounds until their squared descent is this multiple of that of the other contacts
   real(wp), parameter :: release_ratio = 10.0_wp
   !> Rounds with the same factor; contacts that leave their bounds meanwhile are treated as if uncoupled
   integer, parameter :: rounds_of_factor = 4
   !> Smaller shares of slip are rounding errors
   real(wp), parameter :: least_tolerance = 16.0_wp*epsilon(1.0_wp)

contains

   !> Improve the forces until the avoidable slip is within the tolerance.
   subroutine solve_box_qp(self, network, incidence, solved)
      !> Programme. Inputs: `free`, `tolerance`, and the first guess `force`, which must be within its bounds. Results:
      !> `force`, `velocity` and `residual`
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      !> Whether the residual is within the tolerance
      logical, intent(out) :: solved
      real(wp) :: residual, before, scale, allowed
      integer :: round

      self%residual = 0.0_wp
      solved = .true.
      if (network%n == 0_ip) return
      call update_velocities(self, network, incidence)
      before = huge(before)
      do round = 1, self%most_rounds
         do
            self%n_sweeps = self%n_sweeps + 1_lp
            call sweep_contacts(network, self%force, self%velocity)
            call measure_slip(network, self%force, self%velocity, residual, scale)
            allowed = max(self%tolerance, least_tolerance)*scale
            if (residual <= allowed) then
               if (residual > 0.0_wp) self%residual = residual/scale
               return
            end if
            if (.not. residual <= sweep_ratio*before) exit
            before = residual
         end do
         self%slip_tolerance = 0.5_wp*allowed
         if (mod(round, rounds_of_factor) == 1) call build_factor(network, incidence, self%force, self%factor)
         call search(self, network, incidence)
         before = residual
      end do
      self%residual = residual/max(scale, tiny(scale))
      solved = .false.
   end subroutine solve_box_qp

   !> Compute the velocities from the forces. This removes the rounding errors of earlier updates.
   subroutine update_velocities(self, network, incidence)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence

      if (uses_threads(network)) then
         !$omp parallel default(none) shared(self, network, incidence)
         call push_bodies(network, incidence, self%force, self%push)
         !$omp end parallel
      else
         call push_bodies(network, incidence, self%force, self%push)
      end if
      self%velocity = self%free + self%push
   end subroutine update_velocities

   !> Search among the contacts off their bounds by conjugate gradients; start again whenever some reach their bounds.
   subroutine search(self, network, incidence)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      integer(ip) :: k

      self%n_searches = self%n_searches + 1_lp
      ! Apart from rounding errors, one contact at least reaches its bound in each iteration.
      do k = 1_ip, 2_ip*network%n
         call update_velocities(self, network, incidence)
         if (uses_threads(network)) then
            !$omp parallel default(none) shared(self, network, incidence)
            call iterate(self, network, incidence)
            !$omp end parallel
         else
            call iterate(self, network, incidence)
         end if
         if (.not. self%is_blocked) exit
         call step_to_bounds(self, network, incidence)
      end do
      call update_velocities(self, network, incidence)
   end subroutine search

   !> Whether several threads work on a network. A barrier costs time even with one thread.
   logical function uses_threads(network)
      type(friction_network_t), intent(in) :: network

      uses_threads = network%n > worth_sharing
      if (uses_threads) uses_threads = omp_get_max_threads() > 1
   end function uses_threads

   !> Iterate conjugate gradients until the minimum, a bound or the release of contacts. The threads of a parallel
   !> region share the loops over contacts and bodies; every thread does the rest.
   subroutine iterate(self, network, incidence)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      type(search_state_t) :: now
      real(wp) :: slope
      logical :: is_blocked
      integer(ip) :: iteration, b, low, high

      !$omp do schedule(static)
      do b = 1_ip, blocks_of(network)
         low = (b - 1_ip)*block + 1_ip
         high = min(b*block, network%n)
         ! Until the end of a search, steps update the slip velocities, but not the velocities of bodies.
         call slip_of_contacts(network, self%velocity, low, high, self%slip)
         self%direction(low:high) = 0.0_wp
         self%response(low:high) = 0.0_wp
      end do
      !$omp end do
      call take_step(self, network, 0.0_wp, now)
      slope = huge(slope)
      is_blocked = .false.
      do iteration = 0_ip, network%n
         if (now%slip <= self%slip_tolerance .or. now%bound_descent > release_ratio*now%descent) exit
         call precondition(self, network, now)
         call set_direction(self, network, incidence, now%slope/slope, now)
         is_blocked = .not. now%slope < now%curvature*now%max_length
         if (is_blocked) exit
         slope = now%slope
         call take_step(self, network, now%slope/now%curvature, now)
      end do
      !$omp single
      self%n_iterations = self%n_iterations + int(iteration, lp) + merge(1_lp, 0_lp, is_blocked)
      self%is_blocked = is_blocked
      self%last = now
      !$omp end single
   end subroutine iterate

   !> Take a step along the search direction, and find the descent there.
   subroutine take_step(self, network, length, measures)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      !> Step length in multiples of the search direction
      real(wp), intent(in) :: length
      type(search_state_t), intent(inout) :: measures
      real(wp) :: descent, bound_descent, greatest, avoidable, is_off, is_bound
      integer(ip) :: b, c

      !$omp do schedule(static)
      do b = 1_ip, blocks_of(network)
         descent = 0.0_wp
         bound_descent = 0.0_wp
         greatest = 0.0_wp
         do c = (b - 1_ip)*block + 1_ip, min(b*block, network%n)
            associate (force => self%force(c), limit => network%limit(c), slip => self%slip(c))
               force = max(-limit, min(limit, force + length*self%direction(c)))
               slip = slip + length*self%response(c)
               is_off = merge(1.0_wp, 0.0_wp, abs(force) < limit)
               is_bound = merge(1.0_wp - is_off, 0.0_wp, limit > 0.0_wp)
               self%residue(c) = -is_off*slip
               avoidable = is_bound*max(0.0_wp, sign(1.0_wp, force)*slip)
               descent = descent + is_off*slip**2*network%inverse_mobility(c)
               bound_descent = bound_descent + avoidable**2*network%inverse_mobility(c)
               greatest = max(greatest, is_off*abs(slip))
            end associate
         end do
         self%block_values(1:3, b) = [descent, bound_descent, greatest]
      end do
      !$omp end do
      measures%descent = 0.0_wp
      measures%bound_descent = 0.0_wp
      measures%slip = 0.0_wp
      do b = 1_ip, blocks_of(network)
         measures%descent = measures%descent + self%block_values(1, b)
         measures%bound_descent = measures%bound_descent + self%block_values(2, b)
         measures%slip = max(measures%slip, self%block_values(3, b))
      end do
   end subroutine take_step

   !> Find the changes of force that the factor yields for the slip off the bounds.
   subroutine precondition(self, network, measures)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(search_state_t), intent(inout) :: measures
      real(wp) :: total
      integer(ip) :: b, c

      call apply_factor(self%factor, self%residue, self%change)
      !$omp do schedule(static)
      do b = 1_ip, blocks_of(network)
         total = 0.0_wp
         do c = (b - 1_ip)*block + 1_ip, min(b*block, network%n)
            self%change(c) = merge(self%change(c), 0.0_wp, abs(self%force(c)) < network%limit(c))
            total = total + self%residue(c)*self%change(c)
         end do
         self%block_values(6, b) = total
      end do
      !$omp end do
      measures%slope = 0.0_wp
      do b = 1_ip, blocks_of(network)
         measures%slope = measures%slope + self%block_values(6, b)
      end do
   end subroutine precondition

   !> Set the next search direction, conjugate to the last one, and find the curvature and the nearest bound along it.
   subroutine set_direction(self, network, incidence, share, measures)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      !> Share of the last direction in the next one
      real(wp), intent(in) :: share
      type(search_state_t), intent(inout) :: measures
      real(wp) :: curvature, max_length, length
      integer(ip) :: b, c, low, high

      !$omp do schedule(static)
      do c = 1_ip, network%n
         self%direction(c) = self%change(c) + share*self%direction(c)
      end do
      !$omp end do
      call push_bodies(network, incidence, self%direction, self%push)
      !$omp do schedule(static)
      do b = 1_ip, blocks_of(network)
         low = (b - 1_ip)*block + 1_ip
         high = min(b*block, network%n)
         call slip_of_contacts(network, self%push, low, high, self%response)
         curvature = 0.0_wp
         max_length = huge(max_length)
         do c = low, high
            associate (direction => self%direction(c))
               curvature = curvature + direction*self%response(c)
               length = (network%limit(c) - sign(self%force(c), self%force(c)*direction)) &
                  /merge(abs(direction), 1.0_wp, abs(direction) > 0.0_wp)
               max_length = min(max_length, merge(length, huge(length), abs(direction) > 0.0_wp))
            end associate
         end do
         self%block_values(4:5, b) = [curvature, max_length]
      end do
      !$omp end do
      measures%curvature = 0.0_wp
      measures%max_length = huge(measures%max_length)
      do b = 1_ip, blocks_of(network)
         measures%curvature = measures%curvature + self%block_values(4, b)
         measures%max_length = min(measures%max_length, self%block_values(5, b))
      end do
   end subroutine set_direction

   !> Take a step where the minimum along the search direction lies beyond a bound. The full step, with all forces
   !> limited to their bounds, finds many bounds at once. The step to the first bound is taken if it lowers the function
   !> more.
   subroutine step_to_bounds(self, network, incidence)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      real(wp) :: length, at_first_bound, beyond
      integer(ip) :: b

      associate (n => network%n, max_length => self%last%max_length, curvature => self%last%curvature, &
                 slope => self%last%slope)
         at_first_bound = max_length*(0.5_wp*max_length*curvature - slope)
         length = max_length
         if (curvature > 0.0_wp) length = max(max_length, slope/curvature)
         self%change(1:n) = within(network%limit(1:n), self%force(1:n) + length*self%direction(1:n)) - self%force(1:n)
         call push_bodies(network, incidence, self%change, self%push)
         call slip_of_contacts(network, self%push, 1_ip, n, self%response)
         beyond = 0.0_wp
         do b = 1_ip, n
            beyond = beyond + self%change(b)*(self%slip(b) + 0.5_wp*self%response(b))
         end do
         if (beyond < at_first_bound) then
            self%force(1:n) = within(network%limit(1:n), self%force(1:n) + self%change(1:n))
         else
            self%force(1:n) = within(network%limit(1:n), self%force(1:n) + max_length*self%direction(1:n))
         end if
      end associate
   end subroutine step_to_bounds

   !> Allocate the arrays for a network.
   subroutine reserve_box_qp(self, n_bodies, n_contacts)
      !> Programme; contents are lost when it grows
      type(box_qp_t), intent(inout) :: self
      !> Number of bodies
      integer(ip), intent(in) :: n_bodies
      !> Number of contacts
      integer(ip), intent(in) :: n_contacts
      integer(ip) :: m

      if (allocated(self%free)) then
         if (size(self%free, 2) /= n_bodies) deallocate (self%free, self%velocity, self%push)
      end if
      if (.not. allocated(self%free)) then
         allocate (self%free(3, n_bodies), self%velocity(3, n_bodies), self%push(3, n_bodies))
      end if
      if (allocated(self%force)) then
         if (size(self%force) >= n_contacts) return
         deallocate (self%force, self%slip, self%residue, self%change, self%direction, self%response, self%block_values)
      end if
      m = n_contacts + n_contacts/4_ip + 16_ip
      allocate (self%force(m), self%slip(m), self%residue(m), self%change(m), self%direction(m), self%response(m))
      allocate (self%block_values(6, m/block + 1_ip))
   end subroutine reserve_box_qp

   !> Number of blocks of contacts
   pure integer(ip) function blocks_of(network)
      type(friction_network_t), intent(in) :: network

      blocks_of = (network%n + block - 1_ip)/block
   end function blocks_of

end module polydem_box_qp
