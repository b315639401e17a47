!> Start and end of a program as a process among others, and its answer to --help and --version. Only the end of a
!> program stops it.
module polydem_process
   use, intrinsic :: iso_c_binding, only: c_int
   use polydem_build_info, only: git_revision, program_version
   use polydem_command_line, only: command_t, usage
   use polydem_communicator, only: communicator_t
   use polydem_console, only: print_line, warn
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: start_library
   use polydem_kinds, only: ip
   use polydem_posix_processes, only: c_exit
   use polydem_process_limits, only: check_stack
   use polydem_signals, only: hold_usr1, ignore_write_signals
   use polydem_standard_streams, only: open_closed_streams
   use polydem_world_communicator, only: create_world
   implicit none
   private
   public :: start_process, end_process, answer_question

contains

   !> Prepare streams, signals and libraries, and meet the other ranks. A stack that is too small ends the program.
   subroutine start_process(comm, error)
      class(communicator_t), allocatable, intent(out) :: comm
      type(error_t), allocatable, intent(inout) :: error

      call hold_usr1()
      call open_closed_streams()
      call ignore_write_signals()
      call check_stack(1_ip, error)
      if (allocated(error)) then
         call warn(error%message)
         call c_exit(int(error%code, c_int))
      end if
      ! HDF5 must outlive MPI and is therefore started first.
      call start_library(error)
      call create_world(comm, error)
   end subroutine start_process

   !> Print an error and end the program with its code.
   subroutine end_process(comm, error)
      class(communicator_t), intent(inout) :: comm
      !> What went wrong, if anything did
      type(error_t), allocatable, intent(in) :: error

      if (allocated(error) .and. comm%is_root()) call warn(error%message)
      call comm%finalize()
      if (allocated(error)) call c_exit(int(error%code, c_int))
   end subroutine end_process

   !> Print the help or the version that a command line asks for.
   subroutine answer_question(command, comm, error)
      class(command_t), intent(in) :: command
      class(communicator_t), intent(in) :: comm
      type(error_t), allocatable, intent(inout) :: error

      if (.not. comm%is_root()) return
      if (command%help) then
         call print_line(usage(command), error)
      else
         call print_line('polydem '//program_version//' (git '//git_revision//')', error)
      end if
   end subroutine answer_question

end module polydem_process
