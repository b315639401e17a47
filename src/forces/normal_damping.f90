!> Base type of normal dampings: the loop over the contacts, the limit of the force, and the dashpot of the stable step.
!>
!> Damping never makes a contact attractive: the sum of elastic and damping force is not negative (H.-G. Matuttis & J.
!> Chen, Understanding the Discrete Element Method, Wiley 2014, p. 277). An attraction by another part is not changed.
module polydem_normal_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_element, only: contact_element_t
   use polydem_contact_history, only: contact_history_t
   use polydem_contacts, only: contacts_t
   use polydem_force_part, only: force_part_t, stage_damping
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: normal_damping_t, block_size

   !> Largest number of contacts in one call of `find_forces`
   integer(ip), parameter :: block_size = 256_ip

   !> A normal damping
   type, abstract, extends(force_part_t) :: normal_damping_t
      !> Young's modulus in two dimensions E [N/m2]
      real(wp) :: stiffness = 0.0_wp
      !> Dimensionless damping coefficient gamma
      real(wp) :: coefficient = 0.0_wp
   contains
      !> Compute the damping forces of one block of contacts
      procedure(find_forces), deferred :: find_forces
      procedure :: add
      procedure :: stiffen
      procedure :: configure => take_coefficients
      procedure, non_overridable :: take_coefficients
   end type normal_damping_t

   abstract interface
      !> Compute the damping forces of one block of contacts, without a limit.
      subroutine find_forces(self, bodies, dt, contacts, history, low, high, force)
         import :: block_size, bodies_t, contact_history_t, contacts_t, ip, normal_damping_t, wp
         class(normal_damping_t), intent(in) :: self
         !> Bodies with the positions and velocities of this step
         type(bodies_t), intent(in) :: bodies
         !> Time since the last evaluation [s]; 0 at the start of a run
         real(wp), intent(in) :: dt
         !> Contacts of this step with their elastic forces
         type(contacts_t), intent(in) :: contacts
         !> Contact history; only the pairs of these contacts may change
         type(contact_history_t), intent(inout) :: history
         !> First and last contact of the block, at most `block_size` contacts
         integer(ip), intent(in) :: low, high
         !> Damping force of contact c at index c - low + 1, positive in repulsion [N/m]
         real(wp), intent(inout) :: force(block_size)
      end subroutine find_forces
   end interface

contains

   !> Add the damping force. Its sum with the elastic force is limited to repulsion.
   subroutine add(self, bodies, dt, contacts, history)
      class(normal_damping_t), intent(in) :: self
      !> Bodies, for their masses
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s]; 0 at the start of a run
      real(wp), intent(in) :: dt
      !> Contacts; `normal_force` changes
      type(contacts_t), intent(inout) :: contacts
      !> Contact history
      type(contact_history_t), intent(inout) :: history
      real(wp) :: force(block_size)
      integer(ip) :: c, low, high

      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, bodies, dt, contacts, history) private(c, low, high, force)
      do low = 1_ip, contacts%n, block_size
         high = min(low + block_size - 1_ip, contacts%n)
         call self%find_forces(bodies, dt, contacts, history, low, high, force)
         do c = low, high
            contacts%normal_force(c) = contacts%normal_force(c) + max(-contacts%elastic(c), force(c - low + 1_ip))
         end do
      end do
      !$omp end parallel do
   end subroutine add

   !> Add the dashpot gamma sqrt(m E) L/l.
   subroutine stiffen(self, bodies, contacts, element)
      class(normal_damping_t), intent(in) :: self
      !> Bodies (not used)
      type(bodies_t), intent(in) :: bodies
      !> Contacts (not used)
      type(contacts_t), intent(in) :: contacts
      !> The contact; its normal dashpot changes
      type(contact_element_t), intent(inout) :: element

      associate (unused_bodies => bodies, unused_contacts => contacts)
      end associate
      element%normal_dashpot = element%normal_dashpot &
         + self%coefficient*sqrt(element%normal_mass*self%stiffness)*element%ratio
   end subroutine stiffen

   !> Copy stiffness and coefficient from the settings.
   subroutine take_coefficients(self, settings)
      class(normal_damping_t), intent(inout) :: self
      !> Group &forces
      type(forces_settings_t), intent(in) :: settings

      self%stage = stage_damping
      self%stiffness = settings%stiffness
      self%coefficient = settings%damping_coefficient
      self%dissipates = self%coefficient > 0.0_wp
   end subroutine take_coefficients

end module polydem_normal_damping
