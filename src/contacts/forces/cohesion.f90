!> Cohesion: an attraction in proportion to the length of a contact, F = -c L.
!>
!> With the conservative law the length is |N|, N the gradient of the effective area G with respect to the position, and
!> the lever of the normal force is the moment of N. So the attraction has the potential -c G: the work on every
!> closed path is zero. Not so with the laws that divide by the length of the overlap: at corners they do work on closed
!> paths. With the area law it is as exact as that law is. A flat face of the width w holds the load c w. Two bodies
!> rest at the depth c l/E without a load, l being the characteristic length of the elastic force. Degenerate contacts,
!> which have no length, are not attracted.
!>
!> Friction and damping of tilts follow the pressure of the contact, the normal force without cohesion (as in S. Luding,
!> Granular Matter 10 (2008) 235): a contact that cohesion alone holds together has friction.
module polydem_cohesion
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_history, only: contact_history_t
   use polydem_force_part, only: force_part_t, stage_normal
   use polydem_kinds, only: ip, wp
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_pair_value, only: pair_value_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: cohesion_t

   !> Cohesion
   type, extends(force_part_t) :: cohesion_t
      !> Attraction per length c [N/m2]
      type(pair_value_t) :: strength
   contains
      procedure :: configure
      procedure :: add
   end type cohesion_t

contains

   !> Copy the parameters from the settings.
   subroutine configure(self, settings, pairs)
      class(cohesion_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      associate (unused => settings)
      end associate
      self%stage = stage_normal
      self%needs_cohesion = .true.
      self%cohesion_has_energy = .true.
      self%strength = pairs%cohesion
   end subroutine configure

   !> Add the attraction.
   subroutine add(self, bodies, dt, block, history)
      class(cohesion_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts; `cohesion` and `normal_force` change
      type(contact_block_t), intent(inout) :: block
      type(contact_history_t), intent(inout) :: history
      real(wp) :: pull(block_size)
      integer(ip) :: c

      associate (unused_bodies => bodies, unused_dt => dt, unused_history => history)
      end associate
      do c = 1_ip, block%n
         pull(c) = self%strength%one*block%length(c)*(1.0_wp - block%degenerate(c))
      end do
      call self%strength%scale(block%n, block%material, pull)
      do c = 1_ip, block%n
         block%cohesion(c) = block%cohesion(c) - pull(c)
         block%normal_force(c) = block%normal_force(c) - pull(c)
      end do
   end subroutine add

end module polydem_cohesion
