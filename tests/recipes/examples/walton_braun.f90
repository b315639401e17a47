!> Normal damping by plastic indentation: unloading is stiffer than loading.
!>
!> Loading follows F = E A/l. Unloading from the greatest area A_max of the contact so far follows
!> F = E (A - gamma (A_max - A))/l until the force vanishes (O.R. Walton & R.L. Braun, J. Rheol. 30 (1986) 949). A flat
!> contact has the restitution 1/sqrt(1 + gamma) at any speed.
module polydem_walton_braun
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_kinds, only: ip, wp
   use polydem_normal_damping, only: normal_damping_t
   use polydem_pair_entries, only: at_plasticity
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: walton_braun_t

   !> Damping by plastic indentation
   type, extends(normal_damping_t) :: walton_braun_t
   contains
      procedure :: configure
      procedure :: add
      procedure :: stiffen
   end type walton_braun_t

contains

   !> Copy the parameters from the settings. The contact history is the greatest area.
   subroutine configure(self, settings, pairs)
      class(walton_braun_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      call self%take_coefficients(settings, pairs)
      self%logged = [at_plasticity]
      self%coefficient = pairs%plasticity
      self%history_kinds = [history_kind_t('greatest_area', 'm2', 'greatest area of the contact so far')]
   end subroutine configure

   !> Add the damping force. The base type limits its sum with the elastic force.
   subroutine add(self, bodies, dt, block, history)
      class(walton_braun_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts; `normal_force` changes
      type(contact_block_t), intent(inout) :: block
      !> Contact history; the greatest area is read and set
      type(contact_history_t), intent(inout) :: history
      real(wp) :: force(block_size)
      integer(ip) :: c, p

      associate (unused_bodies => bodies, unused_dt => dt, greatest => history%column(self%first_column)%value)
         do c = 1_ip, block%n
            p = block%pair(c)
            greatest(p) = max(greatest(p), block%area(c))
            force(c) = self%coefficient%one*self%stiffness*(block%area(c) - greatest(p))*block%inverse_length(c)
         end do
      end associate
      call self%coefficient%scale(block%n, block%material, force)
      call self%add_limited(force, block)
   end subroutine add

   !> Multiply the stiffness by 1 + gamma, that of unloading. There is no dashpot.
   subroutine stiffen(self, element)
      class(walton_braun_t), intent(in) :: self
      !> The contact; its normal stiffness changes
      type(linearised_contact_t), intent(inout) :: element

      element%normal_stiffness = (1.0_wp + self%coefficient%of(element%materials))*element%normal_stiffness
   end subroutine stiffen

end module polydem_walton_braun
