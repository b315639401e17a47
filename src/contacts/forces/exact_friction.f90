!> Exact static friction: stick is a constraint on velocities, not a spring.
!>
!> A contact below its Coulomb limit does not slip at all. It needs no tangential stiffness, which would limit the time
!> step. Its force follows from all contacts at once (D. Krengel & H.-G. Matuttis, J. Phys. Soc. Jpn. 87 (2018) 124402,
!> pursue the same aim). The elastic and damping parts compute the normal forces F_n before friction is solved. So the
!> velocities exist and are unique, unlike with methods that solve for normal and frictional forces together.
!>
!> **In time.** Let a be the accelerations by all other forces and b those by friction. Velocity Verlet reads
!>
!>     x_n+1 = x_n + h w_n,     w_n = v_n + h/2 (a_n + b_n) = w_n-1 + h (a_n + b_n)
!>
!> Positions move with w_n, the velocity in the middle of the next step. The friction force makes the slip of w_n zero,
!> or it is at its limit and opposes the slip. So b_n is implicit; otherwise friction is a force like any other. Hence:
!>
!> * A contact that sticks does not move: its slip is zero in every step, not only on average. If w_n-1 and w_n
!>   do not slip, a_n + b_n = 0 along the tangent, and so v_n = w_n does not slip either.
!> * A contact that slides gets -mu F_n at the positions where F_n is taken: second order, as all other forces.
!> * A contact that stops does so within one step, w_n = 0, and the next step starts from the solution.
!> * Friction never adds energy. Without it the velocity would be w' = w_n-1 + h a_n. Of all forces within the limits,
!>   friction leaves the least kinetic energy (see `polydem_box_qp`).
!> * Sums of forces times h are exact changes of momentum.
!>
!> A constraint on v_n instead would make b alternate around its correct value to keep v_n = v_n+1 = 0. Friction that is
!> added only at the end of a step would let a block on a slope creep by h^2/2 g sin(slope) per step.
!>
!> Stick holds along the tangents at the start of a step. A rolling body therefore slips by the turn of the tangent in a
!> step, first order in h. A wall moves with its velocity at the start of the step. This shifts the bodies on it by h/2
!> times the change of its velocity; the shift does not accumulate.
module polydem_exact_friction
   use polydem_bodies, only: bodies_t
   use polydem_box_qp, only: box_qp_t, reserve_box_qp, solve_box_qp
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_contact_incidence, only: incidence_t
   use polydem_contacts, only: contacts_t
   use polydem_counters, only: counters_t, greatest_step, over_steps
   use polydem_errors, only: error_t, input_error, raise, run_error
   use polydem_friction_network, only: build_network, free_velocities, friction_network_t, within
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_entries, only: at_friction_coefficient
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_pair_value, only: pair_value_t
   use polydem_source_locations, only: place_of
   use polydem_settings, only: forces_settings_t, settings_t
   use polydem_strings, only: to_text
   use polydem_velocity_constraint, only: velocity_constraint_t
   implicit none
   private
   public :: exact_friction_t

   !> Coulomb friction without a spring
   type, extends(velocity_constraint_t) :: exact_friction_t
      !> Friction coefficient mu
      type(pair_value_t) :: coefficient
      !> Its common factor in the settings
      real(wp) :: full_coefficient = 0.0_wp
      !> Accepted remaining slip, as a share of the greatest slip velocity that friction removes in a step
      real(wp) :: tolerance = 0.0_wp
      !> Network of the contacts of the last step
      type(friction_network_t) :: network
      !> Forces and velocities of the last step
      type(box_qp_t) :: programme
      !> Number of steps with at least one contact
      integer(lp), private :: n_solved = 0_lp
      !> Greatest remaining slip so far, as a share like `tolerance`
      real(wp), private :: greatest_residual = 0.0_wp
   contains
      procedure :: configure
      procedure :: scale_friction
      procedure :: check
      procedure :: apply
      procedure :: report
   end type exact_friction_t

   !> Unit of the counter of the residual; counters are integers
   real(wp), parameter :: residual_unit = 1.0e-15_wp

