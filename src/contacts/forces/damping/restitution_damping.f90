!> Normal damping for a given restitution: F = 2 zeta sqrt(m_eff k) v_n, where k = E L/l is the present stiffness of the
!> contact and v_n = (dA/dt)/L. The effective mass m_eff is that of the contact point: 1/m_eff is the sum of 1/m + r^2/I
!> over both bodies, r being the lever of the normal force. Several contacts between the same two bodies are damped
!> together (`polydem_shared_dashpots`).
!>
!> A flat contact has a constant k. It is a damped spring that is released when its force vanishes (no attraction). Its
!> restitution depends on the damping ratio zeta alone (T. Schwager & T. Poeschel, Granular Matter 9 (2007) 465):
!>
!>     e = exp(-2 zeta acos(zeta)/sqrt(1 - zeta^2))       zeta < 1
!>     e = exp(-2 zeta acosh(zeta)/sqrt(zeta^2 - 1))      zeta > 1
!>
!> It does not depend on the sizes and masses of the two bodies. With the conservative law every central contact has
!> this restitution: F = K A A' and k = K A'^2 with A' = dA/dd, so dv/dA is the same function of A and v for any A(d).
!> With the area law, contacts that are not flat have another restitution. It does not depend on the speed either,
!> because k follows the depth (Y. Tsuji, T. Tanaka & T. Ishida, Powder Technol. 71 (1992) 239). Eccentric impacts
!> without friction have the same restitution at the contact point. Friction changes the mass against approach.
module polydem_restitution_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_history, only: contact_history_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_elementary, only: arc_cosine, exponential, logarithm
   use polydem_kinds, only: ip, wp
   use polydem_normal_damping, only: find_reaches, normal_damping_t
   use polydem_pair_entries, only: at_restitution
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: restitution_damping_t, restitution_of, damping_ratio_of

   !> Damping with a given restitution; the coefficient is the damping ratio zeta
   type, extends(normal_damping_t) :: restitution_damping_t
   contains
      procedure :: configure
      procedure :: add
      procedure :: stiffen
   end type restitution_damping_t

   !> Least normal force over the elastic one that friction is compared with: rounding of friction is no friction when a
   !> contact opens
   real(wp), parameter :: least_load = 0.1_wp
   !> Above this restitution damping is weak
   real(wp), parameter :: weak_restitution = 0.75_wp

