!> Friction by a tangential spring with a Coulomb limit.
!>
!> P.A. Cundall & O.D.L. Strack, Geotechnique 29 (1979) 47, in the form of Matuttis & Chen 2014, Sec. 3.4.1. The spring
!> force changes by -k_t v_t dt and is limited to mu F_n. So is its sum with the dashpot force -d sqrt(k_t m_t) v_t,
!> 1/m_t = 1/m1 + 1/m2 + r1^2/I1 + r2^2/I2 (p. 144). The contact history stores the limited spring force.
!>
!> Coulomb's limit applies to the pressure of a contact, the normal force without cohesion. A contact without pressure
!> has no friction, and its spring force is reset to zero.
!>
!> With v_t at the end of the step, as in Matuttis & Chen, the spring is of first order in the step with any integration
!> scheme, and an undamped spring is unstable for w dt > 1.41. With v_t in the middle of the step its extension follows
!> the positions: it is of second order, and stable up to w dt = 2 with velocity Verlet.
module polydem_cundall_strack
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_force_part, only: force_part_t, stage_last
   use polydem_kinds, only: ip, wp
   use polydem_pair_entries, only: at_friction_coefficient
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_pair_value, only: pair_value_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: cundall_strack_t

   !> Friction by a tangential spring
   type, extends(force_part_t) :: cundall_strack_t
      !> Friction coefficient mu
      type(pair_value_t) :: coefficient
      !> Its common factor in the settings
      real(wp) :: full_coefficient = 0.0_wp
      !> Stiffness of the spring k_t [N/m2], and the square roots of its factors
      type(pair_value_t) :: stiffness, root_factor
      !> Dashpot as a share d of sqrt(k_t m_t)
      real(wp) :: damping = 0.0_wp
      !> Whether the spring uses the slip velocity in the middle of the step instead of that at its end
      logical :: midstep = .false.
   contains
      procedure :: configure
      procedure :: scale_friction
      procedure :: add
      procedure :: stiffen
   end type cundall_strack_t

