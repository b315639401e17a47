!> Base type of normal dampings: the limit of the force, and the dashpot of the stable step.
!>
!> Damping never makes a contact attractive: the sum of elastic and damping force is not negative (H.-G. Matuttis & J.
!> Chen, Understanding the Discrete Element Method, Wiley 2014, p. 277). An attraction by another part is not changed.
module polydem_normal_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_contact_history, only: contact_history_t
   use polydem_force_part, only: force_part_t, stage_damping
   use polydem_kinds, only: ip, wp
   use polydem_pair_entries, only: at_damping_coefficient
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_pair_value, only: pair_value_t, weighted
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: normal_damping_t, find_reaches

   !> A normal damping
   type, abstract, extends(force_part_t) :: normal_damping_t
      !> Young's modulus in two dimensions E [N/m2]; `inverse_length` and `ratio` of contacts have its factor
      real(wp) :: stiffness = 0.0_wp
      !> Dimensionless damping coefficient gamma, or a damping ratio, with the factors that forces and dashpots need
      !> beside that of the stiffness
      type(pair_value_t) :: coefficient
      !> Whether it fills the column `dashpot` of a block
      logical :: fills_dashpots = .false.
   contains
      procedure :: add
      !> Compute the damping forces of a block of contacts from their present state
      procedure :: find_forces
      !> Find the dashpots of a block of contacts
      procedure :: find_dashpots
      !> Add damping forces to those of a block of contacts
      procedure, nopass :: add_limited
      procedure :: stiffen
      procedure :: configure => take_coefficients
      procedure, non_overridable :: take_coefficients
   end type normal_damping_t

   !> Below this coefficient a damping is weak; a face then has a restitution of three quarters
   real(wp), parameter :: weak_coefficient = 0.25_wp

contains

   !> Add the forces of `find_forces`. A damping with a contact history overrides this procedure.
   subroutine add(self, bodies, dt, block, history)
      class(normal_damping_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts; `normal_force` changes
      type(contact_block_t), intent(inout) :: block
      type(contact_history_t), intent(inout) :: history
      real(wp) :: force(block_size)

      associate (unused_bodies => bodies, unused_dt => dt, unused_history => history)
      end associate
      call self%find_forces(block, force)
      call self%coefficient%scale(block%n, block%material, force)
      call self%add_limited(force, block)
      if (.not. self%fills_dashpots) return
      call self%find_dashpots(block, block%dashpot)
      call self%coefficient%scale(block%n, block%material, block%dashpot)
   end subroutine add

   !> Compute the damping forces of a block of contacts, without a limit and factors of pairs. Default: none.
   subroutine find_forces(self, block, force)
      class(normal_damping_t), intent(in) :: self
      !> Contacts with their elastic forces
      type(contact_block_t), intent(in) :: block
      !> Damping force of each contact, positive in repulsion [N/m]
      real(wp), intent(inout) :: force(block_size)

      associate (unused_self => self)
      end associate
      force(:block%n) = 0.0_wp
   end subroutine find_forces

   !> Find the dashpots of a block of contacts, gamma sqrt(m E) L/l: force per normal velocity, without factors.
   subroutine find_dashpots(self, block, dashpot)
      class(normal_damping_t), intent(in) :: self
      !> Contacts with their elastic forces
      type(contact_block_t), intent(in) :: block
      !> Dashpot of each contact [N s/m2]
      real(wp), intent(inout) :: dashpot(block_size)
      integer(ip) :: c

      do c = 1_ip, block%n
         dashpot(c) = self%coefficient%one*sqrt(self%stiffness/block%mobility(c)) &
            *block%inverse_length(c)*block%length(c)
      end do
   end subroutine find_dashpots

   !> Add damping forces. Their sum with the elastic force is limited to repulsion.
   subroutine add_limited(force, block)
      !> Damping force of each contact, positive in repulsion [N/m]
      real(wp), intent(in) :: force(block_size)
      !> Contacts; `normal_force` changes
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: c

      do c = 1_ip, block%n
         block%normal_force(c) = block%normal_force(c) + max(-block%elastic(c), force(c))
      end do
   end subroutine add_limited

   !> Add the dashpot gamma sqrt(m E) L/l.
   subroutine stiffen(self, element)
      class(normal_damping_t), intent(in) :: self
      !> The contact; its normal dashpot changes
      type(linearised_contact_t), intent(inout) :: element

      element%normal_dashpot = element%normal_dashpot &
         + self%coefficient%of(element%materials)*sqrt(element%normal_mass*self%stiffness)*element%ratio
   end subroutine stiffen

   !> Find the lengths by which rates of the area are divided, for their velocities. Bars that nearly cross turn without
   !> approach, and their contact length vanishes. So these lengths are at least the side of a square of the same area,
   !> or half the area over the length of the overlap, if the law knows it.
   pure subroutine find_reaches(block, reach)
      type(contact_block_t), intent(in) :: block
      !> The lengths [m]
      real(wp), intent(inout) :: reach(block_size)
      integer(ip) :: c

      if (block%n == 0_ip) return
      if (block%length_square(1) > 0.0_wp) then
         do c = 1_ip, block%n
            reach(c) = max(block%length(c), 0.5_wp*block%area(c)/sqrt(block%length_square(c)))
         end do
      else
         do c = 1_ip, block%n
            reach(c) = max(block%length(c), sqrt(block%area(c)))
         end do
      end if
   end subroutine find_reaches

   !> Copy stiffness and coefficient from the settings. Forces are in proportion to gamma sqrt(E).
   subroutine take_coefficients(self, settings, pairs)
      class(normal_damping_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      self%stage = stage_damping
      self%logged = [at_damping_coefficient]
      self%stiffness = pairs%stiffness%one
      self%coefficient = weighted(pairs%damping_coefficient, pairs%stiffness, 1)
      self%dissipates = pairs%damping_coefficient%greatest() > 0.0_wp
      self%is_weak = pairs%damping_coefficient%least() < weak_coefficient
      self%fills_dashpots = settings%tilt_damping > 0.0_wp
   end subroutine take_coefficients

end module polydem_normal_damping