contains

   !> Copy the parameters from the settings.
   subroutine configure(self, settings, pairs)
      class(restitution_damping_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      call self%take_coefficients(settings, pairs)
      self%needs_shares = .true.
      self%logged = [at_restitution]
      self%coefficient = pairs%restitution
      if (allocated(pairs%restitution%factor)) then
         self%coefficient%factor = damping_ratio_of(pairs%restitution%factor)
      else
         self%coefficient%one = damping_ratio_of(pairs%restitution%one)
      end if
      self%dissipates = self%coefficient%greatest() > 0.0_wp
      self%is_weak = pairs%restitution%greatest() > weak_restitution
   end subroutine configure

   !> Add the damping forces of one block of contacts.
   subroutine add(self, bodies, dt, block, history)
      class(restitution_damping_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts; `normal_force` changes
      type(contact_block_t), intent(inout) :: block
      !> Contact history; the force of friction is read
      type(contact_history_t), intent(inout) :: history
      real(wp) :: reach(block_size), mobility(block_size), force(block_size), factor
      integer(ip) :: c

      associate (unused_bodies => bodies, unused_dt => dt)
      end associate
      call find_reaches(block, reach)
      call find_mobilities(block, reach, mobility)
      factor = 2.0_wp*self%coefficient%one
      if (self%friction_column > 0) &
         call include_friction(self%stiffness, factor, block, reach, history%column(self%friction_column)%value, &
                               mobility)
      do c = 1_ip, block%n
         force(c) = factor*merge(block%shared_force(c), &
            sqrt(self%stiffness*block%inverse_length(c)/(reach(c)*mobility(c)))*block%rate(c), &
            block%shared_dashpot(c) > 0.0_wp)
      end do
      call self%coefficient%scale(block%n, block%material, force)
      call self%add_limited(force, block)
      if (.not. self%fills_dashpots) return
      do c = 1_ip, block%n
         block%dashpot(c) = factor*(block%length(c)/reach(c))*merge(block%shared_dashpot(c), &
            sqrt(self%stiffness*reach(c)*block%inverse_length(c)/mobility(c)), block%shared_dashpot(c) > 0.0_wp)
      end do
      call self%coefficient%scale(block%n, block%material, block%dashpot)
   end subroutine add

   !> Mobility of the point of each contact along its normal: 1/m + r^2/I of both bodies, r being the lever of the force
   !> [m/kg]
   pure subroutine find_mobilities(block, reach, mobility)
      type(contact_block_t), intent(in) :: block
      !> Lengths by which the gradients of the areas are divided [m]
      real(wp), intent(in) :: reach(block_size)
      real(wp), intent(inout) :: mobility(block_size)
      real(wp) :: first, second
      integer(ip) :: c

      do c = 1_ip, block%n
         first = block%moment(c, 1)/reach(c)
         second = block%moment(c, 2)/reach(c)
         mobility(c) = block%mobility(c) &
            + (first*first*block%inverse_inertia(c, 1) + second*second*block%inverse_inertia(c, 2))
      end do
   end subroutine find_mobilities

   !> Add to the mobilities what friction does to the approach: its force of the last step over the present normal
   !> force, times the mobility between the directions of both.
   pure subroutine include_friction(stiffness, factor, block, reach, friction, mobility)
      !> Stiffness E of the law [N/m2], and 2 zeta
      real(wp), intent(in) :: stiffness, factor
      type(contact_block_t), intent(in) :: block
      real(wp), intent(in) :: reach(block_size)
      !> Force of friction on the first body at the last step, (pair) [N/m]
      real(wp), intent(in), contiguous :: friction(:)
      real(wp), intent(inout) :: mobility(block_size)
      real(wp) :: cross, first, second, load
      integer(ip) :: c

      do c = 1_ip, block%n
         first = block%direction(c, 1)*block%arm_first(c, 1) + block%direction(c, 2)*block%arm_first(c, 2)
         second = block%direction(c, 1)*block%arm_second(c, 1) + block%direction(c, 2)*block%arm_second(c, 2)
         cross = (block%moment(c, 1)*first*block%inverse_inertia(c, 1) &
                  + block%moment(c, 2)*second*block%inverse_inertia(c, 2))/reach(c)
         load = max(least_load*block%elastic(c), block%elastic(c) + factor* &
                    sqrt(stiffness*block%inverse_length(c)/(reach(c)*mobility(c)))*block%rate(c))
         cross = friction(block%pair(c))*cross/max(load, tiny(load))
         mobility(c) = max(0.5_wp*mobility(c), min(2.0_wp*mobility(c), mobility(c) - cross))
      end do
   end subroutine include_friction

   !> Add the dashpot 2 zeta sqrt(m k).
   subroutine stiffen(self, element)
      class(restitution_damping_t), intent(in) :: self
      !> The contact; its normal dashpot changes
      type(linearised_contact_t), intent(inout) :: element

      element%normal_dashpot = element%normal_dashpot &
         + 2.0_wp*self%coefficient%of(element%materials)*sqrt(element%normal_mass*self%stiffness) &
         *sqrt(element%ratio)
   end subroutine stiffen

   !> Restitution of a damped spring that is released when its force vanishes
   elemental real(wp) function restitution_of(ratio) result(restitution)
      !> Damping ratio zeta, not negative
      real(wp), intent(in) :: ratio
      real(wp) :: root

      root = sqrt(abs((1.0_wp - ratio)*(1.0_wp + ratio)))
      if (ratio < 1.0_wp) then
         restitution = exponential(-2.0_wp*ratio*arc_cosine(ratio)/root)
      else if (ratio > 1.0_wp) then
         restitution = exponential(-2.0_wp*ratio*logarithm(ratio + root)/root)
      else
         restitution = exponential(-2.0_wp)
      end if
   end function restitution_of

   !> Damping ratio of a damped spring with a given restitution; exactly 0 for the restitution 1
   elemental real(wp) function damping_ratio_of(restitution) result(ratio)
      !> Restitution, above 0, at most 1
      real(wp), intent(in) :: restitution
      real(wp) :: low, high
      integer :: k

      ratio = 0.0_wp
      if (restitution >= 1.0_wp) return
      low = 0.0_wp
      high = 1.0_wp/sqrt(restitution)
      do k = 1, digits(ratio) + 8
         ratio = 0.5_wp*(low + high)
         if (restitution_of(ratio) > restitution) then
            low = ratio
         else
            high = ratio
         end if
      end do
   end function damping_ratio_of

end module polydem_restitution_damping
