!> Elastic forces with a potential W, where G is the effective area of the overlap (`effective_area`), A its area and L
!> its length (`overlap_measure`):
!>
!>     polar              E A^2/(2 L^2)      the default of the namelist
!>     conservative       E G^2/(2 l b)
!>
!> With the polar law a face of the width w and the depth d has the stiffness E against approach, whatever its width and
!> the bodies, and w^2/12 of it against tilts. A corner is a linear spring, too: a right angle has 0.375 E. A/L is about
!> the least distance by which the overlap can be undone, and the law pushes there: an overlap deeper than 0.6 of the
!> width of a thin end pushes the end aside, and a thin body that is inside another with more than a fifth of its area
!> may be pulled in. The guard `overlap` warns long before.
!>
!> The conservative law: with N and M of `effective_area`, dG/dt = N . (v1 - v2) + M1 w1 - M2 w2. With W' = dW/dG =
!> E G/(l b), the first body feels the force -W' N and the torque -W' M1, the second body W' N and W' M2. The work on
!> every closed path is zero, and momentum and angular momentum are conserved. The polar law has the same form, with A
!> and L^2 in the place of G and l b, and N and M with the weight of its measure. (Y. T. Feng, Comput. Methods Appl.
!> Mech. Eng. 373 (2021), makes the energy of a contact a function of its volume. A function of the area alone does not
!> resist tilts of a face, because the area is constant while the corners stay inside. The effective area is our own. It
!> includes the second moments.)
!>
!> Its force equals that of a pressure p(x) = W' G/4 (x - c)^T S^-1 (x - c) on the outline. A face of width w and depth
!> d acts like a bed of springs: its stiffness against approach is E w^2/(l b), and against tilts w^2/12 of that while
!> tilts are small against d/w. The tilt stiffness falls when a corner leaves; the force stays continuous. Corners are
!> softer, F ~ d^3. (p has its minimum in the middle of a face. Only its sum and its moment are physical, not its
!> distribution.)
!>
!> l and b are constants of the pair: l = 2 s1 s2/(s1 + s2) and b = min(s1, s2), where s is the side of the square of a
!> body's area. Two equal squares face to face have the stiffness E, and a square on a large plate has E/2. Two bars of
!> length a and height h have E a/h side to side and E h/a end to end, as with the area law.
!>
!> Where one body is inside the other, or bars cross, G is that of the body or of the common parallelogram. It does not
!> depend on small shifts, so the potential gives no force and no direction (crossed bars get their torque). Such a
!> degenerate contact gets a force along the line of centres. It separates the bodies but has no potential. Set
!> degenerate = 'stop' in &overlap to stop the run instead.
module polydem_conservative_law
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_linearised_contact, only: linearised_contact_t, face_tilt_stiffness
   use polydem_contact_history, only: contact_history_t
   use polydem_force_part, only: force_part_t, resting_block_t, softness_fit_t, stage_elastic
   use polydem_kinds, only: ip, wp
   use polydem_overlap_measure, only: overlap_measure_t
   use polydem_pair_entries, only: at_stiffness
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_pair_value, only: pair_value_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: conservative_law_t

   !> A law with a potential: by its measure of overlaps, the polar or the conservative law
   type, extends(force_part_t) :: conservative_law_t
      !> Young's modulus in two dimensions E [N/m2]
      type(pair_value_t) :: stiffness
      !> Reciprocal side 1/s of the square of each piece's area, (piece) [1/m]
      real(wp), allocatable :: inverse_size(:)
      !> Greatest ratio of the stiffness of a contact to F^2/(2 W)
      real(wp) :: steepening = 1.5_wp
   contains
      procedure :: configure
      procedure :: measure
      procedure :: add
      procedure :: stiffen
      procedure :: static_depth
   end type conservative_law_t

