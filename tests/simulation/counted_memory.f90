!> Number of times that the objects of a program ask for memory. The linker leads their calls of malloc and realloc to
!> these procedures (`--wrap`).
module counted_memory
   use, intrinsic :: iso_c_binding, only: c_ptr, c_size_t
   implicit none
   private
   public :: n_requests

   !> Number of requests so far, by all threads
   integer :: requests = 0

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

   !> Number of requests so far
   integer function n_requests()
      n_requests = requests
   end function n_requests

   !> New memory
   type(c_ptr) function new_memory(bytes) bind(C, name='__wrap_malloc')
      integer(c_size_t), value :: bytes

      !$omp atomic
      requests = requests + 1
      new_memory = real_malloc(bytes)
   end function new_memory

   !> More or less memory with the same contents
   type(c_ptr) function resized_memory(former, bytes) bind(C, name='__wrap_realloc')
      type(c_ptr), value :: former
      integer(c_size_t), value :: bytes

      !$omp atomic
      requests = requests + 1
      resized_memory = real_realloc(former, bytes)
   end function resized_memory

end module counted_memory
