!> Friction by a tangential spring with a Coulomb limit.
!>
!> P.A. Cundall & O.D.L. Strack, Geotechnique 29 (1979) 47; as in Matuttis & Chen 2014, Sec. 3.4.1: the spring
!> force changes by -k_t v_t dt and is cut at mu F_n, as is its sum with the damping -d sqrt(k_t m_t) v_t,
!> 1/m_t = 1/m1 + 1/m2 + r1^2/I1 + r2^2/I2 (p. 144). The cut spring is what is remembered.
!>
!> With v_t at the end of the step, as in the book, the spring is of first order in the step whatever the integrator,
!> and an undamped one is unstable from w dt = 1.41 on. With v_t in the middle of the step its extension is that
!> of a spring tied to the positions: of second order, and stable to w dt = 2 with velocity Verlet.
module polydem_cundall_strack
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: at_tangential, contact_memory_t
   use polydem_contacts, only: contacts_t
   use polydem_force_part, only: force_part_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   implicit none
   private
   public :: cundall_strack_t

   !> Friction by a spring with memory
   type, extends(force_part_t) :: cundall_strack_t
      !> Friction coefficient mu
      real(wp) :: coefficient
      !> Stiffness of the spring k_t [N/m2]
      real(wp) :: stiffness
      !> Damping as a share of sqrt(k_t m_t)
      real(wp) :: damping
      !> Whether the slip velocity in the middle of the step extends the spring, not that at its end
      logical :: midstep = .false.
   contains
      procedure :: add
   end type cundall_strack_t

contains

   !> Add the tangential force and remember the spring.
   subroutine add(self, bodies, dt, contacts, memory)
      class(cundall_strack_t), intent(in) :: self
      !> Bodies, for their masses and velocities
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s]
      real(wp), intent(in) :: dt
      !> Contacts; `tangential_force` changes
      type(contacts_t), intent(inout) :: contacts
      !> Memory of the pairs; `tangential` is read and set
      type(contact_memory_t), intent(inout) :: memory
      real(wp) :: slip, mean, limit, spring
      integer(ip) :: c

      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, bodies, dt, contacts, memory) &
      !$omp    private(c, slip, mean, limit, spring)
      do c = 1_ip, contacts%n
         slip = slip_of(bodies%velocity, bodies%angular_velocity, contacts, c)
         mean = slip
         if (self%midstep) mean = slip &
            - 0.5_wp*dt*slip_of(bodies%acceleration, bodies%angular_acceleration, contacts, c)
         limit = self%coefficient*contacts%normal_force(c)
         spring = memory%column(at_tangential)%value(contacts%pair(c)) - self%stiffness*mean*dt
         spring = max(-limit, min(limit, spring))
         memory%column(at_tangential)%value(contacts%pair(c)) = spring
         if (self%damping > 0.0_wp) then
            spring = spring - self%damping*sqrt(self%stiffness/tangential_mobility(bodies, contacts, c))*slip
            spring = max(-limit, min(limit, spring))
         end if
         contacts%tangential_force(c) = contacts%tangential_force(c) + spring
      end do
      !$omp end parallel do
   end subroutine add

   !> Velocity (or acceleration) of the first body against the second at the force point, along (-direction_y,
   !> direction_x) [m/s]; that of the rotating arm itself has no place in the extension of the spring
   pure real(wp) function slip_of(velocity, angular_velocity, contacts, c)
      !> Of all bodies, (2, body) [m/s] and (body) [rad/s]
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
