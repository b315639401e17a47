!> Elastic normal force of the overlap area: F = E A/l.
!>
!> H.-G. Matuttis & J. Chen, Understanding the Discrete Element Method, Wiley 2014, Eq. 7.6 and 7.7. The characteristic
!> length is l = 4 r1 r2/(r1 + r2), where r1 and r2 are the distances of the force point (the centroid of the overlap)
!> from the centres of mass, or from the centroids of the pieces if bodies have several. Two equal squares face to face
!> have the stiffness E.
module polydem_area_law
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_contact_history, only: contact_history_t
   use polydem_elementary, only: hypotenuse
   use polydem_force_part, only: force_part_t, resting_block_t, softness_fit_t, stage_elastic
   use polydem_kinds, only: ip, wp
   use polydem_pair_entries, only: at_stiffness
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_pair_value, only: pair_value_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: area_law_t

   !> The area law
   type, extends(force_part_t) :: area_law_t
      !> Young's modulus in two dimensions E [N/m2]
      type(pair_value_t) :: stiffness
   contains
      procedure :: configure
      procedure :: add
      procedure :: stiffen
      procedure :: static_depth
   end type area_law_t

   !> Least characteristic length as a share of the square root of the area. It acts only where the force point is at a
   !> centre of mass. This is common in degenerate contacts, whose least length is the square root itself
   real(wp), parameter :: least_length = 1.0e-3_wp

contains

   !> Copy the parameters from the settings. The force does work on closed paths, which only damping hides.
   subroutine configure(self, settings, pairs)
      class(area_law_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      associate (unused => settings)
      end associate
      self%stage = stage_elastic
      self%logged = [at_stiffness]
      self%fit = softness_fit_t(tipping=[5.45_wp, 1.0_wp/3.0_wp], impact=[2.7_wp, 0.45_wp])
      self%stiffness = pairs%stiffness
      self%undamped_warning = 'the area law is not conservative: without damping it adds kinetic energy at '// &
         'any time step (a third in 0.2 s in a gas); set law = ''polar'' in &forces, or use damping'
   end subroutine configure

   !> Set the characteristic length and add the elastic force. It acts at the centroid of the overlap.
   subroutine add(self, bodies, dt, block, history)
      class(area_law_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts; `inverse_length`, `lever`, `elastic` and `normal_force` change
      type(contact_block_t), intent(inout) :: block
      type(contact_history_t), intent(inout) :: history
      real(wp) :: length(block_size), r1, r2, least, force
      integer(ip) :: c

      associate (unused_dt => dt, unused_history => history)
      end associate
      least = 1.0_wp
      do c = 1_ip, block%n
         r1 = sqrt(block%arm_first(c, 1)**2 + block%arm_first(c, 2)**2)
         r2 = sqrt(block%arm_second(c, 1)**2 + block%arm_second(c, 2)**2)
         length(c) = 4.0_wp*(r1*r2)/max(r1 + r2, tiny(r1))
         least = min(least, min(length(c)**2 - (2.0_wp*least_length)**2*block%area(c), &
                                length(c) - block%degenerate(c)*block%length(c)))
      end do
      if (bodies%pieces%most > 1_ip) then
         call measure_pieces(bodies, block, length)
         least = -1.0_wp
      end if
      ! Without a short length, the square roots of the areas are not needed.
      if (least < 0.0_wp) then
         do c = 1_ip, block%n
            length(c) = max(length(c), max(least_length*sqrt(block%area(c)), block%degenerate(c)*block%length(c)))
         end do
      end if
      if (allocated(self%stiffness%factor)) then
         do c = 1_ip, block%n
            length(c) = length(c)/self%stiffness%factor(block%material(c, 1), block%material(c, 2))
         end do
      end if
      do c = 1_ip, block%n
         block%inverse_length(c) = 1.0_wp/length(c)
         block%lever(c) = 0.0_wp
         force = self%stiffness%one*block%area(c)*block%inverse_length(c)
         block%elastic(c) = block%elastic(c) + force
         block%normal_force(c) = block%normal_force(c) + force
      end do
   end subroutine add

   !> Find the characteristic lengths of contacts between bodies of several pieces. The distances are those from the
   !> centroids of the pieces: the centre of mass of a concave body may lie on its outline.
   pure subroutine measure_pieces(bodies, block, length)
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(in) :: block
      !> Characteristic length of each contact [m]
      real(wp), intent(inout) :: length(block_size)
      real(wp) :: r1, r2, arm(2)
      integer(ip) :: c

      do c = 1_ip, block%n
         arm = block%arm_first(c, :) - bodies%pieces%arm(:, block%piece(c, 1))
         r1 = sqrt(arm(1)**2 + arm(2)**2)
         arm = block%arm_second(c, :) - bodies%pieces%arm(:, block%piece(c, 2))
         r2 = sqrt(arm(1)**2 + arm(2)**2)
         length(c) = 4.0_wp*(r1*r2)/max(r1 + r2, tiny(r1))
      end do
   end subroutine measure_pieces

   !> Add the stiffness E L/l. An expected contact is a face on the edge with the greatest ratio L/l, where l is twice
   !> the distance of the edge from the centre.
   subroutine stiffen(self, element)
      class(area_law_t), intent(in) :: self
      !> The contact; its normal stiffness changes, and its ratio if it is an expected contact
      type(linearised_contact_t), intent(inout) :: element

      if (element%is_expected) element%ratio = element%edge_ratio*self%stiffness%factor_of(element%materials)
      element%normal_stiffness = element%normal_stiffness + self%stiffness%one*element%ratio
   end subroutine stiffen

   !> Depth at which a flat contact carries a block at rest [m]: inverse of Matuttis & Chen 2014, Eq. 7.6.
   !>
   !> The length l = 4 r1 r2/(r1 + r2) contains the distances of the two centres from the centroid of the overlap, which
   !> is d/2 inside either body. l depends weakly on the depth d, so a few fixed-point iterations converge to rounding.
   !> A block that is too heavy for this sinks deeper than its height.
   real(wp) function static_depth(self, block) result(depth)
      class(area_law_t), intent(in) :: self
      type(resting_block_t), intent(in) :: block
      real(wp) :: stiffness, r1, r2
      integer :: k

      stiffness = self%stiffness%of(block%materials)
      depth = 0.0_wp
      do k = 1, 12
         r1 = 0.5_wp*(block%height - depth)
         r2 = hypotenuse(0.5_wp*(block%support_height - depth), block%offset)
         depth = block%load/(stiffness*block%width)*4.0_wp*r1*r2/(r1 + r2)
         if (.not. depth < block%height) return
      end do
   end function static_depth

end module polydem_area_law
