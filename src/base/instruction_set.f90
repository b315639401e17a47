!> Instruction sets for which kernels are compiled (`cmake/polydem_kernel.cmake`). Results do not depend on the choice.
module polydem_instruction_set
   implicit none
   private
   public :: isa_base, isa_avx2, isa_names

   !> What every processor of the architecture has (SSE2 on x86-64)
   integer, parameter :: isa_base = 1
   !> AVX2, without fused operations
   integer, parameter :: isa_avx2 = 2
   !> Names of the instruction sets
   character(len=4), parameter :: isa_names(2) = ['base', 'avx2']
end module polydem_instruction_set
