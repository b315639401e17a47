!> The participants of the steps of a run: the list of all kinds, and the calls of all that a run has.
module polydem_participants
   use polydem_entering_and_leaving, only: entering_and_leaving_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_loaded_walls, only: loaded_walls_t
   use polydem_moving_cell, only: moving_cell_t
   use polydem_recorded_walls, only: recorded_walls_t
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: participant_item_t, participant_t, simulation_t
   use polydem_undirected_contacts, only: undirected_contacts_t
   use polydem_wall_removal, only: wall_removal_t
   implicit none
   private
   public :: choose_participants, start_participants, change_bodies, begin_step, need_table, &
      check_contacts, need_all_ranks, follow_forces, end_step, serialize_participants

contains

   !> Make the list of those that the settings ask for, in the order in which they act.
   subroutine choose_participants(self)
      !> The simulation with walls, cell and sources; `participants` is set
      type(simulation_t), intent(inout) :: self
      type(participant_item_t), allocatable :: list(:)

      allocate (list(0))
      if (self%walls%has_gates()) call add(wall_removal_t())
      if (allocated(self%sources_and_sinks)) call add(entering_and_leaving_t())
      if (self%bodies%cell%is_sheared .or. allocated(self%bodies%cell%load)) &
         call add(moving_cell_t(needs_all_ranks=allocated(self%bodies%cell%load)))
      if (allocated(self%walls%loads)) call add(loaded_walls_t(needs_all_ranks=.true.))
      if (self%settings%output%series_interval > 0.0_wp) call add(recorded_walls_t())
      if (self%settings%overlap%degenerate == 'stop') call add(undirected_contacts_t(needs_all_ranks=.true.))
      call move_alloc(list, self%participants)

   contains

      !> Add one to the list.
      subroutine add(participant)
         class(participant_t), intent(in) :: participant
         type(participant_item_t), allocatable :: longer(:)
         integer :: k

         allocate (longer(size(list) + 1))
         do k = 1, size(list)
            call move_alloc(list(k)%participant, longer(k)%participant)
         end do
         allocate (longer(size(longer))%participant, source=participant)
         call move_alloc(longer, list)
      end subroutine add

   end subroutine choose_participants

   !> Start with the forces at time 0, or at the time of a restart. Collective.
   subroutine start_participants(self)
      type(simulation_t), intent(inout) :: self
      type(participant_item_t), allocatable :: list(:)
      integer :: k

      call move_alloc(self%participants, list)
      do k = 1, size(list)
         call list(k)%participant%start(self)
      end do
      call move_alloc(list, self%participants)
   end subroutine start_participants

   !> Let bodies enter or leave between two steps. Collective; all ranks get the same error.
   subroutine change_bodies(self, error)
      type(simulation_t), intent(inout) :: self
      !> Allocated if one of them fails
      type(error_t), allocatable, intent(inout) :: error
      type(participant_item_t), allocatable :: list(:)
      integer :: k

      call move_alloc(self%participants, list)
      do k = 1, size(list)
         if (.not. allocated(error)) call list(k)%participant%change_bodies(self, error)
      end do
      call move_alloc(list, self%participants)
   end subroutine change_bodies

   !> Begin a step. Collective; all ranks get the same error.
   subroutine begin_step(self, error)
      type(simulation_t), intent(inout) :: self
      !> Allocated if the step is impossible
      type(error_t), allocatable, intent(inout) :: error
      type(participant_item_t), allocatable :: list(:)
      integer :: k

      call move_alloc(self%participants, list)
      do k = 1, size(list)
         call list(k)%participant%begin_step(self, error)
      end do
      call move_alloc(list, self%participants)
   end subroutine begin_step

   !> Whether one of them needs the table of the contacts of this step
   pure logical function need_table(self)
      type(simulation_t), intent(in) :: self
      integer :: k

      need_table = .false.
      do k = 1, size(self%participants)
         need_table = need_table .or. self%participants(k)%participant%needs_table(self)
      end do
   end function need_table

   !> Stop the run if the contacts of a step are none to go on with. An error of one rank reaches all ranks if
   !> `need_all_ranks`.
   subroutine check_contacts(self, error)
      type(simulation_t), intent(in) :: self
      !> Names the contact; on entry an error of the step, after which nothing is done
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, size(self%participants)
         if (.not. allocated(error)) call self%participants(k)%participant%check_contacts(self, error)
      end do
   end subroutine check_contacts

   !> Whether all ranks must agree on errors before the participants act on the forces
   pure logical function need_all_ranks(self)
      type(simulation_t), intent(in) :: self
      integer :: k

      need_all_ranks = .false.
      do k = 1, size(self%participants)
         need_all_ranks = need_all_ranks .or. self%participants(k)%participant%needs_all_ranks
      end do
   end function need_all_ranks

   !> Act on the forces of a step. Collective.
   subroutine follow_forces(self, dt)
      type(simulation_t), intent(inout) :: self
      !> Time step; 0 at the start of the run [s]
      real(wp), intent(in) :: dt
      type(participant_item_t), allocatable :: list(:)
      integer :: k

      call move_alloc(self%participants, list)
      do k = 1, size(list)
         call list(k)%participant%follow_forces(self, dt)
      end do
      call move_alloc(list, self%participants)
   end subroutine follow_forces

   !> End a step. Collective.
   subroutine end_step(self)
      type(simulation_t), intent(inout) :: self
      type(participant_item_t), allocatable :: list(:)
      integer :: k

      call move_alloc(self%participants, list)
      do k = 1, size(list)
         call list(k)%participant%end_step(self)
      end do
      call move_alloc(list, self%participants)
   end subroutine end_step

   !> Write what outlives a step to a checkpoint, or read it. Collective.
   subroutine serialize_participants(self, serializer)
      type(simulation_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer
      type(participant_item_t), allocatable :: list(:)
      integer :: k

      call move_alloc(self%participants, list)
      do k = 1, size(list)
         call list(k)%participant%serialize(self, serializer)
      end do
      call move_alloc(list, self%participants)
   end subroutine serialize_participants

end module polydem_participants
