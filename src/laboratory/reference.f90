!> Reference lists of pairs: number and hash of the pairs of every step, and their source.
module polydem_reference
   use polydem_boxes, only: boxes_t
   use polydem_errors, only: error_t, raise, run_error
   use polydem_hash, only: add_modulo
   use polydem_kinds, only: ip, lp
   use polydem_neighbours, only: neighbours_t
   use polydem_new_neighbours, only: new_neighbours
   use polydem_pair_list, only: pair_list_t
   use polydem_pair_list_hash, only: list_hash
   use polydem_strings, only: to_text
   implicit none
   private
   public :: reference_t, new_reference, all_pairs_steps, check_list, total_hash, set_by_all_pairs

   !> Greatest number of boxes for which all pairs are compared at every step
   integer(ip), parameter :: few_boxes = 20000_ip
   !> Greatest number of boxes for which all pairs are compared at three steps; for more boxes at one step
   integer(ip), parameter :: many_boxes = 200000_ip

   !> Reference lists of all steps
   type :: reference_t
      !> Hash of all recorded bounds, or of the initial state; identifies the lists
      integer(lp) :: start = 0_lp
      !> Hash of the last state of a live bench; else 0
      integer(lp) :: finish = 0_lp
      !> Number of pairs of each step, (steps)
      integer(ip), allocatable :: pairs(:)
      !> Sum of the hashes of the pairs of each step, (steps)
      integer(lp), allocatable :: hash(:)
      !> Whether number and hash of each step are known, (steps)
      logical, allocatable :: has_number(:), has_hash(:)
      !> Whether the list of each step comes from the finder all_pairs, (steps)
      logical, allocatable :: by_oracle(:)
      !> Source of the other lists: 'the trace', or the name of a finder
      character(len=:), allocatable :: other
   end type reference_t

contains

   !> Create a reference without known lists.
   subroutine new_reference(reference, n_steps)
      !> The new reference
      type(reference_t), intent(out) :: reference
      !> Number of steps
      integer(ip), intent(in) :: n_steps

      allocate (reference%pairs(n_steps), source=0_ip)
      allocate (reference%hash(n_steps), source=0_lp)
      allocate (reference%has_number(n_steps), reference%has_hash(n_steps), source=.false.)
      allocate (reference%by_oracle(n_steps), source=.false.)
      reference%other = 'nobody'
   end subroutine new_reference

   !> Steps at which a bench compares all pairs, (steps): for few boxes all, for more boxes first, middle and last, else
   !> the last
   pure function all_pairs_steps(n_boxes, n_steps) result(wanted)
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      !> Number of steps
      integer(ip), intent(in) :: n_steps
      logical :: wanted(n_steps)

      wanted = n_boxes <= few_boxes
      wanted(n_steps) = .true.
      if (n_boxes > many_boxes) return
      wanted(1) = .true.
      wanted((n_steps + 1_ip)/2_ip) = .true.
   end function all_pairs_steps

   !> Set the list of a step from the finder all_pairs; a known list must agree with it.
   subroutine set_by_all_pairs(reference, step, boxes, oracle, error)
      type(reference_t), intent(inout) :: reference
      !> Number of the step, from 1
      integer(ip), intent(in) :: step
      !> Boxes of the step
      type(boxes_t), intent(in) :: boxes
      !> Finder all_pairs after the previous steps; the first call creates it
      type(neighbours_t), intent(inout) :: oracle
      !> Allocated if a known list differs
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(oracle%finder)) call new_neighbours(oracle, 'all_pairs', boxes, error)
      if (allocated(error)) return
      call oracle%update(boxes)
      call check_list(reference, step, 'all_pairs', oracle%pairs, error)
      reference%by_oracle(step) = .true.
   end subroutine set_by_all_pairs

   !> Compare number and hash of the pairs with the reference. Where the reference is not known, the list becomes the
   !> reference.
   subroutine check_list(reference, step, finder, pairs, error, hash, only_number)
      type(reference_t), intent(inout) :: reference
      !> Number of the step, from 1
      integer(ip), intent(in) :: step
      !> Name of the finder
      character(len=*), intent(in) :: finder
      !> List of pairs of the finder
      type(pair_list_t), intent(in) :: pairs
      !> Allocated if they differ; names the step, counted from 0
      type(error_t), allocatable, intent(inout) :: error
      !> Sum of the hashes of the pairs
      integer(lp), intent(out), optional :: hash
      !> Whether to compare only the number, which takes no time; no if absent
      logical, intent(in), optional :: only_number
      integer(lp) :: found

      if (pairs%contradictions > 0_lp) call raise(error, run_error, 'step '//to_text(step - 1_ip)//': '//finder// &
         ' reported changes that contradict its list')
      if (reference%has_number(step) .and. reference%pairs(step) /= pairs%n) call raise(error, run_error, 'step '// &
         to_text(step - 1_ip)//': '//finder//' found '//to_text(pairs%n)//' pairs, expected '// &
         to_text(reference%pairs(step))//' as in '//source_of(reference, step))
      if (present(only_number)) then
         if (only_number) return
      end if
      found = list_hash(pairs)
      if (present(hash)) hash = found
      if (reference%has_hash(step) .and. reference%hash(step) /= found) call raise(error, run_error, 'step '// &
         to_text(step - 1_ip)//': '//finder//' found as many pairs as '//source_of(reference, step)//' ('// &
         to_text(pairs%n)//'), but other ones')
      if (allocated(error)) return
      reference%pairs(step) = pairs%n
      reference%hash(step) = found
      reference%has_number(step) = .true.
      reference%has_hash(step) = .true.
   end subroutine check_list

   !> Sum of the hashes of all steps modulo 2^64
   pure integer(lp) function total_hash(hash)
      !> Hash of each step, (steps)
      integer(lp), intent(in) :: hash(:)
      integer :: k

      total_hash = 0_lp
      do k = 1, size(hash)
         total_hash = add_modulo(total_hash, hash(k))
      end do
   end function total_hash

   !> Source of the list of a step
   pure function source_of(reference, step) result(text)
      type(reference_t), intent(in) :: reference
      integer(ip), intent(in) :: step
      character(len=:), allocatable :: text

      text = reference%other
      if (reference%by_oracle(step)) text = 'all_pairs'
   end function source_of

end module polydem_reference
