!> Weights the normal damping in the first step of a contact by the time since first touch.
!>
!> The force of a dashpot jumps from zero to gamma v at first touch. A force that is computed once per step acts for a
!> whole step, from half a step before to half a step after, even if the bodies meet late in the step. So the error of
!> restitution is of first order in the step. In its first step a contact has the age s = A/((dA/dt) dt), in steps, and
!> the dashpot should act for s + 1/2 steps. With this weight the error is of second order. The only cost is the stored
!> area. (This holds for faces, A ~ depth. At corners, A ~ depth^2, damping begins without a jump and needs no weight;
!> their weight, between 1/2 and 1, does not change the order.)
module polydem_damping_onset
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: contact_block_t
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_force_part, only: force_part_t, stage_on_damping
   use polydem_kinds, only: ip, wp
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: damping_onset_t

   !> Weight of the normal damping in the first step of a contact
   type, extends(force_part_t) :: damping_onset_t
   contains
      procedure :: configure
      procedure :: add
   end type damping_onset_t

contains

   !> There are no parameters. The contact history is the overlap area of the last step.
   subroutine configure(self, settings, pairs)
      class(damping_onset_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      associate (unused => settings, unused_pairs => pairs)
      end associate
      self%stage = stage_on_damping
      self%history_kinds = [history_kind_t('area', 'm2', 'overlap area at the last step', zero_is_new=.true.)]
   end subroutine configure

   !> Weight the damping of new contacts, limit the normal force to repulsion, and store the areas.
   subroutine add(self, bodies, dt, block, history)
      class(damping_onset_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s]; 0: no contact is new
      real(wp), intent(in) :: dt
      !> Contacts; `normal_force` changes
      type(contact_block_t), intent(inout) :: block
      !> Contact history; the area is read and set
      type(contact_history_t), intent(inout) :: history
      real(wp) :: growth, damping
      integer(ip) :: c

      associate (unused_bodies => bodies)
      end associate
      do c = 1_ip, block%n
         growth = block%rate(c)*dt
         if (history%column(self%first_column)%value(block%pair(c)) <= 0.0_wp .and. block%area(c) < growth) then
            damping = block%normal_force(c) - block%elastic(c)
            block%normal_force(c) = max(0.0_wp, block%elastic(c) + (block%area(c)/growth + 0.5_wp)*damping)
         end if
         history%column(self%first_column)%value(block%pair(c)) = block%area(c)
      end do
   end subroutine add

end module polydem_damping_onset
