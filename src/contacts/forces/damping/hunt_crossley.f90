!> Normal damping in proportion to the elastic force: F = F_el (1 + a v_n), a = gamma sqrt(m_eff/E)/l.
!>
!> l is the characteristic length of the area and the conservative law. That of the polar law vanishes with the overlap
!> at a corner, where a would grow without limit. There l is one of the bodies: 1/l^2 = m_eff (1/I1 + 1/I2)/6, so that
!> l is the side of a square, at any place and however the body is cut.
!>
!> K.H. Hunt & F.R.E. Crossley, J. Appl. Mech. 42 (1975) 440, with v_n = (dA/dt)/L, so the loss is never negative. The
!> damping vanishes with the overlap. The force does not jump at first touch, and the error of restitution is of second
!> order in the step. Slow impacts lose less: with u = a v before the impact, the restitution e follows from
!> u - ln(1 + u) = -e u - ln(1 - e u), e = 1 - 2u/3 + ...
module polydem_hunt_crossley
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_kinds, only: ip, wp
   use polydem_normal_damping, only: find_reaches, normal_damping_t
   use polydem_pair_entries, only: at_damping_coefficient
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_pair_value, only: weighted
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: hunt_crossley_t

   !> Damping in proportion to the elastic force
   type, extends(normal_damping_t) :: hunt_crossley_t
      !> Whether l is a length of the bodies
      logical :: is_of_bodies = .false.
   contains
      procedure :: configure
      procedure :: find_forces
      procedure :: find_dashpots
      procedure :: stiffen
   end type hunt_crossley_t

contains

   !> Copy the parameters from the settings. At rest the dashpot is in proportion to the load, so this damping is weak.
   !> Damping over elastic force is in proportion to gamma/sqrt(E). The length of a law contains the ratio of the
   !> stiffness of a pair to that of the law; a length of the bodies does not.
   subroutine configure(self, settings, pairs)
      class(hunt_crossley_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      call self%take_coefficients(settings, pairs)
      self%logged = [at_damping_coefficient]
      self%coefficient = weighted(pairs%damping_coefficient, pairs%stiffness, merge(1, 3, self%is_of_bodies))
      self%is_weak = .true.
   end subroutine configure

   !> Compute the damping forces of one block of contacts.
   subroutine find_forces(self, block, force)
      class(hunt_crossley_t), intent(in) :: self
      type(contact_block_t), intent(in) :: block
      real(wp), intent(inout) :: force(block_size)
      real(wp) :: share, reach(block_size), inverse_length(block_size)
      integer(ip) :: c

      call find_reaches(block, reach)
      call find_lengths(self, block, inverse_length)
      do c = 1_ip, block%n
         share = self%coefficient%one*sqrt(1.0_wp/(block%mobility(c)*self%stiffness))*inverse_length(c) &
            *(block%rate(c)/reach(c))
         force(c) = block%elastic(c)*share
      end do
   end subroutine find_forces

   !> Find the dashpots F_el a of one block of contacts.
   subroutine find_dashpots(self, block, dashpot)
      class(hunt_crossley_t), intent(in) :: self
      type(contact_block_t), intent(in) :: block
      real(wp), intent(inout) :: dashpot(block_size)
      real(wp) :: reach(block_size), inverse_length(block_size)
      integer(ip) :: c

      call find_reaches(block, reach)
      call find_lengths(self, block, inverse_length)
      do c = 1_ip, block%n
         dashpot(c) = block%elastic(c)*(self%coefficient%one*sqrt(1.0_wp/(block%mobility(c)*self%stiffness))) &
            *(inverse_length(c)*block%length(c)/reach(c))
      end do
   end subroutine find_dashpots

   !> Find the reciprocal 1/l of each contact.
   pure subroutine find_lengths(self, block, inverse_length)
      class(hunt_crossley_t), intent(in) :: self
      type(contact_block_t), intent(in) :: block
      !> The reciprocals [1/m]
      real(wp), intent(inout) :: inverse_length(block_size)
      integer(ip) :: c

      if (self%is_of_bodies) then
         do c = 1_ip, block%n
            inverse_length(c) = sqrt((block%inverse_inertia(c, 1) + block%inverse_inertia(c, 2)) &
                                     /(6.0_wp*block%mobility(c)))
         end do
      else
         do c = 1_ip, block%n
            inverse_length(c) = block%inverse_length(c)
         end do
      end if
   end subroutine find_lengths

   !> Add stiffness and dashpot from the present force. The force of an expected contact rises with the damping of its
   !> approach, 1 + a v, and it has the dashpot of its greatest depth.
   subroutine stiffen(self, element)
      class(hunt_crossley_t), intent(in) :: self
      !> The contact; normal stiffness and dashpot change
      type(linearised_contact_t), intent(inout) :: element
      real(wp) :: share

      share = self%coefficient%of(element%materials)*sqrt(1.0_wp/(element%normal_mobility*self%stiffness))
      if (.not. self%is_of_bodies) then
         share = share*element%ratio/max(element%length, sqrt(element%area))
      else if (element%is_expected) then
         share = share*sqrt(element%inverse_square)
      else
         share = share*sqrt(element%inverse_square)*element%length/max(element%length, sqrt(element%area))
      end if
      if (element%is_expected) then
         element%normal_dashpot = element%normal_dashpot + share*element%normal_stiffness*element%depth
         element%normal_stiffness = element%normal_stiffness*(1.0_wp + share*element%speed)
         return
      end if
      if (element%repulsion > element%elastic) &
         element%normal_stiffness = element%normal_stiffness*(element%repulsion/element%elastic)
      element%normal_dashpot = element%normal_dashpot + share*element%elastic
   end subroutine stiffen

end module polydem_hunt_crossley