contains

   !> Copy the parameters from the settings.
   subroutine configure(self, settings, pairs)
      class(conservative_law_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      associate (unused => settings)
      end associate
      self%stage = stage_elastic
      if (self%overlap_measure%per_length) then
         self%steepening = 4.5_wp
         self%fit = softness_fit_t(tipping=[9.7_wp, 1.0_wp], impact=[3.35_wp, 0.5_wp])
      else
         self%fit = softness_fit_t(tipping=[4.7_wp, 0.25_wp], impact=[4.2_wp, 0.3_wp])
      end if
      self%energy_is_known = .true.
      self%logged = [at_stiffness]
      self%stiffness = pairs%stiffness
   end subroutine configure

   !> Measure the areas of the pieces of bodies.
   subroutine measure(self, bodies)
      class(conservative_law_t), intent(inout) :: self
      !> Bodies, for their shapes
      type(bodies_t), intent(in) :: bodies
      integer(ip) :: s

      if (allocated(self%inverse_size)) deallocate (self%inverse_size)
      allocate (self%inverse_size(bodies%pieces%n_pieces()))
      if (bodies%pieces%most > 1_ip) then
         do s = 1_ip, bodies%pieces%n_pieces()
            self%inverse_size(s) = 1.0_wp/sqrt(bodies%pieces%area_of_piece(s))
         end do
         return
      end if
      do s = 1_ip, bodies%n
         self%inverse_size(s) = 1.0_wp/sqrt(area_of(bodies, s))
      end do
   end subroutine measure

   !> Area of a body [m2]
   pure real(wp) function area_of(bodies, s)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: s
      integer(ip) :: v, w

      area_of = 0.0_wp
      w = bodies%pieces%vertex_start(s + 1_ip) - 1_ip
      do v = bodies%pieces%vertex_start(s), bodies%pieces%vertex_start(s + 1_ip) - 1_ip
         associate (from => bodies%pieces%vertex(:, w), to => bodies%pieces%vertex(:, v))
            area_of = area_of + 0.5_wp*(from(1)*to(2) - from(2)*to(1))
         end associate
         w = v
      end do
   end function area_of

   !> Add the elastic force, and set its lever and the characteristic length, here l b/|N|. The lever is the moment of N
   !> about the force point over |N|. It is computed from the nearer centre for the least rounding error, and from both
   !> if they are equally near.
   subroutine add(self, bodies, dt, block, history)
      class(conservative_law_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts with the effective area; `inverse_length`, `lever`, `elastic` and `normal_force` change
      type(contact_block_t), intent(inout) :: block
      type(contact_history_t), intent(inout) :: history
      real(wp) :: inverse_square(block_size), force
      integer(ip) :: c

      associate (unused_dt => dt, unused_history => history)
      end associate
      if (bodies%pieces%most == 1_ip) then
         call find_squares(self%overlap_measure, self%inverse_size, block%first, block%second, block, inverse_square)
      else
         call find_squares(self%overlap_measure, self%inverse_size, block%piece(:, 1), block%piece(:, 2), block, &
                           inverse_square)
      end if
      call add_of(self%stiffness%one, inverse_square, block)
      if (.not. allocated(self%stiffness%factor)) return
      do c = 1_ip, block%n
         force = self%stiffness%one*block%area(c)*block%inverse_length(c)
         force = (self%stiffness%factor(block%material(c, 1), block%material(c, 2)) - 1.0_wp)*force
         block%elastic(c) = block%elastic(c) + force
         block%normal_force(c) = block%normal_force(c) + force
      end do
      call self%stiffness%scale(block%n, block%material, block%inverse_length)
   end subroutine add

   !> Find the reciprocal of l b or L^2 of each contact.
   pure subroutine find_squares(measure, inverse_size, one, other, block, inverse_square)
      type(overlap_measure_t), intent(in) :: measure
      !> Reciprocal side of the square of the area of each piece [1/m]
      real(wp), intent(in), contiguous :: inverse_size(:)
      !> First and second piece of each contact
      integer(ip), intent(in) :: one(block_size), other(block_size)
      type(contact_block_t), intent(in) :: block
      !> The reciprocals [1/m2]
      real(wp), intent(inout) :: inverse_square(block_size)
      real(wp) :: p, q
      integer(ip) :: c

      if (measure%per_length) then
         do c = 1_ip, block%n
            inverse_square(c) = 1.0_wp/block%length_square(c)
         end do
      else
         do c = 1_ip, block%n
            p = inverse_size(one(c))
            q = inverse_size(other(c))
            inverse_square(c) = 0.5_wp*(p + q)*max(p, q)
         end do
      end if
   end subroutine find_squares

   !> Add the force of one material.
   pure subroutine add_of(stiffness, inverse_square, block)
      !> Young's modulus [N/m2]
      real(wp), intent(in) :: stiffness
      !> Reciprocal of l b or L^2 of each contact [1/m2]
      real(wp), intent(in) :: inverse_square(block_size)
      type(contact_block_t), intent(inout) :: block
      real(wp) :: moment_first, moment_second, nearer, force
      integer(ip) :: c

      do c = 1_ip, block%n
         block%inverse_length(c) = block%length(c)*inverse_square(c)
         associate (r => block%arm_first(c, :), s => block%arm_second(c, :), n => block%normal(c, :))
            moment_first = block%moment(c, 1) - (r(1)*n(2) - r(2)*n(1))
            moment_second = block%moment(c, 2) - (s(1)*n(2) - s(2)*n(1))
            nearer = (s(1)*s(1) + s(2)*s(2)) - (r(1)*r(1) + r(2)*r(2))
         end associate
         nearer = 0.5_wp + sign(0.5_wp, nearer) - 0.5_wp*merge(1.0_wp, 0.0_wp, abs(nearer) <= 0.0_wp)
         block%lever(c) = -(nearer*moment_first + (1.0_wp - nearer)*moment_second)/block%length(c)
         force = stiffness*block%area(c)*block%inverse_length(c)
         block%elastic(c) = block%elastic(c) + force
         block%normal_force(c) = block%normal_force(c) + force
      end do
   end subroutine add_of

   !> Add upper bounds of the stiffness. K_n = F^2/(2 W) is E L^2/(l b), the characteristic length being l b/L.
   !>
   !> The force steepens as L grows with the depth. The square root of the effective area G is a concave function of the
   !> displacement of convex bodies: it is the minimum, over all linear maps of determinant 1, of a multiple of the
   !> fourth root of the polar moment of inertia, which is concave (H. Hadwiger, Comment. Math. Helv. 30 (1956) 285). So
   !> G'' <= G'^2/(2 G), and the normal stiffness is at most 3/2 K_n. The stiffness against tilts is taken as 3/2 of
   !> that of a face, K_n L^2/12. (This is no bound for rotations; none of 2600 random contacts of all kinds had a
   !> frequency more than 8 % above it.)
   !>
   !> For the polar law there is no proof, but the greatest eigenvalue of the second derivatives of W, of 12000 random
   !> shallow contacts of all kinds. In units of that of K_n and K_n L^2/12 together it exceeds 1.9 in one of a hundred
   !> and 4.3 in one of a thousand, where corners come and go; it is at most 6.5.
   !>
   !> An expected contact is one of two equal bodies, where l b is the area. With the polar law every face has the
   !> ratio 1.
   subroutine stiffen(self, element)
      class(conservative_law_t), intent(in) :: self
      !> The contact; stiffness against approach and tilts changes, and its ratio if it is an expected contact
      type(linearised_contact_t), intent(inout) :: element

      if (element%is_expected) then
         element%ratio = merge(1.0_wp, element%square_ratio, self%overlap_measure%per_length)
         element%ratio = element%ratio*self%stiffness%factor_of(element%materials)
         element%normal_stiffness = element%normal_stiffness + self%steepening*(self%stiffness%one*element%ratio)
      else
         element%normal_stiffness = element%normal_stiffness + self%steepening*(self%stiffness%one*element%ratio)
         element%tilt_stiffness = element%tilt_stiffness &
            + self%steepening*face_tilt_stiffness(self%stiffness%one, element)
      end if
   end subroutine stiffen

   !> Depth at which a flat contact of width w carries a block at rest, F l b/(E w^2) [m], where l = 2 s1 s2/(s1 + s2),
   !> b = min(s1, s2), and s is the side of the square of a body's area. The polar law has L^2 = w^2 + d^2 instead of
   !> l b, and a force that is smaller by d^2/L^2.
   real(wp) function static_depth(self, block) result(depth)
      class(conservative_law_t), intent(in) :: self
      type(resting_block_t), intent(in) :: block
      real(wp) :: s1, s2, square, share, first
      integer :: k

      if (self%overlap_measure%per_length) then
         first = block%load/self%stiffness%of(block%materials)
         depth = first
         do k = 1, 12
            square = 1.0_wp + (depth/block%width)**2
            share = 1.0_wp - 1.0_wp/square
            depth = first*square/(1.0_wp - share)
            if (.not. depth < block%height) return
         end do
      else
         s1 = sqrt(block%width*block%height)
         s2 = sqrt(block%support_width*block%support_height)
         depth = block%load/(self%stiffness%of(block%materials)*block%width) &
            *(2.0_wp*s1*s2*min(s1, s2)/((s1 + s2)*block%width))
      end if
   end function static_depth

end module polydem_conservative_law
