!> Normal damping for a given restitution: F = 2 zeta sqrt(m_eff k) v_n, where k = E L/l is the present stiffness of the
!> contact and v_n = (dA/dt)/L.
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
!> because k follows the depth (Y. Tsuji, T. Tanaka & T. Ishida, Powder Technol. 71 (1992) 239). The effective mass is
!> that of a central impact; eccentric impacts lose more energy.
module polydem_restitution_damping
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_elementary, only: arc_cosine, exponential, logarithm
   use polydem_kinds, only: ip, wp
   use polydem_normal_damping, only: find_reaches, normal_damping_t
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: restitution_damping_t, restitution_of, damping_ratio_of

   !> Damping with a given restitution; the coefficient is the damping ratio zeta
   type, extends(normal_damping_t) :: restitution_damping_t
   contains
      procedure :: configure
      procedure :: find_forces
      procedure :: find_dashpots
      procedure :: stiffen
   end type restitution_damping_t

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
      self%coefficient = pairs%restitution
      if (allocated(pairs%restitution%factor)) then
         self%coefficient%factor = damping_ratio_of(pairs%restitution%factor)
      else
         self%coefficient%one = damping_ratio_of(pairs%restitution%one)
      end if
      self%dissipates = self%coefficient%greatest() > 0.0_wp
      self%is_weak = pairs%restitution%greatest() > weak_restitution
   end subroutine configure

   !> Compute the damping forces of one block of contacts.
   subroutine find_forces(self, block, force)
      class(restitution_damping_t), intent(in) :: self
      type(contact_block_t), intent(in) :: block
      real(wp), intent(inout) :: force(block_size)
      real(wp) :: reach(block_size)
      integer(ip) :: c

      call find_reaches(block, reach)
      do c = 1_ip, block%n
         force(c) = 2.0_wp*self%coefficient%one*sqrt(self%stiffness/block%mobility(c)) &
            *sqrt(block%inverse_length(c)/reach(c))*block%rate(c)*block%share_root(c)
      end do
   end subroutine find_forces

   !> Find the dashpots 2 zeta sqrt(m k) of one block of contacts.
   subroutine find_dashpots(self, block, dashpot)
      class(restitution_damping_t), intent(in) :: self
      type(contact_block_t), intent(in) :: block
      real(wp), intent(inout) :: dashpot(block_size)
      real(wp) :: reach(block_size)
      integer(ip) :: c

      call find_reaches(block, reach)
      do c = 1_ip, block%n
         dashpot(c) = 2.0_wp*self%coefficient%one*sqrt(self%stiffness/block%mobility(c)) &
            *sqrt(block%inverse_length(c)/reach(c))*(block%length(c)*block%share_root(c))
      end do
   end subroutine find_dashpots

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
