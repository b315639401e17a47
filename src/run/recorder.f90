!> Optional recordings of a run besides frames: a trace of the boxes of some steps, and a profile of every step.
!>
!> The recorder does nothing and takes no time unless the settings request it. Its cost belongs to no stage of the
!> profile.
module polydem_recorder
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: exists
   use polydem_finder_meter, only: finder_meter_t
   use polydem_finder_statistics, only: count_names, n_counts, n_phases, phase_names
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_log, only: log_t
   use polydem_manifest, only: manifest_t
   use polydem_pair_list_hash, only: list_hash
   use polydem_provenance, only: provenance_t
   use polydem_result_files, only: steps_name, trace_name
   use polydem_simulation, only: simulation_t
   use polydem_step_writer, only: step_writer_t, step_row_t
   use polydem_strings, only: to_text
   use polydem_timers, only: n_stages, stage_names
   use polydem_trace_writer, only: trace_writer_t
   implicit none
   private
   public :: recorder_t, check_recording, first_trace_step

   !> An active recorder
   type :: recorder_t
      private
      !> Writer of the trace of boxes
      type(trace_writer_t) :: trace
      !> First step of the trace, and number of its steps; 0: no trace
      integer(lp) :: first_step = 0_lp
      integer(ip) :: trace_steps = 0_ip
      !> Writer of times and counts of every step
      type(step_writer_t) :: steps
      !> Finder statistics up to the last step
      type(finder_meter_t) :: meter
      !> Seconds of each stage up to the last step
      real(dp) :: stage_seconds(n_stages) = 0.0_dp
      !> Times and counts of the present step
      type(step_row_t) :: row
   contains
      procedure :: open => open_recorder
      procedure :: record
      procedure :: close => close_recorder
   end type recorder_t

