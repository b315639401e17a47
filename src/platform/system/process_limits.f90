!> Limits that the operating system imposes on this process (POSIX, Linux): stack, threads and processors.
!>
!> A process that exceeds a limit is ended by a signal or by the OpenMP library in the middle of its work. Therefore the
!> limits are checked before anything is written.
module polydem_process_limits
   use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_funloc, c_int, c_int64_t, c_loc, c_long, &
      c_null_ptr, c_ptr, c_size_t
   use omp_lib, only: omp_get_num_procs, omp_get_thread_limit
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: errno_message, last_failure
   use polydem_kinds, only: ip, lp
   use polydem_posix, only: c_close
   use polydem_posix_processes, only: c_attributes_init, c_attributes_stack, c_getaffinity, c_getrlimit, c_pipe2, &
      c_read, limit_t, pthread_create, pthread_join
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_stack, check_threads, allowed_processors, mask_words

   !> Minimum stack of the first thread [KiB]. The scenes of this project need less than 96 KiB with all finders
   integer(lp), parameter :: min_stack = 256_lp
   !> Part of this stack that the OpenMP library uses for each other thread, with a margin of a factor 2 [B]
   integer(lp), parameter :: stack_per_thread = 256_lp
   !> Minimum stack of the other threads [KiB]. The same scenes need less than 16 KiB
   integer(lp), parameter :: min_thread_stack = 64_lp
   !> Maximum number of threads per processor that the process may use
   integer(ip), parameter :: max_per_processor = 64_ip
   !> Number of words of a processor mask, which has 1024 bits
   integer, parameter :: mask_words = 1024/storage_size(0_c_long)
   !> Number of words that hold a pthread_attr_t on any Linux
   integer, parameter :: attribute_words = 16
   !> RLIMIT_STACK of getrlimit(2) on Linux
   integer(c_int), parameter :: stack_limit = 3_c_int

