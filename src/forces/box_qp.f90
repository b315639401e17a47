!> Friction of a contact network as a quadratic programme with bounds.
!>
!> The tangential forces f make 1/2 f' h W f + f' u_free, whose gradient is the slip velocity u, as small as it gets
!> with |f| <= mu F_n: then u = 0 where |f| < mu F_n, and u is opposed to f at the bound. But for the motion of walls
!> this is the kinetic energy over h: friction takes as much of it as it can. The programme is convex. Velocities and
!> the sums of forces on bodies are unique; single forces are not where contacts brace each other, and then they
!> stay near those that the search starts from.
!>
!> Projected Gauss-Seidel finds which contacts stick and solves easy networks in a few sweeps from the forces of the
!> last step, but for a column of n blocks it takes some n^2 sweeps. So, when sweeps gain little, the contacts
!> off their bounds are handed to conjugate gradients (with the mobilities as preconditioner), anew with those that are
!> left whenever some come to their bounds, until the minimum among them is reached or the contacts at bounds have
!> much more to gain by being let go; then sweeps go on. This is the scheme of J.J. More & G. Toraldo, SIAM J. Optim. 1
!> (1991) 93, with sweeps in place of projected gradients, and with the test for letting go of Z. Dostal, SIAM J. Optim.
!> 7 (1997) 871. Every step lowers the function, and sweeps alone converge, so the whole does; once the contacts at
!> bounds are known, a search ends in at most as many iterations as there are others.
!>
!> Sums run over fixed blocks, and then over blocks in order: the same bits for any number of threads.
module polydem_box_qp
   use omp_lib, only: omp_get_max_threads
   use polydem_contact_incidence, only: incidence_t
   use polydem_friction_network, only: avoidable_slip, friction_network_t, measure_slip, push_bodies, &
      slip_of_contacts, sweep_contacts, within, worth_sharing
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: box_qp_t, solve_box_qp, reserve_box_qp

   !> What a search looks at
   type :: measures_t
      !> Squared steepest descent of the contacts off their bounds, and of those that ask to be let go
      real(wp) :: descent = 0.0_wp, wish = 0.0_wp
      !> Curvature along the direction of search, and how far it is to the first bound
      real(wp) :: curvature = 0.0_wp, room = 0.0_wp
      !> Greatest slip of the contacts off their bounds [m/s]
      real(wp) :: slip = 0.0_wp
   end type measures_t

   !> A programme, its solution and how it was found
   type :: box_qp_t
      !> Velocities of bodies without friction, (3, slot) [m/s, m/s, rad/s]
      real(wp), allocatable :: free(:, :)
      !> Velocities of bodies with it, (3, slot)
      real(wp), allocatable :: velocity(:, :)
      !> Tangential force of each contact of the network [N/m]
      real(wp), allocatable :: force(:)
      !> Avoidable slip that may remain, as a share of the greatest slip velocity that a contact takes away
      real(wp) :: tolerance = 0.0_wp
      !> Sweeps and searches take turns at most this often, at least once
      integer :: most_rounds = 1000
      !> The share that did remain
      real(wp) :: residual = 0.0_wp
      !> Sweeps, searches by conjugate gradients and their iterations so far
      integer(lp) :: n_sweeps = 0_lp, n_searches = 0_lp, n_iterations = 0_lp
      !> Slip velocities, steepest descent, direction of search and its slip, (contact)
      real(wp), allocatable, private :: slip(:), steepest(:), direction(:), response(:)
      !> Velocities that the direction of search gives, (3, slot)
      real(wp), allocatable, private :: push(:, :)
      !> Sums, or the greatest or least numbers, of blocks of contacts, (5, block)
      real(wp), allocatable, private :: of_block(:, :)
      !> Slip below which a search ends [m/s]
      real(wp), private :: enough = 0.0_wp
      !> Whether a search has come to a bound, with what it knew there
      logical, private :: is_blocked = .false.
      type(measures_t), private :: last
   end type box_qp_t

   !> Contacts per block of a sum
   integer(ip), parameter :: block = 256_ip
   !> Sweeps go on while one leaves less than this share of the slip
   real(wp), parameter :: good_share = 0.3_wp
   !> Contacts are held at their bounds until their squared descent is this many times that of the others
   real(wp), parameter :: patience = 10.0_wp
   !> No smaller share of slip than this can be told from rounding
   real(wp), parameter :: least_tolerance = 16.0_wp*epsilon(1.0_wp)

