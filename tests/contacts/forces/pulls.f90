!> Two attractive parts of a force law for tests, one with and one without potential energy.
module pulls
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: contact_block_t
   use polydem_contact_history, only: contact_history_t
   use polydem_force_part, only: force_part_t, stage_normal
   use polydem_kinds, only: ip, wp
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: cohesion_t, drag_t

   !> A constant attraction; its work is that of elastic forces
   type, extends(force_part_t) :: cohesion_t
      !> Attraction [N/m]
      real(wp) :: pull = 0.0_wp
   contains
      procedure :: configure => configure_cohesion
      procedure :: add => add_cohesion
   end type cohesion_t

   !> A constant force against separation; its work is that of damping
   type, extends(force_part_t) :: drag_t
      !> Attraction [N/m]
      real(wp) :: pull = 0.0_wp
   contains
      procedure :: configure => configure_drag
      procedure :: add => add_drag
   end type drag_t

contains

   !> Set name and stage.
   subroutine configure_cohesion(self, settings, pairs)
      class(cohesion_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      associate (unused => settings, unused_pairs => pairs)
      end associate
      self%name = 'cohesion'
      self%stage = stage_normal
      self%needs_cohesion = .true.
   end subroutine configure_cohesion

   !> Add the attraction.
   subroutine add_cohesion(self, bodies, dt, block, history)
      class(cohesion_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      type(contact_block_t), intent(inout) :: block
      type(contact_history_t), intent(inout) :: history
      integer(ip) :: c

      associate (unused_bodies => bodies, unused_dt => dt, unused_memory => history)
      end associate
      do c = 1_ip, block%n
         block%cohesion(c, :2) = block%cohesion(c, :2) - self%pull*block%direction(c, :)
      end do
   end subroutine add_cohesion

   !> Set name and stage.
   subroutine configure_drag(self, settings, pairs)
      class(drag_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      associate (unused => settings, unused_pairs => pairs)
      end associate
      self%name = 'drag'
      self%stage = stage_normal
   end subroutine configure_drag

   !> Add the attraction.
   subroutine add_drag(self, bodies, dt, block, history)
      class(drag_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      type(contact_block_t), intent(inout) :: block
      type(contact_history_t), intent(inout) :: history
      integer(ip) :: c

      associate (unused_bodies => bodies, unused_dt => dt, unused_memory => history)
      end associate
      do c = 1_ip, block%n
         block%normal_force(c) = block%normal_force(c) - self%pull
      end do
   end subroutine add_drag

end module pulls
