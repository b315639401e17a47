!> Rolling resistance: a couple against the relative rotation of two bodies, for grains that stand for rounded ones.
!>
!> The elastic-plastic spring with a dashpot of J. Ai, J.-F. Chen, J.M. Rotter & J.Y. Ooi, Powder Technology 206 (2011)
!> 269, type C, after K. Iwashita & M. Oda, J. Eng. Mech. 124 (1998) 285. The couple M of an angular spring on the first
!> body, and the opposite one on the second, follows the relative angular velocity w = w1 - w2 and is limited:
!>
!>     M <- clip(M - k_r w dt, +-mu_r R F_n),    k_r = 3 E mu_r^2 R^2,    1/R = 1/r1 + 1/r2
!>
!> r is the radius of the circle of the area of a body; a fixed body counts as flat. F_n is the pressure, the normal
!> force without cohesion. k_r is that of a bed of springs of the width 6 mu_r R, on which a body begins to tip at the
!> same limit. So the spring yields at the angle F_n/(3 E mu_r R). The dashpot -c w has c = 2 d (k_r I_r)^(1/2), 1/I_r =
!> 1/(I1 + m1 r1^2) + 1/(I2 + m2 r2^2). The sum of both is limited like the spring, as in friction; the dashpot is not
!> part of the contact history. (Ai et al. omit it where the spring is at its limit, which differs little.)
!>
!> w is that in the middle of the step, so that the couple follows the angles: it is of second order in dt. Its work
!> counts as damping, as that of every `couple`; the spring gives back what it has stored.
module polydem_rolling_resistance
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_elementary, only: pi
   use polydem_force_part, only: force_part_t, stage_last
   use polydem_kinds, only: ip, wp
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_pair_entries, only: at_rolling_friction
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_pair_value, only: pair_value_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: rolling_resistance_t

   !> Rolling resistance
   type, extends(force_part_t) :: rolling_resistance_t
      !> Coefficient mu_r
      type(pair_value_t) :: coefficient
      !> Its common factor in the settings
      real(wp) :: full_coefficient = 0.0_wp
      !> Stiffness of the spring over the square of the reduced radius, k_r/R^2 [N/m2]
      type(pair_value_t) :: stiffness
      !> Dashpot as a share d of the critical one
      real(wp) :: damping = 0.0_wp
      !> 1/r of each body, 0 for fixed ones, (slot) [1/m]
      real(wp), allocatable :: curvature(:)
      !> 1/(I + m r^2) of each body, 0 for fixed ones, (slot) [1/(kg m)]
      real(wp), allocatable :: inverse_inertia(:)
   contains
      procedure :: configure
      procedure :: measure
      procedure :: scale_friction
      procedure :: add
      procedure :: stiffen
   end type rolling_resistance_t

   !> k_r over E mu_r^2 R^2
   real(wp), parameter :: bed_factor = 3.0_wp

