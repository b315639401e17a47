!> Exact static friction: stick is a constraint on velocities, not a spring.
!>
!> A contact that can hold does not slip at all, and needs no tangential stiffness, which would set the step; what it
!> carries follows from all contacts at once (D. Krengel & H.-G. Matuttis, J. Phys. Soc. Jpn. 87 (2018) 124402, pursue
!> the same aim). Normal forces F_n are those of the elastic and damping parts, known once positions are known, so that
!> neither inconsistency nor ambiguity of velocities can arise, as it does where normal and frictional forces
!> are sought together.
!>
!> **In time.** With a the accelerations by all other forces and b those by friction, velocity Verlet says
!>
!>     x_n+1 = x_n + h w_n,     w_n = v_n + h/2 (a_n + b_n) = w_n-1 + h (a_n + b_n)
!>
!> Positions move with w_n, the velocity in the middle of the step to come. Hence friction is asked to make
!> the slip of w_n vanish, or else to be at its limit and opposed to it: b_n is implicit, and otherwise a
!> force like any other. What follows:
!>
!> * A contact that sticks does not move: its slip is zero in every step, not only on average. If w_n-1 and w_n
!>   do not slip, a_n + b_n = 0 along the tangent, and so v_n = w_n does not slip either.
!> * A contact that slides gets -mu F_n at the positions where F_n is taken: second order, as all other forces.
!> * A contact that stops does so within one step, w_n = 0, and the next one finds nothing to do.
!> * Friction never adds energy: the kick of the other forces would lead to w' = w_n-1 + h a_n, and of all forces
!>   within the limits those of friction leave the least kinetic energy (see `polydem_box_qp`).
!> * Sums of forces times h are exact changes of momentum, as ever.
!>
!> Had one asked for no slip of v_n instead, v_n = v_n+1 = 0 would want b to alternate around what it should be; had one
!> added friction at the end of a step only, a block on a slope would have crept by h^2/2 g sin(slope) in each. Stick
!> holds along the tangents at the start of a step: a body that rolls slips by what the tangent turns in a step,
!> first order in h; and a wall moves with its velocity at the start of the step, which shifts what it
!> carries by h/2 times the change of its velocity, but does not add up.
module polydem_exact_friction
   use polydem_bodies, only: bodies_t
   use polydem_box_qp, only: box_qp_t, reserve_box_qp, solve_box_qp
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t
   use polydem_counters, only: counters_t
   use polydem_errors, only: error_t, input_error, raise, run_error
   use polydem_friction_network, only: build_network, free_velocities, friction_network_t, within
   use polydem_kinds, only: ip, lp, wp
   use polydem_settings, only: forces_settings_t, place_of, settings_t
   use polydem_strings, only: to_text
   use polydem_velocity_constraint, only: velocity_constraint_t
   implicit none
   private
   public :: exact_friction_t

   !> Coulomb friction without a spring
   type, extends(velocity_constraint_t) :: exact_friction_t
      !> Friction coefficient mu
      real(wp) :: coefficient = 0.0_wp
      !> Slip that may remain, as a share of the greatest slip velocity that friction takes from a contact in a step
      real(wp) :: tolerance = 0.0_wp
      !> Contacts of the last step
      type(friction_network_t) :: network
      !> Forces and velocities of the last step
      type(box_qp_t) :: programme
      !> Steps in which there was something to solve
      integer(lp), private :: n_solved = 0_lp
      !> Greatest slip so far, as a share like `tolerance`
      real(wp), private :: greatest_residual = 0.0_wp
   contains
      procedure :: choose
      procedure :: check
      procedure :: stored
      procedure :: apply
      procedure :: report
   end type exact_friction_t

   !> Unit of the residual among the counters, which are whole numbers
   real(wp), parameter :: residual_unit = 1.0e-15_wp

