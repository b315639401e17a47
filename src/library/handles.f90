!> What stands behind the handles of the C interface: an error, and a simulation with its run.
!>
!> A call enters a simulation and leaves it. In between it alone may use it: a second thread gets an error. The number
!> of OpenMP threads of the caller is put back when a call leaves.
module polydem_handles
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, c_long, c_null_char, c_ptr
   use omp_lib, only: omp_get_max_threads, omp_init_lock, omp_lock_kind, omp_set_num_threads, omp_test_lock, &
      omp_unset_lock
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: lp, wp
   use polydem_run, only: run_t
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: error_handle_t, simulation_handle_t, snapshot_t, own, enter, leave, find_error, fortran_text, give_text

   !> What stands behind a `polydem_error`
   type :: error_handle_t
      !> The error of the last call; unallocated if it succeeded
      type(error_t), allocatable :: error
   end type error_handle_t

   !> What stands behind a `polydem_simulation`
   type :: simulation_handle_t
      !> Settings as they were read
      type(settings_t) :: settings
      !> The run
      type(run_t) :: run
      !> Number of OpenMP threads
      integer :: threads = 1
      !> Why the run has stopped before its end; unallocated if it goes on or has ended
      type(error_t), allocatable :: failure
      !> Values of the array that was asked for last, if they are real numbers
      real(wp), allocatable :: reals(:)
      !> Likewise, if they are whole numbers
      integer(lp), allocatable :: integers(:)
      !> Held by the call that is in the simulation
      integer(omp_lock_kind), private :: lock
      !> Identifier of the process that made it
      integer(c_int), private :: process = -1_c_int
      !> Number of OpenMP threads of the caller
      integer, private :: former_threads = 1
   end type simulation_handle_t

   !> A state to which a simulation can return
   type :: snapshot_t
      !> The simulation between two steps
      type(simulation_t) :: simulation
   end type snapshot_t

   interface
      !> Identifier of this process (POSIX)
      integer(c_int) function c_getpid() bind(C, name='getpid')
         import :: c_int
      end function c_getpid

      !> Length of a C string (C standard)
      integer(c_long) function c_strlen(text) bind(C, name='strlen')
         import :: c_long, c_ptr
         type(c_ptr), value :: text
      end function c_strlen
   end interface

contains

   !> Give a new handle its process and its lock.
   subroutine own(made, threads)
      !> The handle
      type(simulation_handle_t), intent(inout) :: made
      !> Number of OpenMP threads
      integer, intent(in) :: threads

      made%threads = max(1, threads)
      made%process = c_getpid()
      call omp_init_lock(made%lock)
   end subroutine own

   !> Find the error behind a handle, and clear it. A null handle gives a null pointer.
   subroutine find_error(handle, found)
      !> A `polydem_error`
      type(c_ptr), intent(in) :: handle
      !> The error
      type(error_handle_t), pointer, intent(out) :: found

      nullify (found)
      if (.not. c_associated(handle)) return
      call c_f_pointer(handle, found)
      if (allocated(found%error)) deallocate (found%error)
   end subroutine find_error

   !> Enter a simulation. Without success `found` is null, and nothing needs to be left.
   subroutine enter(handle, found, error)
      !> A `polydem_simulation`
      type(c_ptr), intent(in) :: handle
      !> The simulation
      type(simulation_handle_t), pointer, intent(out) :: found
      !> Allocated if the simulation cannot be used now
      type(error_t), allocatable, intent(inout) :: error

      nullify (found)
      if (.not. c_associated(handle)) then
         call raise(error, input_error, 'the simulation is closed')
         return
      end if
      call c_f_pointer(handle, found)
      if (found%process /= c_getpid()) then
         call raise(error, input_error, 'the simulation belongs to the process that this one was forked from; make '// &
                    'another one here')
      else if (.not. omp_test_lock(found%lock)) then
         call raise(error, input_error, 'another thread uses the simulation; each thread needs its own')
      end if
      if (allocated(error)) then
         nullify (found)
         return
      end if
      found%former_threads = omp_get_max_threads()
      call omp_set_num_threads(found%threads)
   end subroutine enter

   !> Leave a simulation.
   subroutine leave(found)
      !> The simulation, entered
      type(simulation_handle_t), intent(inout) :: found

      call omp_set_num_threads(found%former_threads)
      call omp_unset_lock(found%lock)
   end subroutine leave

   !> The text of a C string; empty for a null pointer
   function fortran_text(text) result(copy)
      !> The C string
      type(c_ptr), intent(in) :: text
      character(len=:), allocatable :: copy
      character(kind=c_char), pointer :: letters(:)
      integer :: k, n

      copy = ''
      if (.not. c_associated(text)) return
      n = int(c_strlen(text))
      call c_f_pointer(text, letters, [n])
      copy = repeat(' ', n)
      do k = 1, n
         copy(k:k) = letters(k)
      end do
   end function fortran_text

   !> Copy a text to a C string of limited size, which ends with a null character; give its whole length.
   function give_text(text, buffer, size) result(length)
      !> The text
      character(len=*), intent(in) :: text
      !> Where it goes; may be null if `size` is 0
      type(c_ptr), intent(in) :: buffer
      !> Room in characters, that of the null character included
      integer(c_long), intent(in) :: size
      integer(c_long) :: length
      character(kind=c_char), pointer :: letters(:)
      integer :: k, n

      length = len(text, kind=c_long)
      if (size < 1_c_long .or. .not. c_associated(buffer)) return
      call c_f_pointer(buffer, letters, [size])
      n = int(min(length, size - 1_c_long))
      do k = 1, n
         letters(k) = text(k:k)
      end do
      letters(n + 1) = c_null_char
   end function give_text

end module polydem_handles