contains

   !> Copy the parameters from the settings. The contact history is the couple of the spring.
   subroutine configure(self, settings, pairs)
      class(rolling_resistance_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(pair_parameters_t), intent(in) :: pairs

      self%stage = stage_last
      self%needs_couple = .true.
      self%needs_accelerations = .true.
      self%logged = [at_rolling_friction]
      self%coefficient = pairs%rolling_friction
      self%full_coefficient = self%coefficient%one
      self%stiffness = self%coefficient
      self%stiffness%one = bed_factor*pairs%stiffness%one*self%coefficient%one**2
      if (allocated(self%stiffness%factor)) then
         self%stiffness%factor(:, :) = self%stiffness%factor**2
         if (allocated(pairs%stiffness%factor)) &
            self%stiffness%factor(:, :) = self%stiffness%factor*pairs%stiffness%factor
      else if (allocated(pairs%stiffness%factor)) then
         allocate (self%stiffness%factor, source=pairs%stiffness%factor)
      end if
      self%damping = settings%rolling_damping
      self%history_kinds = [history_kind_t('rolling', 'N', 'couple of the rolling spring')]
   end subroutine configure

   !> Measure radii and moments of inertia.
   subroutine measure(self, bodies)
      class(rolling_resistance_t), intent(inout) :: self
      !> Bodies, for their shapes
      type(bodies_t), intent(in) :: bodies
      real(wp) :: square
      integer(ip) :: s

      if (allocated(self%curvature)) deallocate (self%curvature, self%inverse_inertia)
      allocate (self%curvature(bodies%n), self%inverse_inertia(bodies%n), source=0.0_wp)
      do s = 1_ip, bodies%n
         if (bodies%fixed(s)) cycle
         square = bodies%pieces%area_of(s)/pi
         self%curvature(s) = 1.0_wp/sqrt(square)
         self%inverse_inertia(s) = 1.0_wp/(bodies%inertia(s) + bodies%mass(s)*square)
      end do
   end subroutine measure

   !> Scale the coefficient; the stiffness of the spring stays.
   subroutine scale_friction(self, factor)
      class(rolling_resistance_t), intent(inout) :: self
      real(wp), intent(in) :: factor

      self%coefficient%one = factor*self%full_coefficient
   end subroutine scale_friction

   !> Add the couple and store that of the spring.
   subroutine add(self, bodies, dt, block, history)
      class(rolling_resistance_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Contacts with complete normal forces; `couple` changes
      type(contact_block_t), intent(inout) :: block
      !> Contact history; the couple of the spring is read and set
      type(contact_history_t), intent(inout) :: history
      real(wp) :: limit(block_size), stiffness(block_size)
      integer(ip) :: c

      do c = 1_ip, block%n
         limit(c) = block%normal_force(c)
      end do
      do c = 1_ip, block%n
         associate (radius => 1.0_wp/(self%curvature(block%first(c)) + self%curvature(block%second(c))))
            limit(c) = self%coefficient%one*radius*max(0.0_wp, limit(c))
            stiffness(c) = self%stiffness%one*radius**2
         end associate
      end do
      call self%coefficient%scale(block%n, block%material, limit)
      call self%stiffness%scale(block%n, block%material, stiffness)
      call turn(self, bodies, dt, limit, stiffness, block, history%column(self%first_column)%value)
   end subroutine add

   !> Turn the springs of a block by the rotation of a step, and add their couples and those of the dashpots.
   pure subroutine turn(self, bodies, dt, limit, stiffness, block, stored)
      class(rolling_resistance_t), intent(in) :: self
      !> Bodies, for their angular accelerations
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      !> Greatest couple [N], and stiffness of the spring [N] of each contact
      real(wp), intent(in) :: limit(block_size), stiffness(block_size)
      type(contact_block_t), intent(inout) :: block
      !> Couples of the springs of all pairs [N]
      real(wp), intent(inout) :: stored(:)
      real(wp) :: rate, middle, couple, dashpot
      integer(ip) :: c

      do c = 1_ip, block%n
         associate (i => block%first(c), j => block%second(c), p => block%pair(c))
            rate = block%angular_velocity(c, 1) - block%angular_velocity(c, 2)
            middle = rate - 0.5_wp*dt*(bodies%angular_acceleration(i) - bodies%angular_acceleration(j))
            couple = max(-limit(c), min(limit(c), stored(p) - stiffness(c)*middle*dt))
            stored(p) = couple
            dashpot = 2.0_wp*self%damping*sqrt(stiffness(c)/(self%inverse_inertia(i) + self%inverse_inertia(j)))
            block%couple(c) = block%couple(c) + max(-limit(c), min(limit(c), couple - dashpot*rate))
         end associate
      end do
   end subroutine turn

   !> Add the spring and its dashpot.
   subroutine stiffen(self, element)
      class(rolling_resistance_t), intent(in) :: self
      !> The contact; stiffness and dashpot against tilts change
      type(linearised_contact_t), intent(inout) :: element
      real(wp) :: stiffness

      stiffness = self%stiffness%of(element%materials)*element%rolling_radius**2
      element%tilt_stiffness = element%tilt_stiffness + stiffness
      element%tilt_dashpot = element%tilt_dashpot + 2.0_wp*self%damping*sqrt(stiffness*element%rolling_inertia)
   end subroutine stiffen

end module polydem_rolling_resistance