contains

   !> Copy the parameters from the settings. The contact history is the force, from which the next search starts.
   subroutine configure(self, settings, pairs)
      class(exact_friction_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      self%logged = [at_friction_coefficient]
      self%coefficient = pairs%friction_coefficient
      self%full_coefficient = self%coefficient%one
      self%tolerance = settings%friction_tolerance
      self%history_kinds = [history_kind_t('tangential', 'N/m', 'tangential force of the last step')]
   end subroutine configure

   !> Scale the friction coefficient.
   subroutine scale_friction(self, factor)
      class(exact_friction_t), intent(inout) :: self
      real(wp), intent(in) :: factor

      self%coefficient%one = factor*self%full_coefficient
   end subroutine scale_friction

   !> Refuse integration schemes without a velocity in the middle of a step, and several ranks.
   subroutine check(self, settings, n_processes, error)
      class(exact_friction_t), intent(in) :: self
      type(settings_t), intent(in) :: settings
      integer(ip), intent(in) :: n_processes
      !> Allocated if a setting is refused; names the entry and the remedy
      type(error_t), allocatable, intent(inout) :: error

      associate (unused_self => self)
      end associate
      if (settings%integrate%scheme /= 'velocity_verlet') call raise(error, input_error, &
         place_of(settings, 'integrate', 'scheme')//': ''scheme'' in &integrate must be velocity_verlet, since '// &
         '''friction'' in &forces is exact')
      if (n_processes > 1_ip) call raise(error, input_error, &
         place_of(settings, 'forces', 'friction')//': exact friction couples all contacts and runs on one rank '// &
         'only; use threads instead of ranks, or friction = ''cundall_strack'' in &forces')
   end subroutine check

   !> Compute the friction of all contacts.
   subroutine apply(self, dt, incidence, bodies, contacts, history, error)
      class(exact_friction_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      type(incidence_t), intent(in) :: incidence
      !> Bodies with predicted positions and velocities, and all other forces
      type(bodies_t), intent(in) :: bodies
      !> Contacts; `tangential_force` changes
      type(contacts_t), intent(inout) :: contacts
      !> Contact history; the force from which the search starts is read and set
      type(contact_history_t), intent(inout) :: history
      !> Allocated if the search does not converge; gives the remaining slip
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: coefficients(:)
      logical :: solved
      integer(ip) :: c

      allocate (coefficients(contacts%n))
      coefficients = self%coefficient%one
      if (allocated(self%coefficient%factor)) then
         do c = 1_ip, contacts%n
            coefficients(c) = self%coefficient%of(bodies%material([contacts%row(c)%first, contacts%row(c)%second]))
         end do
      end if
      associate (network => self%network, programme => self%programme)
         call build_network(dt, coefficients, bodies, contacts, network)
         call reserve_box_qp(programme, bodies%n, contacts%n)
         call free_velocities(dt, bodies, programme%free)
         programme%tolerance = self%tolerance
         do c = 1_ip, contacts%n
            programme%force(c) = within(network%limit(c), history%column(self%first_column)%value(contacts%row(c)%pair))
         end do
         call solve_box_qp(programme, network, incidence, solved)
         do c = 1_ip, contacts%n
            contacts%row(c)%tangential_force = contacts%row(c)%tangential_force + programme%force(c)
            history%column(self%first_column)%value(contacts%row(c)%pair) = programme%force(c)
         end do
         if (contacts%n > 0_ip) self%n_solved = self%n_solved + 1_lp
         self%greatest_residual = max(self%greatest_residual, programme%residual)
         if (.not. solved) call raise(error, run_error, 'exact friction did not converge in a network of '// &
            to_text(network%n)//' contacts: the remaining slip is '//to_text(programme%residual, 2)// &
            ' of the greatest slip, more than friction_tolerance = '//to_text(self%tolerance, 2)// &
            ' in &forces; set a larger friction_tolerance')
      end associate
   end subroutine apply

   !> Set the counters of the solver.
   subroutine report(self, counters)
      class(exact_friction_t), intent(in) :: self
      type(counters_t), intent(inout) :: counters

      call counters%set('friction steps', self%n_solved, over_steps)
      call counters%set('friction sweeps', self%programme%n_sweeps, over_steps)
      call counters%set('friction searches', self%programme%n_searches, over_steps)
      call counters%set('friction iterations', self%programme%n_iterations, over_steps)
      call counters%set('friction residual, 1e-15', nint(min(self%greatest_residual/residual_unit, 1.0e18_wp), lp), &
                        greatest_step)
   end subroutine report

end module polydem_exact_friction
