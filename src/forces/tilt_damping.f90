!> Damping of tilts: a torque T = -s sqrt(k I_eff) (w1 - w2) on the first body, the opposite on the second.
!>
!> A face is a bed of springs. Its stiffness is E L/l against approach and k = E L/l L^2/12 against tilts (K.L. Johnson,
!> Contact Mechanics, Cambridge 1985, Sec. 4.3). Normal damping follows the rate of the area, which does not change to
!> first order when a face tilts about its middle. Friction dissipates only where bodies slip. So without this part,
!> stacks and walls oscillate for very long. A bed of dashpots also damps tilts, and this torque is its second moment.
!> I_eff = 1/(1/I1 + 1/I2), and s = 2 is critical damping of the tilt of two bodies. Corners, of length 0, roll freely.
!>
!> The torque shifts the line of the normal force by at most L/2, because the corresponding pressures do not pull. A
!> contact under tension has no such torque.
module polydem_tilt_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: contact_block_t
   use polydem_contact_element, only: contact_element_t, face_tilt_stiffness
   use polydem_contact_history, only: contact_history_t
   use polydem_force_part, only: force_part_t, stage_last
   use polydem_kinds, only: ip, wp
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: tilt_damping_t

   !> Damping of tilts
   type, extends(force_part_t) :: tilt_damping_t
      !> Young's modulus in two dimensions E [N/m2]
      real(wp) :: stiffness = 0.0_wp
      !> Share s of sqrt(k I_eff)
      real(wp) :: share = 0.0_wp
   contains
      procedure :: configure
      procedure :: add
      procedure :: stiffen
   end type tilt_damping_t

contains

   !> Copy the parameters from the settings.
   subroutine configure(self, settings)
      class(tilt_damping_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings

      self%stage = stage_last
      self%needs_twist = .true.
      self%stiffness = settings%stiffness
      self%share = settings%tilt_damping
   end subroutine configure

   !> Add the torque; the normal forces must be complete.
   subroutine add(self, bodies, dt, block, history)
      class(tilt_damping_t), intent(in) :: self
      !> Bodies, for their moments of inertia
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts; `twist` changes
      type(contact_block_t), intent(inout) :: block
      type(contact_history_t), intent(inout) :: history
      real(wp) :: mobility, stiffness, limit, torque
      integer(ip) :: c

      associate (unused_dt => dt, unused_history => history)
      end associate
      do c = 1_ip, block%n
         ! The same as face_tilt_stiffness; calling a procedure of another file here costs 0.3 % of a step.
         stiffness = self%stiffness*block%length(c)**3*block%inverse_length(c)/12.0_wp
         associate (i => block%first(c), j => block%second(c))
            mobility = bodies%inverse_inertia(i) + bodies%inverse_inertia(j)
            torque = -self%share*sqrt(stiffness/mobility) &
               *(bodies%angular_velocity(i) - bodies%angular_velocity(j))
         end associate
         limit = 0.5_wp*block%length(c)*max(0.0_wp, block%normal_force(c))
         block%twist(c) = block%twist(c) + max(-limit, min(limit, torque))
      end do
   end subroutine add

   !> Add the dashpot s sqrt(k I_eff).
   subroutine stiffen(self, element)
      class(tilt_damping_t), intent(in) :: self
      !> The contact; the dashpot against tilts changes
      type(contact_element_t), intent(inout) :: element
      real(wp) :: square

      if (element%is_expected) then
         ! An upper bound: no edge is longer than twice the greatest radius, and the other body may be fixed.
         square = element%normal_stiffness*element%radius_square/3.0_wp*element%inertia
      else
         square = face_tilt_stiffness(self%stiffness, element)/element%rotational_mobility
      end if
      element%tilt_dashpot = element%tilt_dashpot + self%share*sqrt(square)
   end subroutine stiffen

end module polydem_tilt_damping