contains

   !> Improve the forces until no slip is left that they could take away.
   subroutine solve_box_qp(self, network, incidence, solved)
      !> Programme: `free` and `tolerance` are given, and `force` to start from, within its bounds; `force` and
      !> `velocity` are the solution
      type(box_qp_t), intent(inout) :: self
      !> Contacts
      type(friction_network_t), intent(in) :: network
      !> Contacts of each body
      type(incidence_t), intent(in) :: incidence
      !> Whether the solution is as good as was asked for
      logical, intent(out) :: solved
      real(wp) :: residual, before, scale, allowed
      integer :: round

      self%residual = 0.0_wp
      solved = .true.
      if (network%n == 0_ip) return
      call renew_velocities(self, network, incidence)
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
            if (.not. residual <= good_share*before) exit
            before = residual
         end do
         self%enough = 0.5_wp*allowed
         call search(self, network, incidence)
         before = residual
      end do
      self%residual = residual/max(scale, tiny(scale))
      solved = .false.
   end subroutine solve_box_qp

   !> Velocities from the forces, without the rounding errors of earlier changes.
   subroutine renew_velocities(self, network, incidence)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence

      if (is_shared(network)) then
         !$omp parallel default(none) shared(self, network, incidence)
         call push_bodies(network, incidence, self%force, self%push)
         !$omp end parallel
      else
         call push_bodies(network, incidence, self%force, self%push)
      end if
      self%velocity = self%free + self%push
   end subroutine renew_velocities

   !> Conjugate gradients among the contacts off their bounds, which become fewer whenever some come to theirs.
   subroutine search(self, network, incidence)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      integer(ip) :: k

      self%n_searches = self%n_searches + 1_lp
      ! Each time around a contact comes to its bound, but for rounding errors.
      do k = 1_ip, 2_ip*network%n
         call renew_velocities(self, network, incidence)
         if (is_shared(network)) then
            !$omp parallel default(none) shared(self, network, incidence)
            call descend(self, network, incidence)
            !$omp end parallel
         else
            call descend(self, network, incidence)
         end if
         if (.not. self%is_blocked) exit
         call step_to_bounds(self, network, incidence)
      end do
      call renew_velocities(self, network, incidence)
   end subroutine search

   !> Whether several threads work on a network; barriers cost something even where there is only one.
   logical function is_shared(network)
      type(friction_network_t), intent(in) :: network

      is_shared = network%n > worth_sharing
      if (is_shared) is_shared = omp_get_max_threads() > 1
   end function is_shared

   !> The iterations. Threads of a parallel region share the work on contacts and bodies and do the rest alike.
   subroutine descend(self, network, incidence)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      type(measures_t) :: now
      real(wp) :: share, descent
      logical :: is_blocked
      integer(ip) :: iteration, b

      !$omp do schedule(static)
      do b = 1_ip, blocks_of(network)
         call begin_block(self, network, b)
      end do
      !$omp end do
      call look_around(self, network, 0.0_wp, now)
      share = 0.0_wp
      is_blocked = .false.
      do iteration = 0_ip, network%n
         if (now%slip <= self%enough .or. now%wish > patience*now%descent) exit
         call look_ahead(self, network, incidence, share, now)
         is_blocked = .not. now%descent < now%curvature*now%room
         if (is_blocked) exit
         descent = now%descent
         call look_around(self, network, now%descent/now%curvature, now)
         share = now%descent/descent
      end do
      !$omp single
      self%n_iterations = self%n_iterations + int(iteration, lp) + merge(1_lp, 0_lp, is_blocked)
      self%is_blocked = is_blocked
      self%last = now
      !$omp end single
   end subroutine descend

   !> Move a number of times along the direction of search, and find the steepest descent there.
   subroutine look_around(self, network, length, measures)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      real(wp), intent(in) :: length
      type(measures_t), intent(inout) :: measures
      integer(ip) :: b

      !$omp do schedule(static)
      do b = 1_ip, blocks_of(network)
         call step_in_block(self, network, length, b)
      end do
      !$omp end do
      measures%descent = 0.0_wp
      measures%wish = 0.0_wp
      measures%slip = 0.0_wp
      do b = 1_ip, blocks_of(network)
         measures%descent = measures%descent + self%of_block(1, b)
         measures%wish = measures%wish + self%of_block(2, b)
         measures%slip = max(measures%slip, self%of_block(3, b))
      end do
   end subroutine look_around

   !> Next direction of search, conjugate to the last one, and what lies along it.
   subroutine look_ahead(self, network, incidence, share, measures)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      !> Share of the last direction in the next one
      real(wp), intent(in) :: share
      type(measures_t), intent(inout) :: measures
      integer(ip) :: b, c

      !$omp do schedule(static)
      do c = 1_ip, network%n
         self%direction(c) = self%steepest(c) + share*self%direction(c)
      end do
      !$omp end do
      call push_bodies(network, incidence, self%direction, self%push)
      !$omp do schedule(static)
      do b = 1_ip, blocks_of(network)
         call look_in_block(self, network, b)
      end do
      !$omp end do
      measures%curvature = 0.0_wp
      measures%room = huge(measures%room)
      do b = 1_ip, blocks_of(network)
         measures%curvature = measures%curvature + self%of_block(4, b)
         measures%room = min(measures%room, self%of_block(5, b))
      end do
   end subroutine look_ahead

   !> The part of a block in the start of a search: from now on slip velocities follow the steps, and velocities rest.
   subroutine begin_block(self, network, b)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      integer(ip), intent(in) :: b
      integer(ip) :: low, high

      low = (b - 1_ip)*block + 1_ip
      high = min(b*block, network%n)
      call slip_of_contacts(network, self%velocity, low, high, self%slip)
      self%direction(low:high) = 0.0_wp
      self%response(low:high) = 0.0_wp
   end subroutine begin_block

   !> The part of a block in `look_around`.
   subroutine step_in_block(self, network, length, b)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      real(wp), intent(in) :: length
      integer(ip), intent(in) :: b
      real(wp) :: descent, wish, greatest, avoidable
      integer(ip) :: c

      descent = 0.0_wp
      wish = 0.0_wp
      greatest = 0.0_wp
      do c = (b - 1_ip)*block + 1_ip, min(b*block, network%n)
         self%force(c) = within(network%limit(c), self%force(c) + length*self%direction(c))
         self%slip(c) = self%slip(c) + length*self%response(c)
         if (abs(self%force(c)) < network%limit(c)) then
            self%steepest(c) = -self%slip(c)/network%mobility(c)
            descent = descent - self%steepest(c)*self%slip(c)
            greatest = max(greatest, abs(self%slip(c)))
         else
            self%steepest(c) = 0.0_wp
            avoidable = avoidable_slip(self%force(c), network%limit(c), self%slip(c))
            wish = wish + avoidable**2/network%mobility(c)
         end if
      end do
      self%of_block(1:3, b) = [descent, wish, greatest]
   end subroutine step_in_block

   !> The part of a block in `look_ahead`.
   subroutine look_in_block(self, network, b)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      integer(ip), intent(in) :: b
      real(wp) :: curvature, room
      integer(ip) :: c, low, high

      low = (b - 1_ip)*block + 1_ip
      high = min(b*block, network%n)
      call slip_of_contacts(network, self%push, low, high, self%response)
      curvature = 0.0_wp
      room = huge(room)
      do c = low, high
         associate (direction => self%direction(c))
            curvature = curvature + direction*self%response(c)
            if (abs(direction) > 0.0_wp) &
               room = min(room, (network%limit(c) - sign(self%force(c), self%force(c)*direction))/abs(direction))
         end associate
      end do
      self%of_block(4:5, b) = [curvature, room]
   end subroutine look_in_block

   !> The minimum along the direction of search lies beyond a bound: go there with all forces cut at their bounds, which
   !> finds many bounds at once, or only to the first bound if that lowers the function more.
   subroutine step_to_bounds(self, network, incidence)
      type(box_qp_t), intent(inout) :: self
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      real(wp) :: length, at_first_bound, beyond
      integer(ip) :: b

      associate (n => network%n, room => self%last%room, curvature => self%last%curvature, descent => self%last%descent)
         at_first_bound = room*(0.5_wp*room*curvature - descent)
         length = room
         if (curvature > 0.0_wp) length = max(room, descent/curvature)
         self%steepest(1:n) = within(network%limit(1:n), self%force(1:n) + length*self%direction(1:n)) - self%force(1:n)
         call push_bodies(network, incidence, self%steepest, self%push)
         call slip_of_contacts(network, self%push, 1_ip, n, self%response)
         beyond = 0.0_wp
         do b = 1_ip, n
            beyond = beyond + self%steepest(b)*(self%slip(b) + 0.5_wp*self%response(b))
         end do
         if (beyond < at_first_bound) then
            self%force(1:n) = within(network%limit(1:n), self%force(1:n) + self%steepest(1:n))
         else
            self%force(1:n) = within(network%limit(1:n), self%force(1:n) + room*self%direction(1:n))
         end if
      end associate
   end subroutine step_to_bounds

   !> Make room for a network.
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
         deallocate (self%force, self%slip, self%steepest, self%direction, self%response, self%of_block)
      end if
      m = n_contacts + n_contacts/4_ip + 16_ip
      allocate (self%force(m), self%slip(m), self%steepest(m), self%direction(m), self%response(m))
      allocate (self%of_block(5, m/block + 1_ip))
   end subroutine reserve_box_qp

   !> Number of blocks of contacts
   pure integer(ip) function blocks_of(network)
      type(friction_network_t), intent(in) :: network

      blocks_of = (network%n + block - 1_ip)/block
   end function blocks_of

end module polydem_box_qp
