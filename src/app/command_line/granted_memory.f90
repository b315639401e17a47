!> Memory for the program, or its end with a sentence.
!>
!> gfortran crashes where an assignment or a temporary array gets no memory. Therefore the linker leads all calls of
!> malloc and realloc in the objects of this program to these procedures (`--wrap`). They need no memory themselves.
module polydem_granted_memory
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_new_line, c_ptr, c_size_t
   use polydem_errors, only: run_error
   use polydem_posix, only: c_write, standard_error
   use polydem_posix_processes, only: c_exit_now
   implicit none
   private

   interface
      !> C malloc
      type(c_ptr) function real_malloc(bytes) bind(C, name='__real_malloc')
         import :: c_ptr, c_size_t
         integer(c_size_t), value :: bytes
      end function real_malloc

      !> C realloc
      type(c_ptr) function real_realloc(former, bytes) bind(C, name='__real_realloc')
         import :: c_ptr, c_size_t
         type(c_ptr), value :: former
         integer(c_size_t), value :: bytes
      end function real_realloc
   end interface

contains

   !> New memory.
   type(c_ptr) function new_memory(bytes) bind(C, name='__wrap_malloc')
      integer(c_size_t), value :: bytes

      new_memory = real_malloc(bytes)
      if (.not. c_associated(new_memory) .and. bytes /= 0_c_size_t) call end_process(bytes)
   end function new_memory

   !> More or less memory with the same contents.
   type(c_ptr) function resized_memory(former, bytes) bind(C, name='__wrap_realloc')
      type(c_ptr), value :: former
      integer(c_size_t), value :: bytes

      resized_memory = real_realloc(former, bytes)
      if (.not. c_associated(resized_memory) .and. bytes /= 0_c_size_t) call end_process(bytes)
   end function resized_memory

   !> Print how much memory was not granted, and end this process.
   subroutine end_process(bytes)
      integer(c_size_t), intent(in) :: bytes
      character(len=20) :: digits
      integer(c_size_t) :: rest
      integer :: k

      rest = bytes
      do k = len(digits), 1, -1
         digits(k:k) = achar(iachar('0') + int(modulo(rest, 10_c_size_t)))
         rest = rest/10_c_size_t
         if (rest == 0_c_size_t) exit
      end do
      call put('polydem: there is not enough memory: ')
      call put(digits(k:))
      call put(' bytes more were asked for and not granted. Use fewer bodies or more ranks, or allow more memory: '// &
               'see ulimit -v'//c_new_line)
      call c_exit_now(int(run_error, c_int))
   end subroutine end_process

   !> Write a text to standard error.
   subroutine put(text)
      character(len=*), intent(in) :: text
      character(kind=c_char) :: letters(len(text))
      integer(c_size_t) :: ignored
      integer :: k

      do k = 1, len(text)
         letters(k) = text(k:k)
      end do
      ignored = c_write(standard_error, letters, len(text, kind=c_size_t))
   end subroutine put

end module polydem_granted_memory