contains

   !> Copy the parameters from the settings. The contact history is the spring force.
   subroutine configure(self, settings, pairs)
      class(cundall_strack_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      self%stage = stage_last
      self%logged = [at_friction_coefficient]
      self%coefficient = pairs%friction_coefficient
      self%full_coefficient = self%coefficient%one
      self%stiffness = pairs%tangential_stiffness
      self%root_factor = self%stiffness
      if (allocated(self%stiffness%factor)) self%root_factor%factor = sqrt(self%stiffness%factor)
      self%damping = settings%tangential_damping
      self%midstep = settings%midstep_slip
      self%needs_accelerations = self%midstep
      self%history_kinds = [history_kind_t('tangential', 'N/m', 'force of the tangential spring')]
   end subroutine configure

   !> Scale the friction coefficient.
   subroutine scale_friction(self, factor)
      class(cundall_strack_t), intent(inout) :: self
      real(wp), intent(in) :: factor

      self%coefficient%one = factor*self%full_coefficient
   end subroutine scale_friction

   !> Add the tangential force and store the spring force.
   subroutine add(self, bodies, dt, block, history)
      class(cundall_strack_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts; `tangential_force` changes
      type(contact_block_t), intent(inout) :: block
      !> Contact history; the spring force is read and set
      type(contact_history_t), intent(inout) :: history
      real(wp) :: load(block_size)

      if (allocated(self%coefficient%factor)) then
         load(:block%n) = block%normal_force(:block%n)
         call self%coefficient%scale(block%n, block%material, load)
         call add_limited(self, bodies, dt, load, block, history)
      else
         call add_limited(self, bodies, dt, block%normal_force, block, history)
      end if
   end subroutine add

   !> Add the tangential force for given loads.
   subroutine add_limited(self, bodies, dt, load, block, history)
      class(cundall_strack_t), intent(in) :: self
      !> Bodies, for their masses and velocities
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Normal force of each contact without cohesion, times the factor of its friction coefficient [N/m]
      real(wp), intent(in) :: load(block_size)
      type(contact_block_t), intent(inout) :: block
      type(contact_history_t), intent(inout) :: history
      real(wp) :: slip(block_size), mean(block_size), spring(block_size), root(block_size), limit
      integer(ip) :: c

      call find_slip(block, slip)
      associate (stored => history%column(self%first_column)%value)
         if (self%midstep) then
            call find_midstep_slip(bodies%n, bodies%acceleration, bodies%angular_acceleration, dt, block, slip, mean)
            call self%stiffness%scale(block%n, block%material, mean)
            call stretch(self, dt, block, load, mean, stored, spring)
         else if (allocated(self%stiffness%factor)) then
            mean(:block%n) = slip(:block%n)
            call self%stiffness%scale(block%n, block%material, mean)
            call stretch(self, dt, block, load, mean, stored, spring)
         else
            call stretch(self, dt, block, load, slip, stored, spring)
         end if
      end associate
      if (self%damping > 0.0_wp) then
         call find_dashpots(self, block, root)
         call self%root_factor%scale(block%n, block%material, root)
         do c = 1_ip, block%n
            limit = self%coefficient%one*max(0.0_wp, load(c))
            spring(c) = max(-limit, min(limit, spring(c) - root(c)*slip(c)))
         end do
      end if
      do c = 1_ip, block%n
         block%tangential_force(c) = block%tangential_force(c) + spring(c)
      end do
   end subroutine add_limited

   !> Change the spring forces by the slip of a step, up to Coulomb's limit, and store them.
   pure subroutine stretch(self, dt, block, load, slip, stored, spring)
      class(cundall_strack_t), intent(in) :: self
      real(wp), intent(in) :: dt
      type(contact_block_t), intent(in) :: block
      !> Normal forces times factors of the friction coefficient [N/m], and slip velocities times those of the stiffness
      real(wp), intent(in) :: load(block_size), slip(block_size)
      !> Spring forces of all pairs
      real(wp), intent(inout) :: stored(:)
      !> Spring forces of the block [N/m]
      real(wp), intent(inout) :: spring(block_size)
      real(wp) :: limit
      integer(ip) :: c

      do c = 1_ip, block%n
         spring(c) = stored(block%pair(c))
      end do
      do c = 1_ip, block%n
         limit = self%coefficient%one*max(0.0_wp, load(c))
         spring(c) = max(-limit, min(limit, spring(c) - self%stiffness%one*slip(c)*dt))
      end do
      do c = 1_ip, block%n
         stored(block%pair(c)) = spring(c)
      end do
   end subroutine stretch

   !> Add the spring and its dashpot.
   subroutine stiffen(self, element)
      class(cundall_strack_t), intent(in) :: self
      !> The contact; tangential stiffness and dashpot change
      type(linearised_contact_t), intent(inout) :: element

      element%tangential_stiffness = element%tangential_stiffness + self%stiffness%of(element%materials)
      element%tangential_dashpot = element%tangential_dashpot &
         + self%damping*sqrt(element%tangential_mass*self%stiffness%of(element%materials))
   end subroutine stiffen

   !> Find the velocity of the first body relative to the second at the force point, along (-direction_y, direction_x)
   !> [m/s].
   pure subroutine find_slip(block, slip)
      type(contact_block_t), intent(in) :: block
      real(wp), intent(inout) :: slip(block_size)
      real(wp) :: vx, vy
      integer(ip) :: c

      do c = 1_ip, block%n
         vx = (block%velocity_first(c, 1) - block%angular_velocity(c, 1)*block%arm_first(c, 2)) &
            - (block%velocity_second(c, 1) - block%angular_velocity(c, 2)*block%arm_second(c, 2))
         vy = (block%velocity_first(c, 2) + block%angular_velocity(c, 1)*block%arm_first(c, 1)) &
            - (block%velocity_second(c, 2) + block%angular_velocity(c, 2)*block%arm_second(c, 1))
         slip(c) = block%direction(c, 1)*vy - block%direction(c, 2)*vx
      end do
   end subroutine find_slip

   !> Find the slip velocity in the middle of the step: half of its change in a step is subtracted. The centripetal
   !> acceleration of the arms does not extend the spring and is left out.
   pure subroutine find_midstep_slip(n, acceleration, angular_acceleration, dt, block, slip, mean)
      !> Number of bodies
      integer(ip), intent(in) :: n
      !> Their accelerations [m/s2] and angular accelerations [rad/s2]
      real(wp), intent(in) :: acceleration(2, n), angular_acceleration(n)
      real(wp), intent(in) :: dt
      type(contact_block_t), intent(in) :: block
      real(wp), intent(in) :: slip(block_size)
      real(wp), intent(inout) :: mean(block_size)
      real(wp) :: a(block_size, 2), b(block_size, 2), spin_a(block_size), spin_b(block_size), x, y
      integer(ip) :: c

      do c = 1_ip, block%n
         a(c, 1) = acceleration(1, block%first(c))
         a(c, 2) = acceleration(2, block%first(c))
         spin_a(c) = angular_acceleration(block%first(c))
         b(c, 1) = acceleration(1, block%second(c))
         b(c, 2) = acceleration(2, block%second(c))
         spin_b(c) = angular_acceleration(block%second(c))
      end do
      do c = 1_ip, block%n
         x = (a(c, 1) - spin_a(c)*block%arm_first(c, 2)) - (b(c, 1) - spin_b(c)*block%arm_second(c, 2))
         y = (a(c, 2) + spin_a(c)*block%arm_first(c, 1)) - (b(c, 2) + spin_b(c)*block%arm_second(c, 1))
         mean(c) = slip(c) - 0.5_wp*dt*(block%direction(c, 1)*y - block%direction(c, 2)*x)
      end do
   end subroutine find_midstep_slip

   !> Dashpots d sqrt(k_t m_t) of all contacts [N s/m2]
   pure subroutine find_dashpots(self, block, dashpot)
      class(cundall_strack_t), intent(in) :: self
      type(contact_block_t), intent(in) :: block
      real(wp), intent(inout) :: dashpot(block_size)
      real(wp) :: square_first, square_second, mobility
      integer(ip) :: c

      do c = 1_ip, block%n
         square_first = block%arm_first(c, 1)**2 + block%arm_first(c, 2)**2
         square_second = block%arm_second(c, 1)**2 + block%arm_second(c, 2)**2
         mobility = block%mobility(c) &
            + (square_first*block%inverse_inertia(c, 1) + square_second*block%inverse_inertia(c, 2))
         dashpot(c) = self%damping*sqrt(self%stiffness%one/mobility)
      end do
   end subroutine find_dashpots

end module polydem_cundall_strack
