!> When a run saves its state, and when it ends before its time: asked to by a signal, or because the elapsed time it
!> was given is over.
!>
!> Clocks are monotonic, so that setting the date has no effect. The operating system is asked for signals some times a
!> second only.
module polydem_checkpoint
   use polydem_checkpoint_contents, only: history_t, keep_run
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_clock, only: wall_seconds
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_log, only: log_t
   use polydem_own_rows, only: lay_out_bodies, lay_out_pairs, lay_out_parts
   use polydem_provenance, only: provenance_t
   use polydem_result_folder, only: checkpoint_path, n_checkpoints
   use polydem_row_blocks, only: row_blocks_t
   use polydem_settings, only: checkpoint_settings_t
   use polydem_signals, only: await_signals, caught_signal, release_signals
   use polydem_simulation, only: collect_counts, simulation_t
   use polydem_strings, only: to_text
   use polydem_team, only: team_t
   use polydem_time_limit, only: time_limit_t
   use polydem_wall_forces, only: complete_wall_forces
   use polydem_watch, only: watch_t
   implicit none
   private
   public :: checkpoints_t

   !> The checkpoints of a run
   type :: checkpoints_t
      !> Step of the last one; negative if there is none
      integer(lp) :: last_step = -1_lp
      !> Number of the file that the next one goes to, which holds the oldest
      integer(ip) :: next = 1_ip
      !> Checkpoints of this attempt
      integer(ip) :: n = 0_ip
      !> Time they took, and the longest of them [s]
      real(dp) :: seconds = 0.0_dp, longest = 0.0_dp
      !> Steps between two, by number and by simulated time; 0: not so
      integer(lp), private :: steps(2) = 0_lp
      !> Elapsed time between two [s]
      real(dp), private :: interval = huge(1.0_dp)
      !> When the last one was written, or the attempt began [s]
      real(dp), private :: last_moment = 0.0_dp
      !> When the attempt should end [s]
      real(dp), private :: deadline = huge(1.0_dp)
      !> When `look` was last called, and when it will ask for signals again [s]
      real(dp), private :: last_look = 0.0_dp, next_question = 0.0_dp
   contains
      procedure :: open => open_checkpoints
      procedure :: look
      procedure :: write => write_checkpoint
      procedure :: close => close_checkpoints
   end type checkpoints_t

   !> Time between two questions for signals [s]
   real(dp), parameter :: question_interval = 0.05_dp
   !> Share of the elapsed time that is used; ending takes time too
   real(dp), parameter :: used_share = 0.99_dp

