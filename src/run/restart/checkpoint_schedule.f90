!> The schedule of a run: when it writes a checkpoint, and when a signal or the limit of elapsed time ends it early.
!>
!> Clocks are monotonic, so setting the date has no effect. The schedule polls for signals at most 20 times per second.
module polydem_checkpoint_schedule
   use polydem_checkpoint_fields, only: restarts_t, serialize_run
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_clock, only: wall_seconds
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_row_distribution, only: row_distribution_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_log, only: log_t
   use polydem_ownership, only: order_bodies, order_pieces, order_vertices
   use polydem_provenance, only: provenance_t
   use polydem_result_files, only: checkpoint_path, n_checkpoints
   use polydem_settings, only: checkpoint_settings_t
   use polydem_signals, only: await_signals, caught_signal, release_signals
   use polydem_simulation, only: simulation_t
   use polydem_simulation_counters, only: collect_counts
   use polydem_strings, only: decimal, to_text
   use polydem_time_limit, only: time_limit_t
   use polydem_wall_forces, only: complete_wall_forces
   implicit none
   private
   public :: checkpoints_t

   !> Schedule and statistics of the checkpoints of a run
   type :: checkpoints_t
      !> Step of the last checkpoint; negative if there is none
      integer(lp) :: last_step = -1_lp
      !> Number of the file that the next checkpoint overwrites, which holds the oldest one
      integer(ip) :: next = 1_ip
      !> Number of checkpoints written since this start
      integer(ip) :: n = 0_ip
      !> Elapsed time of all checkpoints since this start, and of the slowest one [s]
      real(dp) :: seconds = 0.0_dp, longest = 0.0_dp
      !> Steps between checkpoints: from the number of steps, and from the simulated time; 0: not used
      integer(lp), private :: steps(2) = 0_lp
      !> Elapsed time between checkpoints [s]
      real(dp), private :: interval = huge(1.0_dp)
      !> Time of the last checkpoint, or start of the program [s]
      real(dp), private :: last_time = 0.0_dp
      !> Time at which the program should end [s]
      real(dp), private :: deadline = huge(1.0_dp)
      !> Whether signals end the run
      logical, private :: heeds_signals = .true.
      !> Time of the last call of `decide`, and of the next poll for signals [s]
      real(dp), private :: last_check = 0.0_dp, next_poll = 0.0_dp
   contains
      procedure :: open => open_checkpoints
      procedure :: decide
      procedure :: write => write_checkpoint
      procedure :: close => close_checkpoints
   end type checkpoints_t

   !> Least time between polls for signals [s]
   real(dp), parameter :: poll_interval = 0.05_dp
   !> Fraction of the time limit that a run uses; the rest is for closing its files
   real(dp), parameter :: used_fraction = 0.99_dp

