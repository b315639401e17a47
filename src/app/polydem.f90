!> The main program. It reads the command line, executes the verb and sets the exit code. No other module stops the
!> program.
program polydem
   use, intrinsic :: iso_c_binding, only: c_int
   use polydem_command_line, only: command_t, read_command_line
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: start_library
   use polydem_kinds, only: ip
   use polydem_posix_processes, only: c_exit
   use polydem_process_limits, only: check_stack
   use polydem_console, only: warn
   use polydem_signals, only: hold_usr1, ignore_write_signals
   use polydem_standard_streams, only: open_closed_streams
   use polydem_verbs, only: execute
   use polydem_world_communicator, only: create_world
   implicit none

   type(command_t) :: command
   type(error_t), allocatable :: error
   class(communicator_t), allocatable :: comm

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
   if (.not. allocated(error)) call read_command_line(command, error)
   if (.not. allocated(error)) call execute(command, comm, error)
   if (allocated(error) .and. comm%is_root()) call warn(error%message)
   call comm%finalize()
   if (allocated(error)) call c_exit(int(error%code, c_int))

end program polydem
