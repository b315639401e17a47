!> Cohesion: a traction c along the contact line, with the potential -c A of the true area A of the overlap.
!>
!> With the gradient N of the area and its moments M (`polydem_overlap_integrals`) the first body feels the force c N
!> and the torque c M1, the second body the opposite. Where the outlines cross twice, this is the force of an even
!> traction on the chord between the crossings: in proportion to its length, at its middle. So a flat face of the width
!> w holds the load c w. The work on every closed path is zero with every law; the force changes continuously while
!> features come and go, since the area has a continuous gradient unless whole edges coincide.
!>
!> A tilt of a face about its middle does not change the area while both its corners stay inside. So cohesion has no
!> stiffness against tilts, and a face under tension keeps that of the elastic law, whatever the load. With the polar
!> law a face of the depth d that tilts by s 2 d/w has
!>
!>     W = (E d^2/2)/(1 - s^2/3),    moment/force = (w s/6)/(1 - 2 s^2/3),
!>
!> for a bed of springs w s/6. At s = 1 an edge opens. So a face without a load bears the moment c w^2/2 before. A part
!> a of the width that is left bears c a^2/2: the elastic force of a wedge passes through its tip. (That of a bed of
!> springs passes at a/3, which leaves c w^2/6.) With the conservative law
!>
!>     W = (E w^2/(l b)) (d^2/2) sqrt((1 + s^2) (1 - s^2/3)),    moment/force = w s (1 - s^2)/(6 + 2 s^2),
!>
!> at most 0.0581 w, at s = 0.54, and zero when an edge opens: G/A is 1.0746 for all triangles, so the energy of a wedge
!> depends on its area alone, and both forces pass through the middle of the chord. No other attraction that follows
!> from A and G and is c w at a face can change that.
!>
!> Areas add up, so cuts along and across a face change nothing. Where a body is inside another, the area does not
!> change with small shifts, and there is no attraction.
!>
!> Friction and damping of tilts follow the pressure of the contact, the normal force without cohesion (as in S. Luding,
!> Granular Matter 10 (2008) 235): a contact that cohesion alone holds together has friction.
module polydem_cohesion
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_history, only: contact_history_t
   use polydem_force_part, only: force_part_t, stage_normal
   use polydem_kinds, only: ip, wp
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_pair_entries, only: at_cohesion
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
      procedure :: stiffen
   end type cohesion_t

   !> Greatest tangent of half the angle at a crossing that the stable step allows for, with something for the turning
   !> of the force with the bodies
   real(wp), parameter :: steepest = 3.0_wp

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
      self%logged = [at_cohesion]
      self%strength = pairs%cohesion
   end subroutine configure

   !> Add the attraction.
   subroutine add(self, bodies, dt, block, history)
      class(cohesion_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts with the gradient of their area; `cohesion` changes
      type(contact_block_t), intent(inout) :: block
      type(contact_history_t), intent(inout) :: history
      real(wp) :: strength(block_size)
      integer(ip) :: c

      associate (unused_bodies => bodies, unused_dt => dt, unused_history => history)
      end associate
      strength(:block%n) = self%strength%one
      call self%strength%scale(block%n, block%material, strength)
      do c = 1_ip, block%n
         block%cohesion(c, 1) = block%cohesion(c, 1) + strength(c)*block%of_area(c, 1)
         block%cohesion(c, 2) = block%cohesion(c, 2) + strength(c)*block%of_area(c, 2)
         block%cohesion(c, 3) = block%cohesion(c, 3) + strength(c)*block%of_area(c, 3)
         block%cohesion(c, 4) = block%cohesion(c, 4) - strength(c)*block%of_area(c, 4)
      end do
   end subroutine add

   !> Add upper bounds of the stiffness. Each crossing of the outlines, where the overlap has the angle f, is a spring
   !> of at most (c/2) tan(f/2) in all directions: the second derivative of the area is the product of the shifts along
   !> both normals over sin f. There are two, half a chord from the middle, and the chord is at most 2 L (at a corner
   !> with the polar law). Edges that are nearly parallel have more, but only on a way that is shorter than the depth
   !> by the same factor.
   subroutine stiffen(self, element)
      class(cohesion_t), intent(in) :: self
      !> The contact; its stiffnesses change
      type(linearised_contact_t), intent(inout) :: element
      real(wp) :: stiffness

      stiffness = steepest*self%strength%of(element%materials)
      element%normal_stiffness = element%normal_stiffness + stiffness
      element%tangential_stiffness = element%tangential_stiffness + stiffness
      if (.not. element%is_expected) element%tilt_stiffness = element%tilt_stiffness + stiffness*element%length**2
   end subroutine stiffen

end module polydem_cohesion