contains

   !> Start the schedule of a run.
   subroutine open_checkpoints(self, settings, dt, began, limit, heeds_signals)
      class(checkpoints_t), intent(inout) :: self
      !> Settings of the group &checkpoint
      type(checkpoint_settings_t), intent(in) :: settings
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Start of the program, from `wall_seconds` [s]
      real(dp), intent(in) :: began
      !> Limit of the elapsed time since this start [s]; 0: no limit
      real(dp), intent(in) :: limit
      !> Whether signals end the run
      logical, intent(in) :: heeds_signals

      self%heeds_signals = heeds_signals
      self%steps(1) = int(settings%steps, lp)
      if (settings%interval > 0.0_wp) self%steps(2) = max(1_lp, nint(min(settings%interval/dt, 1.0e15_wp), lp))
      if (settings%wall_interval > 0.0_wp) self%interval = real(settings%wall_interval, dp)
      if (limit > 0.0_dp) self%deadline = began + used_fraction*limit
      self%last_time = began
      self%last_check = wall_seconds()
      if (heeds_signals) call await_signals()
   end subroutine open_checkpoints

   !> Decide at the end of a step whether a checkpoint is due, and whether the run must end after it.
   subroutine decide(self, step, is_due, reason)
      class(checkpoints_t), intent(inout) :: self
      !> Number of completed steps
      integer(lp), intent(in) :: step
      !> Whether a checkpoint is due
      logical, intent(out) :: is_due
      !> Reason to end the run: name of a signal (as SIGTERM) or '--walltime'; unallocated if the run continues
      character(len=:), allocatable, intent(out) :: reason
      character(len=:), allocatable :: signal
      real(dp) :: now
      integer :: k

      now = wall_seconds()
      is_due = now - self%last_time >= self%interval
      do k = 1, size(self%steps)
         if (self%steps(k) > 0_lp) is_due = is_due .or. mod(step, self%steps(k)) == 0_lp
      end do
      if (self%heeds_signals .and. now >= self%next_poll) then
         signal = caught_signal()
         if (signal /= '') reason = 'SIG'//signal
         self%next_poll = now + poll_interval
      end if
      ! The next call comes one step later, and a checkpoint must still be written after it.
      if (now + (now - self%last_check) + self%longest >= self%deadline) reason = '--walltime'
      self%last_check = now
      is_due = (is_due .or. allocated(reason)) .and. step /= self%last_step
   end subroutine decide

   !> Write a checkpoint over the older of the last two; collective.
   subroutine write_checkpoint(self, folder, provenance, comm, simulation, restarts, error)
      class(checkpoints_t), intent(inout) :: self
      !> Result folder
      character(len=*), intent(in) :: folder
      type(provenance_t), intent(in) :: provenance
      class(communicator_t), intent(inout) :: comm
      !> The simulation at the end of a step
      type(simulation_t), intent(inout) :: simulation
      type(restarts_t), intent(inout) :: restarts
      !> Allocated if the checkpoint cannot be written; the last two are then unchanged
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(time_limit_t) :: limit
      integer(lp) :: room
      real(dp) :: began

      began = wall_seconds()
      call find_room(comm, simulation, room)
      if (comm%size > 1_ip) call limit%set(checkpoint_path(folder, self%next), comm%rank, room)
      call file%create(checkpoint_path(folder, self%next), provenance, comm, room)
      if (.not. allocated(file%error)) call lay_out_rows(comm, simulation, file)
      call complete_wall_forces(comm, simulation%search%neighbours%pairs%first, simulation%loop%walls, &
                                simulation%bodies)
      call collect_counts(simulation)
      call serialize_run(file, simulation, restarts)
      call file%complete(error)
      call limit%lift()
      if (allocated(error)) return
      self%last_step = simulation%step
      self%next = modulo(self%next, n_checkpoints) + 1_ip
      self%last_time = wall_seconds()
      self%last_check = self%last_time
      self%n = self%n + 1_ip
      self%seconds = self%seconds + (self%last_time - began)
      self%longest = max(self%longest, self%last_time - began)
   end subroutine write_checkpoint

   !> Find an upper bound of the size of a checkpoint [B]. A body takes 230 bytes, a vertex 16 bytes, and each of the
   !> three or four pairs of a body 40 bytes; the bound also covers the arrays of Gear's scheme. Collective.
   subroutine find_room(comm, simulation, room)
      class(communicator_t), intent(inout) :: comm
      type(simulation_t), intent(in) :: simulation
      !> The bound, equal on all ranks
      integer(lp), intent(out) :: room
      integer(lp) :: n_vertices(1)

      n_vertices = size(simulation%bodies%pieces%vertex, 2, kind=lp)
      call comm%all_reduce_sum(n_vertices)
      room = 1000000_lp + 1000_lp*int(simulation%bodies%n_all, lp) + 16_lp*n_vertices(1)
   end subroutine find_room

   !> Set the rows of each group of a checkpoint that this rank writes; collective.
   subroutine lay_out_rows(comm, simulation, file)
      class(communicator_t), intent(inout) :: comm
      type(simulation_t), intent(in) :: simulation
      type(checkpoint_file_t), intent(inout) :: file
      type(row_distribution_t) :: rows

      associate (bodies => simulation%bodies, pairs => simulation%search%neighbours%pairs)
         call order_bodies(comm, bodies, rows)
         call file%set_rows('/bodies/', rows)
         call file%set_rows('/pieces/', rows)
         call order_vertices(comm, bodies, rows)
         call file%set_rows('/vertices/', rows)
         call order_pieces(comm, bodies, pairs%first(:pairs%n), pairs%second(:pairs%n), rows)
         call file%set_rows('/pairs/', rows)
      end associate
   end subroutine lay_out_rows

   !> End the schedule, and write the number and times of the checkpoints to the log.
   subroutine close_checkpoints(self, log)
      class(checkpoints_t), intent(inout) :: self
      type(log_t), intent(inout) :: log

      if (self%heeds_signals) call release_signals()
      if (self%n > 0_ip) call log%write_line('checkpoints: '//to_text(self%n)//', '// &
         decimal(1.0e3_dp*(self%seconds/real(self%n, dp)), 1)//' ms each, at most '// &
         decimal(1.0e3_dp*self%longest, 1)//' ms')
   end subroutine close_checkpoints

end module polydem_checkpoint_schedule