contains

   !> Begin to look after a run.
   subroutine open_checkpoints(self, settings, dt, began, limit)
      class(checkpoints_t), intent(inout) :: self
      !> Group &checkpoint
      type(checkpoint_settings_t), intent(in) :: settings
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> When the attempt began, by `wall_seconds` [s]
      real(dp), intent(in) :: began
      !> Elapsed time after which it must have ended [s]; 0: none
      real(dp), intent(in) :: limit

      self%steps(1) = int(settings%steps, lp)
      if (settings%interval > 0.0_wp) self%steps(2) = max(1_lp, nint(min(settings%interval/dt, 1.0e15_wp), lp))
      if (settings%elapsed > 0.0_wp) self%interval = real(settings%elapsed, dp)
      if (limit > 0.0_dp) self%deadline = began + used_share*limit
      self%last_moment = began
      self%last_look = wall_seconds()
      call await_signals()
   end subroutine open_checkpoints

   !> Whether a checkpoint is due at the end of a step, and why the run must end after it.
   subroutine look(self, step, is_due, reason)
      class(checkpoints_t), intent(inout) :: self
      !> Steps done
      integer(lp), intent(in) :: step
      !> Whether to write one
      logical, intent(out) :: is_due
      !> Who wants the run to end; not allocated if nobody does
      character(len=:), allocatable, intent(out) :: reason
      character(len=:), allocatable :: signal
      real(dp) :: now
      integer :: k

      now = wall_seconds()
      is_due = now - self%last_moment >= self%interval
      do k = 1, size(self%steps)
         if (self%steps(k) > 0_lp) is_due = is_due .or. mod(step, self%steps(k)) == 0_lp
      end do
      if (now >= self%next_question) then
         signal = caught_signal()
         if (signal /= '') reason = 'the signal '//signal
         self%next_question = now + question_interval
      end if
      ! The next look comes a step later, and after it a checkpoint has to be written.
      if (now + (now - self%last_look) + self%longest >= self%deadline) reason = '--walltime'
      self%last_look = now
      is_due = (is_due .or. allocated(reason)) .and. step /= self%last_step
   end subroutine look

   !> Write a checkpoint over the older one of the last two.
   subroutine write_checkpoint(self, folder, provenance, team, simulation, history, watch, error)
      class(checkpoints_t), intent(inout) :: self
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Where it comes from
      type(provenance_t), intent(in) :: provenance
      !> Processes of the run, all of which must call
      class(team_t), intent(inout) :: team
      !> The simulation at the end of a step
      type(simulation_t), intent(inout) :: simulation
      !> Former attempts and the present one
      type(history_t), intent(inout) :: history
      !> Guards
      type(watch_t), intent(inout) :: watch
      !> Why it could not be written; the last two are as they were
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(time_limit_t) :: limit
      real(dp) :: began

      began = wall_seconds()
      if (team%size > 1_ip) call limit%set(checkpoint_path(folder, self%next), team%rank, room_for(simulation))
      call file%create(checkpoint_path(folder, self%next), provenance, team, room_for(simulation))
      if (.not. allocated(file%error)) call lay_out_rows(team, simulation, file)
      call complete_wall_forces(team, simulation%bodies, simulation%contacts)
      call collect_counts(simulation)
      call keep_run(file, simulation, history, watch)
      call file%complete(error)
      call limit%lift()
      if (allocated(error)) return
      self%last_step = simulation%step
      self%next = modulo(self%next, n_checkpoints) + 1_ip
      self%last_moment = wall_seconds()
      self%last_look = self%last_moment
      self%n = self%n + 1_ip
      self%seconds = self%seconds + (self%last_moment - began)
      self%longest = max(self%longest, self%last_moment - began)
   end subroutine write_checkpoint

   !> Room that a checkpoint needs at most [B]: a body takes 200 bytes and its three or four pairs 40 each; Gear's
   !> scheme and walls in many boxes come on top.
   pure integer(lp) function room_for(simulation)
      type(simulation_t), intent(in) :: simulation

      room_for = 1000000_lp + 1000_lp*int(simulation%bodies%n_all, lp)
   end function room_for

   !> Say which rows of a checkpoint this process has.
   subroutine lay_out_rows(team, simulation, file)
      class(team_t), intent(inout) :: team
      type(simulation_t), intent(in) :: simulation
      type(checkpoint_file_t), intent(inout) :: file
      type(row_blocks_t) :: rows

      associate (bodies => simulation%bodies, boxes => simulation%boxes, pairs => simulation%neighbours%pairs)
         call lay_out_bodies(team, bodies, rows)
         call file%set_rows('/bodies/', rows)
         call lay_out_parts(team, bodies, boxes%body(:boxes%n), rows)
         call file%set_rows('/boxes/', rows)
         call lay_out_pairs(team, bodies, pairs%first(:pairs%n), pairs%second(:pairs%n), rows)
         call file%set_rows('/pairs/', rows)
      end associate
   end subroutine lay_out_rows

   !> End, and say how many there were.
   subroutine close_checkpoints(self, log)
      class(checkpoints_t), intent(inout) :: self
      !> Log
      type(log_t), intent(inout) :: log

      call release_signals()
      if (self%n > 0_ip) call log%write_line('checkpoints: '//to_text(self%n)//', '// &
         milliseconds(self%seconds/real(self%n, dp))//' each, at most '//milliseconds(self%longest))
   end subroutine close_checkpoints

   function milliseconds(seconds) result(text)
      real(dp), intent(in) :: seconds
      character(len=:), allocatable :: text
      character(len=24) :: buffer

      write (buffer, '(f20.1)') 1.0e3_dp*seconds
      text = trim(adjustl(buffer))//' ms'
   end function milliseconds

end module polydem_checkpoint
