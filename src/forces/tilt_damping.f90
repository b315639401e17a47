!> Damping of tilts: a torque T = -s sqrt(k I_eff) (w1 - w2) on the first body, the opposite on the second.
!>
!> A face is a bed of springs: besides E L/l against approach it has the stiffness k = E L/l L^2/12 against tilts
!> (K.L. Johnson, Contact Mechanics, Cambridge 1985, Sec. 4.3). Normal damping follows the rate of the area, which tilts
!> about the middle of the face do not change to first order, and friction feels them only where bodies slip; so stacks
!> and walls bend to and fro for very long. A bed of dashpots damps tilts as well, and this torque is its second moment.
!> I_eff = 1/(1/I1 + 1/I2); s = 2 damps the tilt of two bodies critically. Corners, of length 0, roll freely.
!>
!> The torque never moves the normal force beyond half of L from its line: the pressures it stands for do not pull. So a
!> contact under tension has none.
module polydem_tilt_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_element, only: contact_element_t, face_tilt_stiffness
   use polydem_contact_history, only: contact_history_t
   use polydem_contacts, only: contacts_t
   use polydem_force_part, only: acts_last, force_part_t
   use polydem_kinds, only: ip, wp, min_parallel_size
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
      procedure :: choose
      procedure :: add
      procedure :: stiffen
   end type tilt_damping_t

contains

   !> It is chosen by a share above 0.
   subroutine choose(self, settings, chosen)
      class(tilt_damping_t), intent(inout) :: self
      !> Group &forces
      type(forces_settings_t), intent(in) :: settings
      !> Whether it belongs to the law
      logical, intent(out) :: chosen

      chosen = settings%tilt_damping > 0.0_wp
      if (.not. chosen) return
      self%name = 'damping of tilts'
      self%stage = acts_last
      self%needs_twist = .true.
      self%stiffness = settings%stiffness
      self%share = settings%tilt_damping
   end subroutine choose

   !> Add the torque; the normal forces must be complete.
   subroutine add(self, bodies, dt, contacts, history)
      class(tilt_damping_t), intent(in) :: self
      !> Bodies, for their moments of inertia
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s] (not used)
      real(wp), intent(in) :: dt
      !> Contacts; `twist` changes
      type(contacts_t), intent(inout) :: contacts
      !> Memory of the pairs (not used)
      type(contact_history_t), intent(inout) :: history
      real(wp) :: mobility, limit, torque
      integer(ip) :: c

      associate (unused_dt => dt, unused_memory => history)
      end associate
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, bodies, contacts) private(c, mobility, limit, torque)
      do c = 1_ip, contacts%n
         associate (i => contacts%first(c), j => contacts%second(c))
            mobility = bodies%inverse_inertia(i) + bodies%inverse_inertia(j)
            torque = -self%share*sqrt(face_tilt_stiffness(self%stiffness, contacts, c)/mobility) &
               *(bodies%angular_velocity(i) - bodies%angular_velocity(j))
         end associate
         limit = 0.5_wp*contacts%length(c)*max(0.0_wp, contacts%normal_force(c))
         contacts%twist(c) = contacts%twist(c) + max(-limit, min(limit, torque))
      end do
      !$omp end parallel do
   end subroutine add

   !> Add the dashpot s sqrt(k I_eff).
   subroutine stiffen(self, bodies, contacts, element)
      class(tilt_damping_t), intent(in) :: self
      !> Bodies, for the inertia of the one whose contact is only expected
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their lengths
      type(contacts_t), intent(in) :: contacts
      !> The contact; its dashpot against tilts changes
      type(contact_element_t), intent(inout) :: element
      real(wp) :: square

      if (element%contact > 0_ip) then
         square = face_tilt_stiffness(self%stiffness, contacts, element%contact)/element%rotational_mobility
      else
         ! No edge is longer than two greatest radii; one of the two bodies against which it tilts may be fixed.
         square = element%normal_stiffness*element%radius_square/3.0_wp*bodies%inertia(element%body)
      end if
      element%tilt_dashpot = element%tilt_dashpot + self%share*sqrt(square)
   end subroutine stiffen

end module polydem_tilt_damping
