!> Removal of walls: from a step on they meet nothing.
!>
!> Their bodies stay where they are among all bodies, so that slots, files and identifiers keep their order, but they
!> have no boxes any more (`removed` of `bodies_t`). No finder and no contact ever sees them; the pair list is built
!> anew, as after a replacement of bodies, and the other pairs keep their contact history.
!>
!> The elastic energy of the contacts with such a wall leaves with it. The energy balance takes it from its start, so
!> that no work of the elastic forces appears.
module polydem_wall_removal
   use polydem_enter_and_leave, only: find_leaving
   use polydem_errors, only: error_t
   use polydem_exact_all_reduce, only: all_reduce_exact_sums
   use polydem_exact_sum, only: exact_sum_t
   use polydem_force_sums, only: sum_energy
   use polydem_kinds, only: ip, wp
   use polydem_replace_bodies, only: hold_history, rebuild_bodies
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: participant_t, simulation_t, time_of
   use polydem_wall_energy, only: release_energy
   implicit none
   private
   public :: wall_removal_t, find_release

   !> Walls that are removed at a time
   type, extends(participant_t) :: wall_removal_t
   contains
      procedure :: change_bodies
      procedure :: serialize
   end type wall_removal_t

contains

   !> Remove the walls whose time has come.
   subroutine change_bodies(self, simulation, error)
      class(wall_removal_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error

      associate (unused => self, walls => simulation%walls)
         if (.not. walls%any_removed_at(time_of(simulation))) return
         call find_release(simulation)
         ! The contacts of bodies that leave in this step will not be known any more.
         call find_leaving(simulation)
         call release_energy(simulation%energy_balance, walls%released)
         walls%released = 0.0_wp
         call hold_history(simulation)
         where (walls%removed_at(time_of(simulation))) walls%wall%is_removed = .true.
         call rebuild_bodies(simulation, error)
      end associate
   end subroutine change_bodies

   !> Serialize which walls were removed, and the energy of those that are removed before the next step.
   subroutine serialize(self, simulation, serializer)
      class(wall_removal_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      class(serializer_t), intent(inout) :: serializer

      associate (unused => self)
      end associate
      if (.not. serializer%is_reading) call find_release(simulation)
      call simulation%walls%serialize_gates(serializer)
   end subroutine serialize

   !> Find the elastic energy of the contacts of walls that are removed before the next step, unless a restart has read
   !> it. Collective.
   subroutine find_release(self)
      !> The simulation between two steps; `released` of its walls is set
      type(simulation_t), intent(inout) :: self
      type(exact_sum_t) :: sums(1)
      logical, allocatable :: leaves(:)
      integer(ip) :: c, w

      if (.not. self%walls%has_gates() .or. self%loop%step /= self%step) return
      self%walls%released = 0.0_wp
      leaves = self%walls%removed_at(time_of(self))
      if (.not. any(leaves) .or. .not. self%loop%walls%energy_is_known) return
      associate (terms => self%loop%walls)
         do c = 1_ip, terms%n
            w = self%walls%wall_of(terms%slots(1, c))
            if (w == 0_ip) cycle
            ! The energy of a contact is divided between its two bodies.
            if (leaves(w)) call sums(1)%add(2.0_wp*terms%term(sum_energy, c))
         end do
      end associate
      call all_reduce_exact_sums(self%comm, sums)
      self%walls%released = sums(1)%value()
   end subroutine find_release

end module polydem_wall_removal