contains

   !> It is the friction 'exact'.
   subroutine choose(self, settings, chosen)
      class(exact_friction_t), intent(inout) :: self
      !> Group &forces
      type(forces_settings_t), intent(in) :: settings
      !> Whether it belongs to the law
      logical, intent(out) :: chosen

      chosen = settings%friction == 'exact'
      if (.not. chosen) return
      self%name = 'exact friction'
      self%coefficient = settings%friction_coefficient
      self%tolerance = settings%friction_tolerance
   end subroutine choose

   !> Refuse schemes that know no velocity in the middle of a step, and several processes.
   subroutine check(self, settings, n_processes, error)
      class(exact_friction_t), intent(in) :: self
      !> All settings of the run
      type(settings_t), intent(in) :: settings
      !> Number of processes that share the bodies
      integer(ip), intent(in) :: n_processes
      !> Names the entry and says what to do
      type(error_t), allocatable, intent(inout) :: error

      associate (unused_self => self)
      end associate
      if (settings%integrate%scheme /= 'velocity_verlet') call raise(error, input_error, &
         place_of(settings, 'integrate', 'scheme')//': ''scheme'' in &integrate must be velocity_verlet, since '// &
         '''friction'' in &forces is exact')
      if (n_processes > 1_ip) call raise(error, input_error, settings%file//': exact friction couples all contacts '// &
         'and needs a process of its own; use threads instead of ranks, or friction = ''cundall_strack'' in &forces')
   end subroutine check

   !> It stores the force that the next search starts from.
   function stored(self) result(kinds)
      class(exact_friction_t), intent(in) :: self
      type(history_kind_t), allocatable :: kinds(:)

      associate (unused_self => self)
      end associate
      kinds = [history_kind_t('tangential', 'N/m', 'tangential force remembered')]
   end function stored

   !> Find the friction of all contacts.
   subroutine apply(self, dt, incidence, bodies, contacts, history, error)
      class(exact_friction_t), intent(inout) :: self
      !> Step [s]
      real(wp), intent(in) :: dt
      !> Index of the contacts
      type(incidence_t), intent(in) :: incidence
      !> Bodies as predicted
      type(bodies_t), intent(in) :: bodies
      !> Contacts; `tangential_force` changes
      type(contacts_t), intent(inout) :: contacts
      !> Memory of the pairs: the force that the search starts from
      type(contact_history_t), intent(inout) :: history
      !> Says how much slip is left
      type(error_t), allocatable, intent(inout) :: error
      logical :: solved
      integer(ip) :: c

      associate (network => self%network, programme => self%programme)
         call build_network(dt, self%coefficient, bodies, contacts, network)
         call reserve_box_qp(programme, bodies%n, contacts%n)
         call free_velocities(dt, bodies, programme%free)
         programme%tolerance = self%tolerance
         do c = 1_ip, contacts%n
            programme%force(c) = within(network%limit(c), history%column(self%first_column)%value(contacts%pair(c)))
         end do
         call solve_box_qp(programme, network, incidence, solved)
         do c = 1_ip, contacts%n
            contacts%tangential_force(c) = contacts%tangential_force(c) + programme%force(c)
            history%column(self%first_column)%value(contacts%pair(c)) = programme%force(c)
         end do
         if (contacts%n > 0_ip) self%n_solved = self%n_solved + 1_lp
         self%greatest_residual = max(self%greatest_residual, programme%residual)
         if (.not. solved) call raise(error, run_error, 'exact friction: '//to_text(programme%residual, 2)// &
            ' of the greatest slip is left in a network of '//to_text(network%n)//' contacts, more than the '// &
            to_text(self%tolerance, 2)//' of friction_tolerance in &forces. Take a larger one')
      end associate
   end subroutine apply

   !> Set the counters of the work done so far.
   subroutine report(self, counters)
      class(exact_friction_t), intent(in) :: self
      !> List to set them in
      type(counters_t), intent(inout) :: counters

      call counters%set('friction steps', self%n_solved)
      call counters%set('friction sweeps', self%programme%n_sweeps)
      call counters%set('friction searches', self%programme%n_searches)
      call counters%set('friction iterations', self%programme%n_iterations)
      call counters%set('friction residual, 1e-15', nint(min(self%greatest_residual/residual_unit, 1.0e18_wp), lp))
   end subroutine report

end module polydem_exact_friction