contains

   !> Open the recordings that the settings request, and record the present step if the trace begins with it.
   subroutine open_recorder(self, simulation, folder, provenance, log, manifest, error)
      class(recorder_t), intent(inout) :: self
      !> Simulation before its first step, or after a restart
      type(simulation_t), intent(inout) :: simulation
      !> Result folder
      character(len=*), intent(in) :: folder
      type(provenance_t), intent(in) :: provenance
      !> Log, for warnings
      type(log_t), intent(inout) :: log
      !> Manifest, which already lists the files to be written
      type(manifest_t), intent(inout) :: manifest
      type(error_t), allocatable, intent(inout) :: error

      associate (output => simulation%settings%output, boxes => simulation%search%boxes)
         self%trace_steps = output%trace_steps
         self%first_step = first_trace_step(output%trace_start, simulation%dt)
         if (self%trace_steps > 0_ip .and. simulation%step <= self%first_step) then
            if (self%first_step + int(self%trace_steps, lp) - 1_lp > simulation%n_steps) call log%write_line( &
               'warning: the run ends before the trace is complete')
            call manifest%reopen(folder//'/'//trace_name, error)
            if (.not. allocated(error)) &
               call self%trace%open(folder//'/'//trace_name, boxes%body(:boxes%n), boxes%fixed(:boxes%n), &
                                 boxes%reach(:boxes%n), simulation%dt, provenance, error)
         end if
         if (output%step_profile) then
            call manifest%reopen(folder//'/'//steps_name, error)
            if (allocated(error)) return
            call self%steps%open(folder//'/'//steps_name, stage_names, phase_names, count_names, provenance, error)
            allocate (self%row%stage(n_stages), self%row%phase(n_phases), self%row%count(n_counts))
            call self%meter%read_all(simulation%search%neighbours%finder, self%row%phase, self%row%count)
         end if
      end associate
      if (.not. allocated(error)) call record_boxes(self, simulation, manifest, error)
   end subroutine open_recorder

   !> Check that a restarted run does not interrupt a recording. A trace that is complete or begins later is fine.
   subroutine check_recording(simulation, folder, error)
      !> Simulation before its first step, or after a restart
      type(simulation_t), intent(in) :: simulation
      !> Result folder
      character(len=*), intent(in) :: folder
      !> Allocated if a recording is interrupted
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: first
      logical :: is_whole

      associate (output => simulation%settings%output, step => simulation%step)
         if (step == 0_lp) return
         if (output%step_profile) call raise(error, input_error, 'a run with step_profile in &output cannot '// &
            'resume after an interruption; start it again with --force instead of --continue')
         first = first_trace_step(output%trace_start, simulation%dt)
         if (output%trace_steps == 0_ip .or. first > step) return
         is_whole = first + int(output%trace_steps, lp) - 1_lp <= step
         if (is_whole) is_whole = exists(folder//'/'//trace_name, error)
         if (.not. is_whole) call raise(error, input_error, 'the run was interrupted while it recorded a trace '// &
            '(trace_steps in &output), and a trace cannot resume; start again with --force instead of --continue')
      end associate
   end subroutine check_recording

   !> Record the last completed step.
   subroutine record(self, simulation, manifest, error)
      class(recorder_t), intent(inout) :: self
      !> Simulation; its finder can update statistics of its state
      type(simulation_t), intent(inout) :: simulation
      type(manifest_t), intent(inout) :: manifest
      type(error_t), allocatable, intent(inout) :: error

      call record_boxes(self, simulation, manifest, error)
      if (.not. self%steps%is_open .or. allocated(error)) return
      associate (row => self%row)
         row%step = simulation%step
         row%stage = simulation%timers%total - self%stage_seconds
         self%stage_seconds = simulation%timers%total
         call self%meter%read_all(simulation%search%neighbours%finder, row%phase, row%count)
         row%pairs = simulation%search%neighbours%pairs%n
         row%contacts = simulation%loop%n_contacts
      end associate
      call self%steps%add(self%row, error)
   end subroutine record

   !> Close the recordings. A warning reports a trace with fewer steps than requested.
   subroutine close_recorder(self, log, manifest, error)
      class(recorder_t), intent(inout) :: self
      type(log_t), intent(inout) :: log
      type(manifest_t), intent(inout) :: manifest
      type(error_t), allocatable, intent(inout) :: error
      logical :: was_open(2)

      was_open = [self%trace%is_open, self%steps%is_open]
      if (self%trace%is_open) call log%write_line('warning: the run ended before the trace was complete; it holds '// &
         to_text(self%trace%n_steps)//' of '//to_text(self%trace_steps)//' steps')
      call self%trace%close(error)
      call self%steps%close(error)
      if (was_open(1)) call manifest%close_file(trace_name, error)
      if (was_open(2)) call manifest%close_file(steps_name, error)
   end subroutine close_recorder

   !> First step at or after a time
   pure integer(lp) function first_trace_step(start, dt)
      !> The time [s]
      real(wp), intent(in) :: start
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Tolerance of the rounding error of start/dt [steps]
      real(wp), parameter :: slack = 1.0e-6_wp

      first_trace_step = ceiling(min(start/dt, 1.0e15_wp) - slack, lp)
   end function first_trace_step

   !> Append the boxes of the present step to the trace, and close a complete trace.
   subroutine record_boxes(self, simulation, manifest, error)
      type(recorder_t), intent(inout) :: self
      type(simulation_t), intent(in) :: simulation
      type(manifest_t), intent(inout) :: manifest
      type(error_t), allocatable, intent(inout) :: error

      if (.not. self%trace%is_open .or. simulation%step < self%first_step) return
      associate (boxes => simulation%search%boxes, pairs => simulation%search%neighbours%pairs)
         call self%trace%add(simulation%step, boxes%bounds(:, :boxes%n), pairs%n, list_hash(pairs), error)
      end associate
      if (self%trace%n_steps < self%trace_steps) return
      call self%trace%close(error)
      call manifest%close_file(trace_name, error)
   end subroutine record_boxes

end module polydem_recorder
