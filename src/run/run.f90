!> The state of a run: simulation, output files, monitor, checkpoints and time limit.
module polydem_run
   use polydem_actions, only: actions_t
   use polydem_checkpoint_fields, only: restarts_t
   use polydem_checkpoint_schedule, only: checkpoints_t
   use polydem_communicator, only: communicator_t
   use polydem_energy_balance, only: balance_t
   use polydem_folder_lock, only: folder_lock_t
   use polydem_kinds, only: dp, lp
   use polydem_line_writer, only: line_writer_t
   use polydem_log, only: log_t
   use polydem_manifest, only: manifest_t
   use polydem_monitor, only: monitor_t
   use polydem_named_values, only: named_values_t
   use polydem_provenance, only: provenance_t
   use polydem_recorder, only: recorder_t
   use polydem_restart, only: restart_state_t
   use polydem_result_files, only: default_folder
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_scene_measures, only: scene_measures_t
   use polydem_thread_choice, only: thread_choice_t
   use polydem_trajectory_writer, only: trajectory_writer_t
   implicit none
   private
   public :: run_t, run_options_t, result_folder

   !> Options of a start of the program: how to use the result of previous starts, and the time limit
   type :: run_options_t
      !> Whether to restart from the last checkpoint (--continue)
      logical :: continues = .false.
      !> Whether the settings may differ from those of that checkpoint (--changed)
      logical :: may_change = .false.
      !> Limit of the elapsed time since this start [s]; 0: no limit
      real(dp) :: limit = 0.0_dp
      !> Whether the screen shows nothing but the progress line
      logical :: is_brief = .false.
      !> Whether there is a result folder; else nothing is written
      logical :: has_files = .true.
      !> Whether the run is a guest in a program that has the screen and the signals
      logical :: is_guest = .false.
      !> Whether the next step keeps the table of contacts for this program
      logical :: tabulates = .false.
      !> Path of a file of actions (--actions); unallocated: there is none
      character(len=:), allocatable :: actions
      !> Whether actions may let bodies enter and leave
      logical :: exchanges = .false.
      !> How the number of threads is determined
      type(thread_choice_t) :: threads
   end type run_options_t

   !> State of a run
   type :: run_t
      !> Communicator of the run
      class(communicator_t), allocatable :: comm
      !> Options of this start
      type(run_options_t) :: options
      !> Warning if the ranks have more threads than there are processors; else empty
      character(len=:), allocatable :: oversubscription
      !> Whether steps may be done: the run is prepared, and has not ended
      logical :: has_begun = .false.
      !> Step at which this start of the program begins
      integer(lp) :: first_step = 0_lp
      !> Start of the program, from `wall_seconds` [s]
      real(dp) :: began = 0.0_dp
      !> State of the result folder after previous starts
      type(restart_state_t) :: previous
      !> Scene hash and counts of all restarts
      type(restarts_t) :: restarts
      !> Schedule of checkpoints
      type(checkpoints_t) :: checkpoints
      !> The simulation
      type(simulation_t) :: simulation
      !> Hash of the initial scene, in hexadecimal; allocated once `build_start` has built the simulation
      character(len=:), allocatable :: scene_hash
      !> Actions before the simulation has them
      type(actions_t), allocatable :: actions
      !> Record of the actions
      type(line_writer_t) :: action_file
      !> Whether it is open
      logical :: records_actions = .false.
      !> Whether the checkpoint after the last step is not written yet, since actions may follow
      logical :: owes_checkpoint = .false.
      !> Measures of the initial scene
      type(scene_measures_t) :: measures
      !> Writer of frames
      type(trajectory_writer_t) :: trajectory
      !> Recorder of boxes and of times of every step
      type(recorder_t) :: recorder
      !> Log on the screen and in the result folder
      type(log_t) :: log
      !> Provenance of the result
      type(provenance_t) :: provenance
      !> Energy balance at the last frame or line of the log, by name
      type(named_values_t) :: row
      !> Energy and momentum balance at the last frame or line of the log
      type(balance_t) :: balance
      !> Result folder
      character(len=:), allocatable :: folder
      !> Manifest of the result; only the root rank writes it
      type(manifest_t) :: manifest
      !> Note on how the folder was locked or where its former result is; unallocated if there is none
      character(len=:), allocatable :: folder_note
      !> Lock of the result folder; the root rank acquires it
      type(folder_lock_t) :: lock
      !> Steps between frames, not always a whole number; 0: no interval
      real(dp) :: frame_steps = 0.0_dp
      !> Steps between rows of the series, not always a whole number; 0: no series
      real(dp) :: series_steps = 0.0_dp
      !> Steps between lines of the log, not always a whole number
      real(dp) :: log_steps = 0.0_dp
      !> Monitor
      type(monitor_t) :: monitor
      !> Step of the last frame; negative if there is none
      integer(lp) :: last_frame = -1_lp
      !> Reason to end the run early, set on the root rank only; unallocated while the run continues
      character(len=:), allocatable :: reason
   end type run_t

contains

   !> Result folder: the one in the settings, or results/<name of the input without path and suffix>
   pure function result_folder(settings) result(folder)
      type(settings_t), intent(in) :: settings
      character(len=:), allocatable :: folder

      folder = settings%output%folder
      if (folder == '') folder = default_folder(settings%file)
   end function result_folder

end module polydem_run
