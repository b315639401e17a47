!> Evaluation of a batch by the kernel for the instruction set of the processor. The bits do not depend on it.
module polydem_evaluate_batch
   use polydem_instruction_set, only: isa_avx2
   use polydem_kinds, only: ip, wp
   use polydem_lens_kernel_avx2, only: evaluate_with_avx2 => evaluate_batch
   use polydem_lens_kernel_base, only: evaluate_with_base => evaluate_batch
   use polydem_overlap_batch, only: overlap_batch_t, overlap_columns_t
   use polydem_overlap_measure, only: overlap_measure_t
   implicit none
   private
   public :: evaluate_batch

contains

   !> Evaluate the first lanes of a batch.
   pure subroutine evaluate_batch(batch, n, turned, measure, isa, columns)
      type(overlap_batch_t), intent(inout) :: batch
      !> Number of lanes
      integer(ip), intent(in) :: n
      !> Vertices of all polygons, anticlockwise, each relative to its own centre, (2, n) [m]
      real(wp), intent(in), contiguous :: turned(:, :)
      !> How the overlaps are measured
      type(overlap_measure_t), intent(in) :: measure
      !> Instruction set of the kernels
      integer, intent(in) :: isa
      !> The overlaps; these lanes are written
      type(overlap_columns_t), intent(inout) :: columns

      if (n == 0_ip) return
      if (isa == isa_avx2) then
         call evaluate_with_avx2(batch, n, turned, measure, columns)
      else
         call evaluate_with_base(batch, n, turned, measure, columns)
      end if
   end subroutine evaluate_batch

end module polydem_evaluate_batch
