!> Changes the set of bodies between two steps: some leave, others enter.
!>
!> This is a restart in memory. The bodies that stay are packed with their state, and unpacked together with the new
!> ones; the pairs keep their contact history until the next step finds them again. What depends on the bodies is built
!> anew, as in a restart from a checkpoint (`rebuild_bodies`). On several ranks the next step redistributes the bodies.
!>
!> Slots and global indices change; identifiers do not, and none is used twice. The caller tells the energy balance what
!> the bodies bring and take (`polydem_changed_bodies`); the channels of new bodies begin as at time 0.
module polydem_replace_bodies
   use polydem_bodies, only: bodies_t, greatest_identifier, piece_identifiers, turn_bodies
   use polydem_bodies_in_cell, only: set_cell
   use polydem_body_fields, only: serialize_bodies
   use polydem_changed_bodies, only: start_entering
   use polydem_communicator, only: communicator_t
   use polydem_energy_balance, only: energy_balance_t
   use polydem_errors, only: error_t, raise, run_error
   use polydem_field_sums, only: accelerate_by_fields
   use polydem_force_sums, only: begin_sums, force_sums_t, total_forces
   use polydem_guard, only: set_global_limits
   use polydem_kinds, only: ip, lp
   use polydem_local_data, only: rebuild_local_data
   use polydem_migration_buffer, only: migration_buffer_t
   use polydem_ownership, only: owns_body
   use polydem_packed_bodies, only: join_packed, pack_bodies, packed_bodies_t
   use polydem_packed_history, only: pack_pairs
   use polydem_packed_state, only: pack_state, packed_state_t, unpack_state
   use polydem_simulation, only: simulation_t, time_of
   use polydem_sort, only: ascending_order, place_in
   use polydem_strings, only: to_text
   implicit none
   private
   public :: replace_bodies, rebuild_bodies, hold_history

