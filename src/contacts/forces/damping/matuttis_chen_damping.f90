!> Normal damping of the programs that accompany Matuttis & Chen 2014: backward difference of the area, with limits.
!>
!> Eq. 7.13: F = gamma sqrt(m_eff E) (A - A_old)/(l dt), where A_old is 0 in the first step of a contact. On approach F
!> is at most four times the elastic force (p. 227). The sum with the elastic force is never attractive (p. 277). This
!> law is for comparison; `rate_damping` is the same law without the artefacts of the difference.
module polydem_matuttis_chen_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_kinds, only: ip, wp
   use polydem_normal_damping, only: normal_damping_t
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: matuttis_chen_damping_t

   !> Damping by the backward difference of the area
   type, extends(normal_damping_t) :: matuttis_chen_damping_t
   contains
      procedure :: configure
      procedure :: add
   end type matuttis_chen_damping_t

   !> Greatest damping on approach, as a multiple of the elastic force
   real(wp), parameter :: approach_limit = 4.0_wp

contains

   !> Copy the parameters from the settings. The contact history is the overlap area of the last step.
   subroutine configure(self, settings, pairs)
      class(matuttis_chen_damping_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      call self%take_coefficients(settings, pairs)
      self%history_kinds = [history_kind_t('area', 'm2', 'overlap area at the last step', zero_is_new=.true.)]
   end subroutine configure

   !> Add the damping force, and store the areas.
   subroutine add(self, bodies, dt, block, history)
      class(matuttis_chen_damping_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s]; 0: the rate is unknown, and there is no damping
      real(wp), intent(in) :: dt
      !> Contacts; `normal_force` changes
      type(contact_block_t), intent(inout) :: block
      !> Contact history; the area is read and set
      type(contact_history_t), intent(inout) :: history
      real(wp) :: difference, force(block_size)
      integer(ip) :: c

      associate (unused_bodies => bodies, area => history%column(self%first_column)%value)
         do c = 1_ip, block%n
            difference = 0.0_wp
            if (dt > 0.0_wp) then
               difference = self%coefficient%one*sqrt(self%stiffness/block%mobility(c))*block%inverse_length(c) &
                  *((block%area(c) - area(block%pair(c)))/dt)
            end if
            force(c) = difference
            area(block%pair(c)) = block%area(c)
         end do
      end associate
      call self%coefficient%scale(block%n, block%material, force)
      if (dt > 0.0_wp) then
         do c = 1_ip, block%n
            force(c) = min(force(c), approach_limit*block%elastic(c))
         end do
      end if
      call self%add_limited(force, block)
      if (.not. self%fills_dashpots) return
      call self%find_dashpots(block, block%dashpot)
      call self%coefficient%scale(block%n, block%material, block%dashpot)
   end subroutine add

end module polydem_matuttis_chen_damping