contains

   !> Reject a stack on which the program would crash.
   subroutine check_stack(threads, error)
      !> Number of threads, including the first one
      integer(ip), intent(in) :: threads
      !> Allocated if the stack is too small
      type(error_t), allocatable, intent(inout) :: error
      type(limit_t) :: limit
      integer(lp) :: least

      if (c_getrlimit(stack_limit, limit) /= 0_c_int) return
      least = min_stack + int(threads, lp)*stack_per_thread/1024_lp
      if (limit%soft < 0_c_int64_t .or. limit%soft >= 1024_lp*least) return
      call raise(error, input_error, 'the stack may have '//to_text(limit%soft/1024_lp)//' KiB only, but '// &
                 to_text(least)//' KiB are needed; call ulimit -s 8192 first')
   end subroutine check_stack

   !> Reject a number of threads that is unreasonable or that the system does not allow. The threads are created as a
   !> test, because the OpenMP library ends the program if it cannot create one.
   subroutine check_threads(threads, error)
      !> Number of threads, including the first one
      integer(ip), intent(in) :: threads
      !> Allocated if the number is rejected
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: stack
      integer(ip) :: processors

      processors = int(omp_get_num_procs(), ip)
      if (threads > max_per_processor*processors) then
         call raise(error, input_error, to_text(threads)//' threads are too many: this process may use '// &
                    to_text(processors)//' processors with at most '//to_text(max_per_processor)//' threads each; '// &
                    'choose fewer with --threads or OMP_NUM_THREADS')
      else if (threads > int(omp_get_thread_limit(), ip)) then
         call raise(error, input_error, to_text(threads)//' threads are too many: OMP_THREAD_LIMIT allows '// &
                    to_text(int(omp_get_thread_limit(), ip))//'; choose fewer, or raise this limit')
      end if
      if (.not. allocated(error)) call check_stack(threads, error)
      if (allocated(error) .or. threads <= 1_ip) return
      stack = thread_stack()
      if (stack > 0_lp .and. stack < 1024_lp*min_thread_stack) then
         call raise(error, input_error, 'OMP_STACKSIZE gives each thread a stack of '//to_text(stack/1024_lp)// &
                    ' KiB only, but '//to_text(min_thread_stack)//' KiB are needed; unset it')
         return
      end if
      call try_threads(threads, stack, error)
   end subroutine check_threads

   !> Create all threads but the first one, which then exist at the same time, and end them.
   subroutine try_threads(threads, stack, error)
      integer(ip), intent(in) :: threads
      !> Stack of each thread [B]; 0 for the default of the system
      integer(lp), intent(in) :: stack
      type(error_t), allocatable, intent(inout) :: error
      integer(c_long), target :: attributes(attribute_words)
      integer(c_long) :: names(threads)
      integer(c_int), target :: ends(2)
      integer(c_int) :: status, ignored
      integer(ip) :: k, n

      if (c_pipe2(ends, 0_c_int) /= 0_c_int) then
         call raise(error, input_error, 'cannot test whether the threads can be created: '//last_failure())
         return
      end if
      attributes = 0_c_long
      status = c_attributes_init(attributes)
      if (stack > 0_lp) status = c_attributes_stack(attributes, int(stack, c_size_t))
      n = 1_ip
      do while (status == 0_c_int .and. n < threads)
         status = pthread_create(names(n), c_loc(attributes), c_funloc(await_end), c_loc(ends))
         if (status == 0_c_int) n = n + 1_ip
      end do
      ! Closing this end of the pipe ends the threads.
      ignored = c_close(ends(2))
      do k = 1_ip, n - 1_ip
         ignored = pthread_join(names(k), c_null_ptr)
      end do
      ignored = c_close(ends(1))
      if (status /= 0_c_int) call raise(error, input_error, 'only '//to_text(n)//' of '//to_text(threads)// &
         ' threads can be made ('//errno_message(status)//'); choose fewer with --threads or OMP_NUM_THREADS, or '// &
         'allow more: see ulimit -u (processes), ulimit -v (memory) and OMP_STACKSIZE')
   end subroutine try_threads

   !> Main procedure of a thread that waits until the write end of a pipe is closed.
   type(c_ptr) function await_end(argument) bind(C)
      !> Address of the descriptor of the read end
      type(c_ptr), value :: argument
      integer(c_int), pointer :: descriptor
      integer(c_size_t) :: ignored
      character(kind=c_char) :: byte(1)

      call c_f_pointer(argument, descriptor)
      ignored = c_read(descriptor, byte, 1_c_size_t)
      await_end = c_null_ptr
   end function await_end

   !> Stack per thread that OMP_STACKSIZE or GOMP_STACKSIZE requests [B]; 0 if neither is set. The result is also 0 if
   !> the value is invalid: the OpenMP library then ignores it and prints a message.
   integer(lp) function thread_stack()
      character(len=*), parameter :: units = 'BKMG'
      character(len=32) :: text
      integer :: n, status, unit

      thread_stack = 0_lp
      call get_environment_variable('OMP_STACKSIZE', text, status=status)
      if (status /= 0) call get_environment_variable('GOMP_STACKSIZE', text, status=status)
      text = adjustl(text)
      n = verify(text, '0123456789') - 1
      if (status /= 0 .or. n < 1 .or. n > 15) return
      unit = 2
      if (text(n + 1:) /= '') unit = max(index(units, trim(adjustl(text(n + 1:)))), &
                                         index('bkmg', trim(adjustl(text(n + 1:)))))
      if (unit == 0) return
      read (text(:n), *) thread_stack
      if (thread_stack > huge(thread_stack)/1024_lp**(unit - 1)) thread_stack = 0_lp
      thread_stack = thread_stack*1024_lp**(unit - 1)
      ! The OpenMP library also ignores smaller values.
      if (thread_stack < 16384_lp) thread_stack = 0_lp
   end function thread_stack

   !> Mask of the processors that this thread may use, one bit each; empty if unknown
   function allowed_processors() result(mask)
      integer(lp) :: mask(mask_words)
      integer(c_long) :: words(mask_words)

      words = 0_c_long
      mask = 0_lp
      if (c_getaffinity(0_c_int, int(storage_size(words)/8*mask_words, c_size_t), words) < 0_c_int) return
      mask = int(words, lp)
   end function allowed_processors

end module polydem_process_limits