contains

   !> Remove bodies, and add others, before a step. Collective; all ranks get the same error.
   subroutine replace_bodies(self, kept, added, error)
      !> The simulation between two steps; a checkpoint must not follow before the next step
      type(simulation_t), intent(inout) :: self
      !> Whether each body stays, (slot); the same on all ranks for a fixed body, and not read for bodies in the halo
      logical, intent(in) :: kept(:)
      !> New bodies as `new_bodies` makes them: the free ones of this rank, and all fixed ones. They get the next
      !> identifiers and, if free, the acceleration of all forces but those of contacts. On return they are unchanged
      !> otherwise
      type(bodies_t), intent(inout) :: added
      !> Allocated if there are no identifiers left
      type(error_t), allocatable, intent(inout) :: error
      type(packed_state_t) :: packed
      type(packed_bodies_t) :: new
      type(migration_buffer_t) :: columns
      type(energy_balance_t) :: entering
      integer(ip), allocatable :: removed(:), slots(:)
      integer(ip) :: s

      associate (last => self%bodies%last_id, greatest => greatest_identifier(self%bodies%pieces%most))
         if (last > greatest - added%n_all) call raise(error, run_error, 'step '//to_text(self%step)//': there are '// &
            'no identifiers for '//to_text(added%n_all)//' more bodies behind '//to_text(last)//': '// &
            to_text(greatest)//' is the greatest, with up to '//to_text(self%bodies%pieces%most)//' pieces of a '// &
            'body, and none is used twice. Give the bodies of the start lower ones, from 1')
      end associate
      call self%comm%all_reduce_error(error)
      if (allocated(error)) return
      call list_removed(self%comm, self%bodies, kept, removed)
      call hold_history(self)
      call renumber(removed, self%bodies, added)
      slots = pack([(s, s=1_ip, self%bodies%n)], kept .and. .not. self%bodies%in_halo)
      call pack_state(self, slots, added%n, packed)
      if (added%n_all > 0_ip) then
         if (allocated(self%bodies%material) .and. .not. allocated(added%material)) &
            allocate (added%material(added%n), source=0_ip)
         call added%pieces%allow(self%bodies%pieces%most)
         call set_cell(added, self%bodies%cell)
         call start_added(self, added, entering)
         slots = [(s, s=1_ip, added%n)]
         call pack_bodies(added, slots, new)
         call join_packed(packed%bodies, new)
         columns%slots = slots
         call serialize_bodies(columns, added)
      end if
      call unpack_state(self, packed, slots)
      if (added%n_all > 0_ip) then
         call columns%restore_to(slots(packed%columns%n_rows + 1_ip:))
         call serialize_bodies(columns, self%bodies)
         slots = slots(packed%columns%n_rows + 1_ip:)
         do s = 1_ip, merge(size(slots, kind=ip), 0_ip, self%settings%output%energy_balance)
            self%energy_balance%power_sum(:, slots(s)) = entering%power_sum(:, s)
            self%energy_balance%torque(slots(s)) = entering%torque(s)
            self%energy_balance%wall_sum(:, slots(s)) = entering%wall_sum(:, s)
         end do
      end if
      call rebuild_bodies(self, error)
   end subroutine replace_bodies

   !> Build anew what depends on the bodies, after their set has changed or a checkpoint was read: boxes, guards, an
   !> empty list of pairs. The ranks forget their halos. Collective; all ranks get the same error.
   subroutine rebuild_bodies(self, error)
      !> The simulation between two steps, with its bodies, walls and integrator
      type(simulation_t), intent(inout) :: self
      !> Allocated if bodies or settings are invalid
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: s

      ! The contacts are those of no step until the next one finds them.
      self%loop%step = -1_lp
      call turn_bodies(self%bodies, [(s, s=1_ip, self%bodies%n)])
      call rebuild_local_data(self, error, self%domain%median_diameter)
      call set_global_limits(self)
      call self%domain%forget_halo()
      call self%comm%all_reduce_error(error)
   end subroutine rebuild_bodies

   !> List the identifiers of the bodies of all ranks that leave, ascending. Collective.
   subroutine list_removed(comm, bodies, kept, removed)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      logical, intent(in) :: kept(:)
      integer(ip), allocatable, intent(out) :: removed(:)
      integer(lp), allocatable :: mine(:), all_of_them(:)
      integer(ip), allocatable :: counts(:)

      mine = int(pack(bodies%id, owns_body(comm%is_root(), bodies%in_halo, bodies%fixed) .and. .not. kept), lp)
      call comm%gather(mine, all_of_them, counts)
      removed = int(all_of_them(ascending_order(all_of_them)), ip)
   end subroutine list_removed

   !> Hold the contact history of the pairs until they are found again, unless it is held already. Those of bodies that
   !> leave will not be found, and end.
   subroutine hold_history(self)
      !> The simulation between two steps
      type(simulation_t), intent(inout) :: self

      if (allocated(self%received_history)) return
      allocate (self%received_history)
      associate (pairs => self%search%neighbours%pairs)
         call pack_pairs(pairs%n, pairs%first, pairs%second, piece_identifiers(self%bodies), self%history, &
                         self%received_history)
      end associate
   end subroutine hold_history

   !> Set the global indices of the bodies that stay and those of new bodies, which come last and get the next
   !> identifiers.
   subroutine renumber(removed, bodies, added)
      !> Identifiers of the bodies that leave, ascending
      integer(ip), intent(in) :: removed(:)
      type(bodies_t), intent(inout) :: bodies, added
      integer(ip) :: s

      do s = 1_ip, bodies%n
         bodies%global_index(s) = bodies%global_index(s) - (place_in(removed, bodies%id(s)) - 1_ip)
      end do
      bodies%n_all = bodies%n_all - size(removed, kind=ip)
      if (added%n_all == 0_ip) return
      added%id = bodies%last_id + added%global_index
      added%global_index = bodies%n_all + added%global_index
      bodies%n_all = bodies%n_all + added%n_all
      bodies%last_id = bodies%last_id + added%n_all
   end subroutine renumber

   !> Give new bodies the state of bodies at the end of a step that touch no other.
   subroutine start_added(self, added, entering)
      type(simulation_t), intent(in) :: self
      type(bodies_t), intent(inout) :: added
      !> Their channels of the energy balance
      type(energy_balance_t), intent(out) :: entering
      type(force_sums_t) :: sums

      associate (gravity => self%forces%gravity)
         call begin_sums(added%n, sums)
         call self%body_forces%apply(gravity, time_of(self), added, sums)
         call total_forces(gravity, sums, added)
         call self%motion%integrator%start_accelerations(gravity, added)
         if (.not. self%motion%integrator%starts_from_forces) call accelerate_by_fields(sums, added)
         if (self%settings%output%energy_balance) call start_entering(gravity, added, sums, entering)
      end associate
   end subroutine start_added

end module polydem_replace_bodies
