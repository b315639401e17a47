!> What every integrator promises.
!>
!> A step is predict, forces, correct: `predict` brings positions, angles and velocities of the free bodies to the end
!> of the step as far as the past allows; forces are computed there once; `correct` makes the final
!> state of them. While forces are computed, velocity - dt/2 acceleration is the velocity in the middle of the step, to
!> second order. Turned vertices and fixed bodies are not its business.
module polydem_integrator
   use polydem_archive, only: archive_t
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: wp
   use polydem_stable_step, only: stability_table_t
   implicit none
   private
   public :: integrator_t

   !> A time integration scheme with what it remembers
   type, abstract :: integrator_t
      !> Whether the scheme starts from the forces at time 0; else it starts from gravity alone
      logical :: starts_from_forces = .true.
   contains
      !> Prepare for bodies whose accelerations are known
      procedure(start), deferred :: start
      !> Bring the free bodies to the end of the step
      procedure(advance), deferred :: predict
      !> Make the final state from the forces
      procedure(advance), deferred :: correct
      !> Products of frequency and step that the scheme stands
      procedure(stability), deferred :: stability
      procedure :: keep
      procedure :: carry
   end type integrator_t

   abstract interface
      !> Prepare for bodies whose accelerations are known.
      subroutine start(self, bodies)
         import :: bodies_t, integrator_t
         class(integrator_t), intent(inout) :: self
         !> Bodies at the start
         type(bodies_t), intent(in) :: bodies
      end subroutine start

      !> One half of a step.
      subroutine advance(self, dt, bodies)
         import :: bodies_t, integrator_t, wp
         class(integrator_t), intent(inout) :: self
         !> Step [s]
         real(wp), intent(in) :: dt
         !> Bodies; only the free ones change
         type(bodies_t), intent(inout) :: bodies
      end subroutine advance

      !> Greatest stable product of frequency and step against the damping ratio.
      function stability(self) result(table)
         import :: integrator_t, stability_table_t
         class(integrator_t), intent(in) :: self
         type(stability_table_t) :: table
      end function stability
   end interface

contains

   !> Keep in an archive what the scheme remembers from step to step; to be replaced by schemes that remember anything.
   subroutine keep(self, archive)
      class(integrator_t), intent(inout) :: self
      !> Archive, which takes or gives back columns over /bodies
      class(archive_t), intent(inout) :: archive

      associate (no_memory => self, unused => archive)
      end associate
   end subroutine keep

   !> Let an archive take along, in the middle of a step, what `keep` keeps and what lasts from predict to correct; to
   !> be replaced by schemes that have such a thing.
   subroutine carry(self, archive)
      class(integrator_t), intent(inout) :: self
      !> Archive, which takes or gives back columns over /bodies
      class(archive_t), intent(inout) :: archive

      call self%keep(archive)
   end subroutine carry

end module polydem_integrator
