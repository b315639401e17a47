!> Base type of a part of the contact force.
!>
!> A part adds to columns of a block of contacts in one loop over the block. It never overwrites values of other
!> parts. The columns decide the channel of the energy balance:
!>
!> * `elastic` and `normal_force`: repulsion of the overlap, work of elastic forces;
!> * `cohesion`: another force with a potential, which may attract, also work of elastic forces;
!> * `normal_force` alone: work of damping;
!> * `couple`: torque of the contact itself, work of damping;
!> * `tangential_force`: work of tangential forces.
!>
!> The order in which parts are listed does not matter; they act in the order of their stages. A part is immutable once
!> it is configured and has measured the bodies. Its contact history is in columns of `contact_history_t`, with one
!> entry per pair of the pair list.
module polydem_force_part
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_history_t
   use polydem_contact_block, only: contact_block_t
   use polydem_kinds, only: ip, wp
   use polydem_law_part, only: law_part_t
   use polydem_overlap_measure, only: overlap_measure_t
   implicit none
   private
   public :: force_part_t, resting_block_t, softness_fit_t, stage_elastic, stage_damping, stage_on_damping, &
             stage_normal, stage_last

   !> Stages in the order in which they act: elastic repulsion, which sets `inverse_length` and `lever`; normal damping,
   !> which uses the repulsion only; changes of the damping; other forces, such as cohesion; friction and damping of
   !> tilts, which use the whole normal force
   integer, parameter :: stage_elastic = 1, stage_damping = 2, stage_on_damping = 3, stage_normal = 4, stage_last = 5

   !> A rectangular block at rest on a support
   type :: resting_block_t
      !> Normal load per unit depth of the plane [N/m]
      real(wp) :: load
      !> Width and height of the block [m]
      real(wp) :: width, height
      !> Width, at least that of the block, and thickness of the support [m]
      real(wp) :: support_width, support_height
      !> Distance of the two centres along the contact [m]
      real(wp) :: offset = 0.0_wp
      !> Numbers of the materials of block and support
      integer(ip) :: materials(2) = 0_ip
   end type resting_block_t

   !> Errors beside rigid bodies, as fits: coefficient and exponent of the softness, a pressure over the stiffness;
   !> 0: not known
   type :: softness_fit_t
      !> Error of the tangent of the slope on which a block of 1 x 4 topples, over the static pressure, (2)
      real(wp) :: tipping(2) = 0.0_wp
      !> Error of the velocity after an elastic impact on a corner, over the speed of the impact; over its pressure, (2)
      real(wp) :: impact(2) = 0.0_wp
   end type softness_fit_t

   !> One part of the force between two bodies in contact. The factory or `configure` sets all components
   type, abstract, extends(law_part_t) :: force_part_t
      !> Stage in which it acts, one of the constants above
      integer :: stage = stage_normal
      !> How overlaps must be measured; that of the elastic part counts
      type(overlap_measure_t) :: overlap_measure
      !> How far it is from rigid; that of the elastic part counts
      type(softness_fit_t) :: fit
      !> Whether it adds to the column `cohesion`, and whether it states the energy there
      logical :: needs_cohesion = .false., cohesion_has_energy = .false.
      !> Whether it adds to the column `couple`
      logical :: needs_couple = .false.
      !> Whether it needs the shares of contacts between the same two bodies
      logical :: needs_shares = .false.
      !> Column of the contact history with the force of friction of the last step; 0 if there is none
      integer :: friction_column = 0
      !> Whether it needs the accelerations of the last step
      logical :: needs_accelerations = .false.
      !> Whether the energy of its elastic force is half of elastic area/length
      logical :: energy_is_known = .false.
      !> Whether it dissipates energy in every normal impact
      logical :: dissipates = .false.
      !> Whether it damps tilts
      logical :: damps_tilts = .false.
      !> Whether it is a damping that is too weak for bodies to come to rest within a second or so
      logical :: is_weak = .false.
      !> Warning if no part of the law dissipates; not allocated if there is none
      character(len=:), allocatable :: undamped_warning
   contains
      !> Add this part to the forces of a block of contacts
      procedure(add), deferred :: add
      !> Depth at which this part carries a block at rest
      procedure :: static_depth
   end type force_part_t

   abstract interface
      !> Add this part to the forces of a block of contacts. Several threads work on different blocks.
      subroutine add(self, bodies, dt, block, history)
         import :: bodies_t, contact_history_t, contact_block_t, force_part_t, wp
         class(force_part_t), intent(in) :: self
         !> Bodies with the positions and velocities of this step
         type(bodies_t), intent(in) :: bodies
         !> Time since the last evaluation [s]; 0 at the start of a run
         real(wp), intent(in) :: dt
         !> Some contacts of this step
         type(contact_block_t), intent(inout) :: block
         !> Contact history; only the pairs of these contacts may change
         type(contact_history_t), intent(inout) :: history
      end subroutine add
   end interface

contains

   !> Depth at which this part of a flat contact carries a block at rest [m]. Default: 0, it carries no load
   real(wp) function static_depth(self, block)
      class(force_part_t), intent(in) :: self
      type(resting_block_t), intent(in) :: block

      associate (unused_self => self, unused_block => block)
      end associate
      static_depth = 0.0_wp
   end function static_depth

end module polydem_force_part
