!> The C interface, whose contract is polydem.h: errors, and making, advancing, copying and ending simulations.
module polydem_library
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_loc, c_long, c_null_ptr, &
      c_ptr
   use polydem_build_info, only: program_version
   use polydem_clock, only: wall_seconds
   use polydem_communicator, only: choose_communicator, communicator_t
   use polydem_errors, only: error_t, input_error, raise, stopped_early
   use polydem_handles, only: enter, error_handle_t, find_error, fortran_text, give_text, leave, own, &
      simulation_handle_t, snapshot_t
   use polydem_kinds, only: dp, ip
   use polydem_read_settings, only: read_settings, read_settings_text
   use polydem_run_simulation, only: end_run, interrupt_run, is_over, start_run, take_step
   use polydem_time_step, only: tabulate_contacts
   use polydem_world_communicator, only: adopt_communicator
   implicit none
   private

   !> Values of `mode` in `polydem_new_simulation`
   integer(c_int), parameter :: mode_force = 1_c_int, mode_continue = 2_c_int, mode_exchange = 4_c_int

contains

   !> Version of polydem.
   function polydem_version(buffer, size) bind(C) result(length)
      !> Where it goes
      type(c_ptr), value :: buffer
      !> Room in characters
      integer(c_long), value :: size
      integer(c_long) :: length

      length = give_text(program_version, buffer, size)
   end function polydem_version

   !> Make an error handle.
   function polydem_new_error() bind(C) result(handle)
      type(c_ptr) :: handle
      type(error_handle_t), pointer :: made

      allocate (made)
      handle = c_loc(made)
   end function polydem_new_error

   !> Delete an error handle.
   subroutine polydem_delete_error(handle) bind(C)
      type(c_ptr), intent(inout) :: handle
      type(error_handle_t), pointer :: found

      if (.not. c_associated(handle)) return
      call c_f_pointer(handle, found)
      deallocate (found)
      handle = c_null_ptr
   end subroutine polydem_delete_error

   !> Code of the error of the last call; 0 if it succeeded.
   function polydem_error_code(handle) bind(C) result(code)
      type(c_ptr), value :: handle
      integer(c_int) :: code
      type(error_handle_t), pointer :: found

      code = 0_c_int
      if (.not. c_associated(handle)) return
      call c_f_pointer(handle, found)
      if (allocated(found%error)) code = int(found%error%code, c_int)
   end function polydem_error_code

   !> Message of the error of the last call.
   function polydem_error_message(handle, buffer, size) bind(C) result(length)
      type(c_ptr), value :: handle
      !> Where it goes
      type(c_ptr), value :: buffer
      !> Room in characters
      integer(c_long), value :: size
      integer(c_long) :: length
      type(error_handle_t), pointer :: found

      length = 0_c_long
      if (.not. c_associated(handle)) return
      call c_f_pointer(handle, found)
      if (allocated(found%error)) then
         length = give_text(found%error%message, buffer, size)
      else
         length = give_text('', buffer, size)
      end if
   end function polydem_error_message

   !> Make a simulation of this process and prepare its first step.
   function polydem_new_simulation(error, file, text, n_overrides, overrides, folder, mode, threads) bind(C) &
      result(handle)
      type(c_ptr), value :: error
      !> Path or name, and text of the namelist
      type(c_ptr), value :: file, text
      !> Number of overrides
      integer(c_long), value :: n_overrides
      !> Pointers to the overrides
      type(c_ptr), value :: overrides
      !> Folder of the result
      type(c_ptr), value :: folder
      !> What becomes of a result that is in the folder, and whether bodies may enter and leave
      integer(c_int), value :: mode
      !> Number of OpenMP threads
      integer(c_int), value :: threads
      type(c_ptr) :: handle
      type(error_handle_t), pointer :: e
      class(communicator_t), allocatable :: comm

      handle = c_null_ptr
      call find_error(error, e)
      if (.not. associated(e)) return
      call choose_communicator(comm)
      call make_simulation(comm, file, text, n_overrides, overrides, folder, mode, threads, handle, e%error)
   end function polydem_new_simulation

   !> Make a simulation of several processes.
   function polydem_new_simulation_on_ranks(error, communicator, file, text, n_overrides, overrides, folder, mode, &
                                            threads) bind(C) result(handle)
      type(c_ptr), value :: error
      !> Fortran handle of their communicator
      integer(c_int), value :: communicator
      !> Path or name, and text of the namelist
      type(c_ptr), value :: file, text
      !> Number of overrides
      integer(c_long), value :: n_overrides
      !> Pointers to the overrides
      type(c_ptr), value :: overrides
      !> Folder of the result
      type(c_ptr), value :: folder
      !> What becomes of a result that is in the folder, and whether bodies may enter and leave
      integer(c_int), value :: mode
      !> Number of OpenMP threads
      integer(c_int), value :: threads
      type(c_ptr) :: handle
      type(error_handle_t), pointer :: e
      class(communicator_t), allocatable :: comm

      handle = c_null_ptr
      call find_error(error, e)
      if (.not. associated(e)) return
      call adopt_communicator(int(communicator), c_associated(folder), comm, e%error)
      if (.not. allocated(e%error)) call make_simulation(comm, file, text, n_overrides, overrides, folder, mode, &
                                                         threads, handle, e%error)
   end function polydem_new_simulation_on_ranks

   !> Make a simulation and prepare its first step. Collective; all ranks get the same error.
   subroutine make_simulation(comm, file, text, n_overrides, overrides, folder, mode, threads, handle, error)
      class(communicator_t), intent(inout) :: comm
      !> As of `polydem_new_simulation`
      type(c_ptr), intent(in) :: file, text
      integer(c_long), intent(in) :: n_overrides
      type(c_ptr), intent(in) :: overrides, folder
      integer(c_int), intent(in) :: mode, threads
      !> The simulation; null after an error
      type(c_ptr), intent(inout) :: handle
      type(error_t), allocatable, intent(inout) :: error
      type(simulation_handle_t), pointer :: made, self
      character(len=:), allocatable :: words(:)

      allocate (made)
      call own(made, int(threads))
      made%run%options%is_guest = .true.
      made%run%options%has_files = c_associated(folder)
      made%run%options%continues = mod(mode, 4_c_int) == mode_continue
      made%run%options%exchanges = mode >= mode_exchange
      call gather_overrides(n_overrides, overrides, fortran_text(folder), words)
      if (c_associated(text)) then
         call read_settings_text(fortran_text(file), fortran_text(text), words, made%settings, error)
      else
         call read_settings(fortran_text(file), words, made%settings, error)
      end if
      call comm%all_reduce_error(error)
      if (.not. allocated(error)) then
         call enter(c_loc(made), self, error)
         call start_run(made%settings, mod(mode, 4_c_int) == mode_force, made%run, error, comm)
         if (allocated(error)) then
            call end_quietly(made)
         else if (.not. made%run%has_begun) then
            call raise(error, input_error, made%run%folder//': the run is finished; resume it with a longer '// &
                       'integrate.duration, or read its result')
         end if
         call leave(made)
      end if
      if (allocated(error)) then
         deallocate (made)
      else
         handle = c_loc(made)
      end if
   end subroutine make_simulation

   !> End a run of which an error has been reported already.
   subroutine end_quietly(self)
      type(simulation_handle_t), intent(inout) :: self
      type(error_t), allocatable :: known

      allocate (known)
      known%message = ''
      call end_run(self%run, known)
   end subroutine end_quietly

   !> Gather the overrides, and the folder as one of them.
   subroutine gather_overrides(n, overrides, folder, words)
      integer(c_long), intent(in) :: n
      !> Pointers to C strings, n of them
      type(c_ptr), intent(in) :: overrides
      !> Folder of the result; empty: there is none
      character(len=*), intent(in) :: folder
      !> The overrides
      character(len=:), allocatable, intent(out) :: words(:)
      type(c_ptr), pointer :: texts(:)
      character(len=:), allocatable :: own
      integer :: k, longest, number

      own = 'output.folder='//folder
      number = 0
      if (c_associated(overrides)) number = int(n)
      if (number > 0) call c_f_pointer(overrides, texts, [number])
      longest = len(own)
      do k = 1, number
         longest = max(longest, len(fortran_text(texts(k))))
      end do
      allocate (character(len=longest) :: words(number + merge(1, 0, folder /= '')))
      do k = 1, number
         words(k) = fortran_text(texts(k))
      end do
      if (folder /= '') words(number + 1) = own
   end subroutine gather_overrides

   !> End the run of a simulation, and free it.
   subroutine polydem_delete_simulation(error, handle) bind(C)
      type(c_ptr), value :: error
      type(c_ptr), intent(inout) :: handle
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self

      call find_error(error, e)
      if (.not. associated(e) .or. .not. c_associated(handle)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      if (self%run%options%has_files) call interrupt_run(self%run, 'the host', e%error)
      call end_run(self%run, e%error)
      if (allocated(e%error)) then
         if (e%error%code == stopped_early) deallocate (e%error)
      end if
      call leave(self)
      deallocate (self)
      handle = c_null_ptr
   end subroutine polydem_delete_simulation

   !> Advance a simulation. The last of the steps keeps the table of contacts.
   function polydem_advance(error, handle, steps, seconds) bind(C) result(done)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      !> Greatest number of steps
      integer(c_long), value :: steps
      !> Elapsed time after which one more step is the last [s]; 0: no limit. Clocks of ranks differ: they have none
      real(c_double), value :: seconds
      integer(c_long) :: done
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self
      real(dp) :: began
      logical :: has_limit, is_last

      done = 0_c_long
      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      if (allocated(self%failure)) call raise(e%error, self%failure%code, 'the run has stopped: '//self%failure%message)
      began = wall_seconds()
      has_limit = seconds > 0.0_c_double .and. self%run%comm%size == 1_ip
      is_last = .false.
      do while (done < steps .and. .not. (is_last .or. is_over(self%run) .or. allocated(e%error)))
         is_last = done + 1_c_long == steps
         if (has_limit .and. .not. is_last) is_last = wall_seconds() - began >= seconds
         self%run%options%tabulates = is_last
         call take_step(self%run, e%error)
         done = done + 1_c_long
         if (allocated(e%error)) call stop_run(self, e%error)
      end do
      if (self%run%has_begun .and. .not. allocated(e%error)) then
         if (is_over(self%run)) call end_run(self%run, e%error)
      end if
      call leave(self)
   end function polydem_advance

   !> Keep why a run has stopped, and write its end.
   subroutine stop_run(self, error)
      type(simulation_handle_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error

      self%failure = error
      ! With a folder, the end of the run makes the table for its last frame.
      if (.not. self%run%options%has_files) call tabulate_contacts(self%run%simulation)
      call end_run(self%run, error)
   end subroutine stop_run

   !> Take the state of a simulation.
   function polydem_new_snapshot(error, handle) bind(C) result(snapshot)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      type(c_ptr) :: snapshot
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self
      type(snapshot_t), pointer :: made

      snapshot = c_null_ptr
      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      allocate (made)
      made%simulation = self%run%simulation
      snapshot = c_loc(made)
      call leave(self)
   end function polydem_new_snapshot

   !> Return to a state.
   subroutine polydem_restore(error, handle, snapshot) bind(C)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      type(c_ptr), value :: snapshot
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self
      type(snapshot_t), pointer :: from

      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      if (.not. c_associated(snapshot)) then
         call raise(e%error, input_error, 'the snapshot is deleted')
      else if (self%run%options%has_files) then
         call raise(e%error, input_error, 'a simulation with a folder cannot return to an earlier state, since its '// &
                    'files go on; make it without a folder')
      else
         call c_f_pointer(snapshot, from)
         if (from%simulation%settings%resolved /= self%run%simulation%settings%resolved) then
            call raise(e%error, input_error, 'the snapshot is of a simulation with other settings')
         else if (from%simulation%comm%size /= self%run%comm%size) then
            call raise(e%error, input_error, 'the snapshot is of a simulation on another number of processes')
         else
            self%run%simulation = from%simulation
            self%run%has_begun = .true.
            if (allocated(self%failure)) deallocate (self%failure)
         end if
      end if
      call leave(self)
   end subroutine polydem_restore

   !> Delete a snapshot.
   subroutine polydem_delete_snapshot(snapshot) bind(C)
      type(c_ptr), intent(inout) :: snapshot
      type(snapshot_t), pointer :: found

      if (.not. c_associated(snapshot)) return
      call c_f_pointer(snapshot, found)
      deallocate (found)
      snapshot = c_null_ptr
   end subroutine polydem_delete_snapshot

   !> Make another simulation that goes on from the state of this one, without a folder.
   function polydem_copy_simulation(error, handle) bind(C) result(copy)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      type(c_ptr) :: copy
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self, made

      copy = c_null_ptr
      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      allocate (made)
      made%settings = self%settings
      call own(made, self%threads)
      if (allocated(self%failure)) made%failure = self%failure
      made%run%options = self%run%options
      made%run%options%has_files = .false.
      made%run%has_begun = self%run%has_begun
      allocate (made%run%comm, source=self%run%comm)
      made%run%simulation = self%run%simulation
      made%run%monitor = self%run%monitor
      made%run%scene_hash = self%run%scene_hash
      made%run%frame_steps = self%run%frame_steps
      made%run%series_steps = self%run%series_steps
      made%run%log_steps = self%run%log_steps
      copy = c_loc(made)
      call leave(self)
   end function polydem_copy_simulation

end module polydem_library
