!> Choice of the instruction set of the kernels, once per run.
module polydem_choose_instruction_set
   use polydem_errors, only: error_t, input_error, raise
   use polydem_host, only: environment, processor_has
   use polydem_instruction_set, only: isa_avx2, isa_base, isa_names
   implicit none
   private
   public :: choose_instruction_set

   !> Environment variable that forces the choice
   character(len=*), parameter :: variable = 'POLYDEM_ISA'

contains

   !> Choose the widest instruction set that processor and operating system support, or that of POLYDEM_ISA.
   subroutine choose_instruction_set(isa, error)
      !> isa_base or isa_avx2
      integer, intent(out) :: isa
      !> Allocated if POLYDEM_ISA has another value, or asks for what the processor lacks
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: forced
      logical :: has_avx2

      has_avx2 = processor_has('avx2')
      isa = merge(isa_avx2, isa_base, has_avx2)
      forced = environment(variable)
      if (forced == isa_names(isa_base)) then
         isa = isa_base
      else if (forced == isa_names(isa_avx2)) then
         if (.not. has_avx2) call raise(error, input_error, variable//' is avx2, but this processor or its '// &
                                        'operating system does not support AVX2; unset it or set it to base')
      else if (forced /= 'unset' .and. forced /= '') then
         call raise(error, input_error, variable//' is '''//forced//'''; it must be base, avx2 or unset')
      end if
   end subroutine choose_instruction_set

end module polydem_choose_instruction_set
