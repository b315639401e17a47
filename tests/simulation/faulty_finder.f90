!> A finder of one rank fails in the middle of a step; the error reaches all ranks.
!>
!>     mpirun -n 3 faulty_finder
!>
!> No output on success; otherwise a message and exit code 1. A rank that waits for the others would never end.
program faulty_finder
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: error_unit
   use invented_pair, only: invented_pair_t
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: start_library
   use polydem_posix_processes, only: c_exit
   use polydem_read_settings, only: read_settings_text
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start, only: new_simulation
   use polydem_time_step, only: advance
   use polydem_world_communicator, only: create_world
   implicit none

   !> A gas whose bodies are spread over all ranks
   character(len=*), parameter :: gas = "&scene name = 'gas' bodies = 60 solid_fraction = 0.3 speed = 1 /"// &
      '&forces gravity = 0, 0 /&integrate dt = 1e-6 duration = 1e-3 /'
   !> Another one in a load-controlled ring
   character(len=*), parameter :: ring = "&wall name = 'ring' outline = 'ring' radius = 0.1 segments = 20 "// &
      "thickness = 0.01 /&grains name = 'g' region = 'inside' wall = 'ring' number = 60 speed = 1 /"// &
      "&load name = 'l' wall = 'ring' direction = 'x' force = 1 /"// &
      '&forces gravity = 0, 0 /&integrate dt = 1e-6 duration = 1e-3 /'
   class(communicator_t), allocatable :: comm
   type(error_t), allocatable :: error

   call start_library(error)
   call create_world(comm, error)
   if (.not. allocated(error)) call fail_on_last_rank(gas, 'push', .false.)
   ! Here a contact may stop the run, so errors must be known before the step is completed.
   if (.not. allocated(error)) call fail_on_last_rank(gas, 'stop', .true.)
   ! A load needs the contacts of all ranks within the step.
   if (.not. allocated(error)) call fail_on_last_rank(ring, 'push', .true.)
   if (allocated(error)) then
      if (comm%is_root()) write (error_unit, '(a)') error%message
      call comm%finalize()
      call c_exit(1_c_int)
   end if
   call comm%finalize()

contains

   !> Do some steps, let the finder of the last rank record the end of a pair that never began, and do one more step.
   subroutine fail_on_last_rank(text, degenerate, within_step)
      !> Namelist
      character(len=*), intent(in) :: text
      !> What contacts without direction do
      character(len=*), intent(in) :: degenerate
      !> Whether all ranks must have the error when the step ends
      logical, intent(in) :: within_step
      type(settings_t) :: settings
      type(simulation_t) :: simulation
      type(error_t), allocatable :: failure
      integer :: step

      call read_settings_text('gas.nml', text, ['overlap.degenerate='//degenerate], settings, failure)
      if (.not. allocated(failure)) call new_simulation(settings, simulation, failure, comm)
      do step = 1, 3
         if (.not. allocated(failure)) call advance(simulation, failure)
         call comm%all_reduce_error(failure)
      end do
      if (allocated(failure)) then
         call move_alloc(failure, error)
         return
      end if
      if (comm%rank == comm%size - 1) &
         call simulation%search%neighbours%change_finder(invented_pair_t(), simulation%search%boxes)
      call advance(simulation, failure)
      call expect((allocated(failure) .or. comm%rank < comm%size - 1), 'the finder reports no error')
      if (within_step) call expect(allocated(failure), 'a rank does not know of the error of the step')
      call comm%all_reduce_error(failure)
      call expect(allocated(failure), 'a rank does not know of the error')
      if (allocated(error)) return
      call expect(index(failure%message, 'step 4: finder two_level reported changes that contradict') > 0, &
                  failure%message)
   end subroutine fail_on_last_rank

   !> Raise an error unless a condition holds on all ranks.
   subroutine expect(condition, message)
      logical, intent(in) :: condition
      !> What is wrong
      character(len=*), intent(in) :: message

      if (.not. condition .and. .not. allocated(error)) then
         allocate (error)
         error%message = message
      end if
      call comm%all_reduce_error(error)
   end subroutine expect

end program faulty_finder
