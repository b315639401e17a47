!> Bodies packed with their whole state, while ranks redistribute them or the set of bodies changes: constant fields,
!> variable fields, state of the integrator and channels of the energy balance.
module polydem_packed_state
   use polydem_balance_state, only: serialize_contributions
   use polydem_body_fields, only: serialize_bodies
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: ip
   use polydem_migration_buffer, only: migration_buffer_t
   use polydem_packed_bodies, only: packed_bodies_t, all_to_all_bodies, join_packed, pack_bodies, unpack_bodies
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: packed_state_t, pack_state, send_state, join_state, unpack_state

   !> Packed bodies with their state
   type :: packed_state_t
      !> Constant fields and vertices; bodies without a state may be joined
      type(packed_bodies_t) :: bodies
      !> State of the first of these bodies
      type(migration_buffer_t) :: columns
   end type packed_state_t

contains

   !> Pack bodies of this rank with their state.
   subroutine pack_state(self, slots, room, packed)
      !> The simulation; unchanged on return
      type(simulation_t), intent(inout) :: self
      !> Slots of the bodies
      integer(ip), intent(in) :: slots(:)
      !> Number of bodies to join later, for which memory is reserved
      integer(ip), intent(in) :: room
      !> The packed bodies, in the order of the slots
      type(packed_state_t), intent(out) :: packed

      call pack_bodies(self%bodies, slots, packed%bodies, room)
      packed%columns%slots = slots
      packed%columns%room = room
      call serialize_columns(packed%columns, self)
   end subroutine pack_state

   !> Exchange packed bodies between ranks, all-to-all. Collective.
   subroutine send_state(comm, counts, packed, counts_received)
      class(communicator_t), intent(inout) :: comm
      !> Number of bodies for each rank, (0:size - 1)
      integer(ip), intent(in) :: counts(0:)
      !> Bodies in the order of their destination ranks; afterwards received bodies in the order of their source ranks
      type(packed_state_t), intent(inout) :: packed
      !> Number of bodies from each rank, (0:size - 1)
      integer(ip), allocatable, intent(out) :: counts_received(:)

      call all_to_all_bodies(comm, counts, packed%bodies, counts_received)
      call packed%columns%move(comm, counts, counts_received)
   end subroutine send_state

   !> Append packed bodies to others.
   subroutine join_state(packed, other)
      !> First part; afterwards all
      type(packed_state_t), intent(inout) :: packed
      !> Second part
      type(packed_state_t), intent(in) :: other

      call join_packed(packed%bodies, other%bodies)
      call packed%columns%append(other%columns)
   end subroutine join_state

   !> Unpack bodies, which take the place of those of this rank. The variable fields of bodies without a state are zero.
   subroutine unpack_state(self, packed, slots)
      !> The simulation; afterwards bodies, walls, integrator and energy balance are those of the packed bodies
      type(simulation_t), intent(inout) :: self
      !> Packed bodies
      type(packed_state_t), intent(inout) :: packed
      !> Slot of each packed body
      integer(ip), allocatable, intent(out) :: slots(:)

      call unpack_bodies(packed%bodies, self%bodies, slots)
      call self%walls%find_slots(self%bodies)
      call packed%columns%restore_to(slots(:packed%columns%n_rows))
      call self%motion%integrator%start(self%bodies)
      call serialize_columns(packed%columns, self)
   end subroutine unpack_state

   !> Serialize the state of the bodies, including data of the current step.
   subroutine serialize_columns(serializer, self)
      class(serializer_t), intent(inout) :: serializer
      type(simulation_t), intent(inout) :: self

      call serialize_bodies(serializer, self%bodies)
      call self%motion%integrator%serialize_step(serializer)
      if (self%settings%output%energy_balance) &
         call serialize_contributions(self%energy_balance, self%bodies%n, serializer)
      if (.not. allocated(self%relaxation%from)) return
      if (serializer%is_reading) self%relaxation%from = self%bodies%position
      call serializer%field('/bodies/from', self%relaxation%from, 'm', 'centres of mass before the relaxation')
   end subroutine serialize_columns

end module polydem_packed_state
