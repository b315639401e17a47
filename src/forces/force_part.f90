!> What every part of a contact force promises.
!>
!> Each part looks at all contacts in one loop and adds to columns of the contact table; it never overwrites what other
!> parts left there. The column says where the work of the force goes in the balance of energy:
!>
!> * `elastic` and `normal_force`: the repulsion of the overlap, work of elastic forces;
!> * `cohesion` and `normal_force`: another force that stores energy and may attract, work of elastic forces, too;
!> * `normal_force` alone: work of damping;
!> * `twist`: torque of its own, work of damping;
!> * `tangential_force`: work of tangential forces.
!>
!> `energy_is_quadratic` of the table holds if the energy of all elastic forces is half of elastic area/length: the part
!> of the overlap sets it, and a part with cohesion sets it to false.
!>
!> The order in which parts are listed does not matter: each says when it acts, so that it finds what it needs. Parts
!> are immutable once they are chosen and measured; what they remember lies in the columns of `contact_memory_t` that
!> ride on the pair list.
module polydem_force_part
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_history_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: wp
   use polydem_law_part, only: law_part_t
   implicit none
   private
   public :: force_part_t, acts_elastic, acts_damping, acts_on_damping, acts_normal, acts_last

   !> When a part acts: first the elastic repulsion, which sets `inverse_length` and `lever`; then normal damping, which
   !> knows the repulsion and nothing else; what changes damping; other normal forces, as cohesion; last friction and
   !> damping of tilts, which know the whole normal force
   integer, parameter :: acts_elastic = 1, acts_damping = 2, acts_on_damping = 3, acts_normal = 4, acts_last = 5

   !> One part of the force between two bodies in contact. All components are set by `choose`
   type, abstract, extends(law_part_t) :: force_part_t
      !> When it acts, one of the constants above
      integer :: stage = acts_normal
      !> Whether `area` and what follows from it must be those of the effective area
      logical :: needs_effective_area = .false.
      !> Whether it adds to the column `cohesion`
      logical :: needs_cohesion = .false.
      !> Whether it adds to the column `twist`
      logical :: needs_twist = .false.
      !> Whether every normal impact loses energy by it
      logical :: dissipates = .false.
   contains
      !> Add this part to the forces of all contacts
      procedure(add), deferred :: add
      !> Depth at which it carries a load
      procedure :: static_depth
      !> What is wrong with it if nothing dissipates
      procedure :: undamped_warning
   end type force_part_t

   abstract interface
      !> Add this part to the forces of all contacts.
      subroutine add(self, bodies, dt, contacts, history)
         import :: bodies_t, contact_history_t, contacts_t, force_part_t, wp
         class(force_part_t), intent(in) :: self
         !> Bodies with the positions and velocities of this step
         type(bodies_t), intent(in) :: bodies
         !> Time since the last evaluation [s]; 0 at the start of a run
         real(wp), intent(in) :: dt
         !> Contacts of this step
         type(contacts_t), intent(inout) :: contacts
         !> What is remembered of the pairs
         type(contact_history_t), intent(inout) :: history
      end subroutine add
   end interface

contains

   !> Depth at which a flat contact of this part carries a load at rest [m]; as it is here, it carries none.
   real(wp) function static_depth(self, load, block, support, offset)
      class(force_part_t), intent(in) :: self
      !> Normal load per unit depth of the plane [N/m]
      real(wp), intent(in) :: load
      !> Width and height of the block, (2) [m]
      real(wp), intent(in) :: block(2)
      !> Width, at least that of the block, and thickness of the support, (2) [m]
      real(wp), intent(in) :: support(2)
      !> Distance of the two centres along the contact [m]
      real(wp), intent(in) :: offset

      associate (unused_self => self, unused_load => load, unused_block => block, unused_support => support, &
                 unused_offset => offset)
      end associate
      static_depth = 0.0_wp
   end function static_depth

   !> What is wrong with a law of this part if nothing dissipates; blank, as here: nothing
   function undamped_warning(self) result(warning)
      class(force_part_t), intent(in) :: self
      character(len=:), allocatable :: warning

      associate (unused_self => self)
      end associate
      warning = ''
   end function undamped_warning

end module polydem_force_part
