!> What stands behind the handles of the C interface: an error, and a simulation with its run.
!>
!> A call enters a simulation and leaves it. In between it alone may use it: a second thread gets an error. The number
!> of OpenMP threads of the caller is put back when a call leaves.
module polydem_handles
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, c_long, c_null_char, c_ptr
   use omp_lib, only: omp_get_max_threads, omp_set_num_threads
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, lp, wp
   use polydem_run, only: run_t
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: error_handle_t, simulation_handle_t, snapshot_t, enter, leave, find_error, fortran_text, give_text

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
      !> The array that was asked for last: its name, its values, and the numbers of values per row
      character(len=:), allocatable :: name
      real(wp), allocatable :: reals(:)
      integer(lp), allocatable :: integers(:)
      !> Number of calls that are in the simulation
      integer, private :: n_inside = 0
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

   !> Find the error behind a handle, and clear it. A null handle gives a null pointer.
   subroutine find_error(handle, found)
      !> A `polydem_error`
      type(c_ptr), intent(in) :: handle
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
      type(simulation_handle_t), pointer, intent(out) :: found
      !> Allocated if the simulation cannot be used now
      type(error_t), allocatable, intent(inout) :: error
      integer :: n_inside

      nullify (found)
      if (.not. c_associated(handle)) then
         call raise(error, input_error, 'the simulation is closed')
         return
      end if
      call c_f_pointer(handle, found)
      if (found%process < 0_c_int) found%process = c_getpid()
      !$omp atomic capture
      found%n_inside = found%n_inside + 1
      n_inside = found%n_inside
      !$omp end atomic
      if (n_inside > 1) then
         call raise(error, input_error, 'another thread uses the simulation; each thread needs its own')
      else if (found%process /= c_getpid()) then
         call raise(error, input_error, 'the simulation belongs to the process that this one was forked from; make '// &
                    'another one here')
      end if
      if (allocated(error)) then
         call step_out(found)
         nullify (found)
         return
      end if
      found%former_threads = omp_get_max_threads()
      call omp_set_num_threads(found%threads)
   end subroutine enter

   !> Leave a simulation.
   subroutine leave(found)
      type(simulation_handle_t), intent(inout) :: found

      call omp_set_num_threads(found%former_threads)
      call step_out(found)
   end subroutine leave

   !> One call less is in the simulation.
   subroutine step_out(found)
      type(simulation_handle_t), intent(inout) :: found

      !$omp atomic update
      found%n_inside = found%n_inside - 1
   end subroutine step_out

   !> The text of a C string; empty for a null pointer
   function fortran_text(text) result(copy)
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
