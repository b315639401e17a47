!> The main program of the laboratory. It reads the command line, executes the verb and sets the exit code.
program polydem_lab
   use polydem_command_line, only: read_command_line
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_lab_command, only: lab_command_t
   use polydem_lab_verbs, only: execute
   use polydem_process, only: end_process, start_process
   implicit none

   type(lab_command_t) :: command
   type(error_t), allocatable :: error
   class(communicator_t), allocatable :: comm

   call start_process(comm, error)
   if (.not. allocated(error)) call read_command_line(command, error)
   if (.not. allocated(error)) call execute(command, comm, error)
   call end_process(comm, error)

end program polydem_lab
