!> Friction by a tangential spring with a Coulomb limit.
!>
!> P.A. Cundall & O.D.L. Strack, Geotechnique 29 (1979) 47, in the form of Matuttis & Chen 2014, Sec. 3.4.1. The spring
!> force changes by -k_t v_t dt and is limited to mu F_n. So is its sum with the dashpot force -d sqrt(k_t m_t) v_t,
!> 1/m_t = 1/m1 + 1/m2 + r1^2/I1 + r2^2/I2 (p. 144). The contact history stores the limited spring force.
!>
!> Coulomb's limit applies to contacts under pressure, F_n >= 0. Where another part pulls the bodies together, F_n < 0,
!> the limit is zero: there is no friction, and the spring force is reset to zero. A cohesive part with friction under
!> tension must compute that friction itself.
!>
!> With v_t at the end of the step, as in Matuttis & Chen, the spring is of first order in the step with any integration
!> scheme, and an undamped spring is unstable for w dt > 1.41. With v_t in the middle of the step its extension follows
!> the positions: it is of second order, and stable up to w dt = 2 with velocity Verlet.
module polydem_cundall_strack
   use polydem_bodies, only: bodies_t
   use polydem_contact_element, only: contact_element_t
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_contacts, only: contacts_t
   use polydem_force_part, only: force_part_t, stage_last
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: cundall_strack_t

   !> Friction by a tangential spring
   type, extends(force_part_t) :: cundall_strack_t
      !> Friction coefficient mu
      real(wp) :: coefficient = 0.0_wp
      !> Stiffness of the spring k_t [N/m2]
      real(wp) :: stiffness = 0.0_wp
      !> Dashpot as a share d of sqrt(k_t m_t)
      real(wp) :: damping = 0.0_wp
      !> Whether the spring uses the slip velocity in the middle of the step instead of that at its end
      logical :: midstep = .false.
   contains
      procedure :: configure
      procedure :: history_kinds
      procedure :: add
      procedure :: stiffen
   end type cundall_strack_t

contains

   !> Copy the parameters from the settings.
   subroutine configure(self, settings)
      class(cundall_strack_t), intent(inout) :: self
      !> Group &forces
      type(forces_settings_t), intent(in) :: settings

      self%stage = stage_last
      self%coefficient = settings%friction_coefficient
      self%stiffness = settings%tangential_stiffness*settings%stiffness
      self%damping = settings%tangential_damping
      self%midstep = settings%midstep_slip
   end subroutine configure

   !> Contact history of this part: the spring force
   function history_kinds(self) result(kinds)
      class(cundall_strack_t), intent(in) :: self
      type(history_kind_t), allocatable :: kinds(:)

      associate (unused_self => self)
      end associate
      kinds = [history_kind_t('tangential', 'N/m', 'force of the tangential spring')]
   end function history_kinds

   !> Add the tangential force and store the spring force.
   subroutine add(self, bodies, dt, contacts, history)
      class(cundall_strack_t), intent(in) :: self
      !> Bodies, for their masses and velocities
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s]
      real(wp), intent(in) :: dt
      !> Contacts; `tangential_force` changes
      type(contacts_t), intent(inout) :: contacts
      !> Contact history; the spring force is read and set
      type(contact_history_t), intent(inout) :: history
      real(wp) :: slip, mean, limit, spring
      integer(ip) :: c

      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, bodies, dt, contacts, history) &
      !$omp    private(c, slip, mean, limit, spring)
      do c = 1_ip, contacts%n
         slip = slip_of(bodies%velocity, bodies%angular_velocity, contacts, c)
         mean = slip
         if (self%midstep) mean = slip &
            - 0.5_wp*dt*slip_of(bodies%acceleration, bodies%angular_acceleration, contacts, c)
         limit = self%coefficient*max(0.0_wp, contacts%normal_force(c))
         spring = history%column(self%first_column)%value(contacts%pair(c)) - self%stiffness*mean*dt
         spring = max(-limit, min(limit, spring))
         history%column(self%first_column)%value(contacts%pair(c)) = spring
         if (self%damping > 0.0_wp) then
            spring = spring - self%damping*sqrt(self%stiffness/tangential_mobility(bodies, contacts, c))*slip
            spring = max(-limit, min(limit, spring))
         end if
         contacts%tangential_force(c) = contacts%tangential_force(c) + spring
      end do
      !$omp end parallel do
   end subroutine add

   !> Add the spring and its dashpot.
   subroutine stiffen(self, bodies, contacts, element)
      class(cundall_strack_t), intent(in) :: self
      !> Bodies (not used)
      type(bodies_t), intent(in) :: bodies
      !> Contacts (not used)
      type(contacts_t), intent(in) :: contacts
      !> The contact; tangential stiffness and dashpot change
      type(contact_element_t), intent(inout) :: element

      associate (unused_bodies => bodies, unused_contacts => contacts)
      end associate
      element%tangential_stiffness = element%tangential_stiffness + self%stiffness
      element%tangential_dashpot = element%tangential_dashpot &
         + self%damping*sqrt(element%tangential_mass*self%stiffness)
   end subroutine stiffen

   !> Velocity (or acceleration) of the first body relative to the second at the force point, along (-direction_y,
   !> direction_x) [m/s]. The centripetal acceleration of the arms does not extend the spring and is left out
   pure real(wp) function slip_of(velocity, angular_velocity, contacts, c)
      !> Velocities (2, body) [m/s] and angular velocities (body) [rad/s] of all bodies, or accelerations
      real(wp), intent(in) :: velocity(:, :), angular_velocity(:)
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c
      real(wp) :: vx, vy

      associate (i => contacts%first(c), j => contacts%second(c))
         vx = (velocity(1, i) - angular_velocity(i)*contacts%arm_first(2, c)) &
            - (velocity(1, j) - angular_velocity(j)*contacts%arm_second(2, c))
         vy = (velocity(2, i) + angular_velocity(i)*contacts%arm_first(1, c)) &
            - (velocity(2, j) + angular_velocity(j)*contacts%arm_second(1, c))
      end associate
      slip_of = contacts%direction(1, c)*vy - contacts%direction(2, c)*vx
   end function slip_of

   !> Reciprocal of the tangential effective mass m_t [m/kg]
   pure real(wp) function tangential_mobility(bodies, contacts, c)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c
      real(wp) :: square_first, square_second

      square_first = contacts%arm_first(1, c)**2 + contacts%arm_first(2, c)**2
      square_second = contacts%arm_second(1, c)**2 + contacts%arm_second(2, c)**2
      associate (i => contacts%first(c), j => contacts%second(c))
         tangential_mobility = bodies%inverse_mass(i) + bodies%inverse_mass(j) &
            + square_first*bodies%inverse_inertia(i) + square_second*bodies%inverse_inertia(j)
      end associate
   end function tangential_mobility

end module polydem_cundall_strack
