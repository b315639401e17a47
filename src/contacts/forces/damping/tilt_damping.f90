!> Damping of tilts: normal damping acts along the whole contact, as a bed of dashpots.
!>
!> A dashpot d on the normal velocity that is spread evenly over the contact length L has the second moment d L^2/12: it
!> resists a tilt of the two faces with the torque T = -d L^2/12 (w1 - w2) on the first body, and the opposite on the
!> second (K.L. Johnson, Contact Mechanics, Cambridge 1985, Sec. 4.3, for springs). The rate of the area does not change
!> to first order when a face tilts about its middle, so without this torque a body rocks on a face for very long. The
!> contact of two corners has no length and rolls freely.
!>
!> The torque shifts the line of the normal force by at most L/2, because the corresponding pressures do not pull. A
!> contact without pressure has no such torque.
module polydem_tilt_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: contact_block_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_contact_history, only: contact_history_t
   use polydem_force_part, only: force_part_t, stage_last
   use polydem_kinds, only: ip, wp
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: tilt_damping_t

   !> Damping of tilts
   type, extends(force_part_t) :: tilt_damping_t
      !> Torque relative to that of an even bed of dashpots
      real(wp) :: share = 0.0_wp
   contains
      procedure :: configure
      procedure :: add
      procedure :: stiffen
   end type tilt_damping_t

contains

   !> Copy the parameters from the settings.
   subroutine configure(self, settings, pairs)
      class(tilt_damping_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      associate (unused_pairs => pairs)
      end associate
      self%stage = stage_last
      self%needs_couple = .true.
      self%damps_tilts = .true.
      self%share = settings%tilt_damping
   end subroutine configure

   !> Add the torque; the normal forces must be complete.
   subroutine add(self, bodies, dt, block, history)
      class(tilt_damping_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts with their dashpots; `couple` changes
      type(contact_block_t), intent(inout) :: block
      type(contact_history_t), intent(inout) :: history
      real(wp) :: limit, torque
      integer(ip) :: c

      associate (unused_bodies => bodies, unused_dt => dt, unused_history => history)
      end associate
      do c = 1_ip, block%n
         torque = -(self%share/12.0_wp)*block%dashpot(c)*block%length(c)**2 &
            *(block%angular_velocity(c, 1) - block%angular_velocity(c, 2))
         limit = 0.5_wp*block%length(c)*max(0.0_wp, block%normal_force(c))
         block%couple(c) = block%couple(c) + max(-limit, min(limit, torque))
      end do
   end subroutine add

   !> Add the dashpot against tilts.
   subroutine stiffen(self, element)
      class(tilt_damping_t), intent(in) :: self
      !> The contact with its normal dashpot; the dashpot against tilts changes
      type(linearised_contact_t), intent(inout) :: element

      element%tilt_dashpot = element%tilt_dashpot &
         + self%share*element%normal_dashpot*element%length**2/12.0_wp
   end subroutine stiffen

end module polydem_tilt_damping
