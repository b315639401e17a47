!> Normal damping in proportion to the elastic force: F = F_el (1 + a v_n), a = gamma sqrt(m_eff/E)/l.
!>
!> K.H. Hunt & F.R.E. Crossley, J. Appl. Mech. 42 (1975) 440, with v_n = (dA/dt)/L, so that the loss is never negative.
!> It vanishes with the overlap: nothing jumps when bodies touch, and restitution converges with the second order of
!> the step. Slow impacts lose less: with u = a v before and e the restitution, u - ln(1 + u) = -e u - ln(1 - e u),
!> e = 1 - 2u/3 + ...
module polydem_hunt_crossley
   use polydem_bodies, only: bodies_t
   use polydem_contact_element, only: contact_element_t
   use polydem_contact_history, only: contact_history_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp
   use polydem_normal_damping, only: block_size, normal_damping_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: hunt_crossley_t

   !> Damping in proportion to the elastic force
   type, extends(normal_damping_t) :: hunt_crossley_t
   contains
      procedure :: choose
      procedure :: find_forces
      procedure :: stiffen
   end type hunt_crossley_t

contains

   !> It is the damping 'hunt_crossley'.
   subroutine choose(self, settings, chosen)
      class(hunt_crossley_t), intent(inout) :: self
      !> Group &forces
      type(forces_settings_t), intent(in) :: settings
      !> Whether it belongs to the law
      logical, intent(out) :: chosen

      chosen = settings%damping == 'hunt_crossley'
      if (.not. chosen) return
      self%name = 'Hunt-Crossley damping'
      call self%take_coefficients(settings)
   end subroutine choose

   !> Find the damping of some contacts.
   subroutine find_forces(self, bodies, dt, contacts, history, low, high, force)
      class(hunt_crossley_t), intent(in) :: self
      !> Bodies, for their masses
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s] (not used)
      real(wp), intent(in) :: dt
      !> Contacts with their elastic forces
      type(contacts_t), intent(in) :: contacts
      !> Memory of the pairs (not used)
      type(contact_history_t), intent(inout) :: history
      !> First and last of the contacts
      integer(ip), intent(in) :: low, high
      !> Damping of contact c at c - low + 1 [N/m]
      real(wp), intent(inout) :: force(block_size)
      real(wp) :: mobility, share
      integer(ip) :: c

      associate (unused_dt => dt, unused_memory => history)
      end associate
      do c = low, high
         mobility = bodies%inverse_mass(contacts%first(c)) + bodies%inverse_mass(contacts%second(c))
         ! Bars that nearly cross turn without approach: L is not taken shorter than the side of a square of the area.
         share = self%coefficient*sqrt(1.0_wp/(mobility*self%stiffness))*contacts%inverse_length(c) &
            *(contacts%rate(c)/max(contacts%length(c), sqrt(contacts%area(c))))
         force(c - low + 1_ip) = contacts%elastic(c)*share
      end do
   end subroutine find_forces

   !> Both the stiffness and the dashpot follow the force of the moment; before there is one there is neither.
   subroutine stiffen(self, bodies, contacts, element)
      class(hunt_crossley_t), intent(in) :: self
      !> Bodies (not used)
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> The contact; normal stiffness and dashpot change
      type(contact_element_t), intent(inout) :: element
      real(wp) :: force

      associate (unused_bodies => bodies)
      end associate
      if (element%contact == 0_ip) return
      associate (c => element%contact)
         force = contacts%normal_force(c)
         if (contacts%has_cohesion) force = force - contacts%cohesion(c)
         if (force > contacts%elastic(c)) &
            element%normal_stiffness = element%normal_stiffness*(force/contacts%elastic(c))
         element%normal_dashpot = element%normal_dashpot &
            + self%coefficient*sqrt(1.0_wp/(element%normal_mobility*self%stiffness))*contacts%elastic(c)*element%ratio &
            /max(contacts%length(c), sqrt(contacts%area(c)))
      end associate
   end subroutine stiffen

end module polydem_hunt_crossley
