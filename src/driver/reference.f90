!> What the lists of pairs should be: numbers and hashes of every step, and who says so.
module polydem_reference
   use polydem_boxes, only: boxes_t
   use polydem_errors, only: error_t, raise, run_error
   use polydem_hash, only: add_modulo
   use polydem_kinds, only: ip, lp
   use polydem_list_hash, only: list_hash
   use polydem_neighbours, only: neighbours_t, new_neighbours
   use polydem_pair_list, only: pair_list_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: reference_t, new_reference, steps_of_oracle, check_number, check_list, total_hash, expect_by_oracle

   !> Up to so many boxes all pairs are compared at every step
   integer(ip), parameter :: few_boxes = 20000_ip
   !> Up to so many boxes all pairs are compared at three steps, else at one
   integer(ip), parameter :: many_boxes = 200000_ip

   !> Expected lists of all steps
   type :: reference_t
      !> Number of pairs of each step
      integer(ip), allocatable :: pairs(:)
      !> Sum of the hashes of the pairs of each step
      integer(lp), allocatable :: hash(:)
      !> Whether the number, and the hash, are known
      logical, allocatable :: knows_number(:), knows_hash(:)
      !> Steps that all_pairs vouches for
      logical, allocatable :: by_oracle(:)
      !> Who vouches for the other steps: 'the trace', or the name of a finder
      character(len=:), allocatable :: other
   end type reference_t

contains

   !> A reference that knows nothing yet
   subroutine new_reference(reference, n_steps)
      !> Reference to make
      type(reference_t), intent(out) :: reference
      !> Number of steps
      integer(ip), intent(in) :: n_steps

      allocate (reference%pairs(n_steps), source=0_ip)
      allocate (reference%hash(n_steps), source=0_lp)
      allocate (reference%knows_number(n_steps), reference%knows_hash(n_steps), source=.false.)
      allocate (reference%by_oracle(n_steps), source=.false.)
      reference%other = 'nobody'
   end subroutine new_reference

   !> The steps at which a bench compares all pairs: every one, or the last, or the first, middle and last
   pure function steps_of_oracle(n_boxes, n_steps) result(wanted)
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
   end function steps_of_oracle

   !> Let all_pairs say what the list of a step is; what was known must agree.
   subroutine expect_by_oracle(reference, step, boxes, oracle, error)
      !> Expected lists
      type(reference_t), intent(inout) :: reference
      !> Step, from 1
      integer(ip), intent(in) :: step
      !> Its boxes
      type(boxes_t), intent(in) :: boxes
      !> Finder all_pairs of the steps before, not made yet at the first call
      type(neighbours_t), intent(inout) :: oracle
      !> Allocated if the step was known to be something else
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(oracle%finder)) call new_neighbours(oracle, 'all_pairs', boxes, error)
      if (allocated(error)) return
      call oracle%update(boxes)
      call check_list(reference, step, 'all_pairs', oracle%pairs, error)
      reference%by_oracle(step) = .true.
   end subroutine expect_by_oracle

   !> Compare the number of pairs with the expected one, if that is known.
   subroutine check_number(reference, step, finder, pairs, error)
      !> Expected lists
      type(reference_t), intent(in) :: reference
      !> Step, from 1
      integer(ip), intent(in) :: step
      !> Name of the finder
      character(len=*), intent(in) :: finder
      !> Its list
      type(pair_list_t), intent(in) :: pairs
      !> Allocated if they differ; names the step, from 0
      type(error_t), allocatable, intent(inout) :: error

      if (pairs%contradictions > 0_lp) call raise(error, run_error, 'step '//to_text(step - 1_ip)//': '//finder// &
         ' reported changes that contradict its list')
      if (.not. reference%knows_number(step) .or. reference%pairs(step) == pairs%n) return
      call raise(error, run_error, 'step '//to_text(step - 1_ip)//': '//finder//' found '//to_text(pairs%n)// &
                 ' pairs, '//witness(reference, step)//' '//to_text(reference%pairs(step)))
   end subroutine check_number

   !> Compare number and hash of a list with the expected ones; where nothing is known, the list is what is expected
   !> from now on.
   subroutine check_list(reference, step, finder, pairs, error, hash)
      !> Expected lists
      type(reference_t), intent(inout) :: reference
      !> Step, from 1
      integer(ip), intent(in) :: step
      !> Name of the finder
      character(len=*), intent(in) :: finder
      !> Its list
      type(pair_list_t), intent(in) :: pairs
      !> Allocated if they differ; names the step, from 0
      type(error_t), allocatable, intent(inout) :: error
      !> Sum of the hashes of the pairs
      integer(lp), intent(out), optional :: hash
      integer(lp) :: found

      found = list_hash(pairs)
      if (present(hash)) hash = found
      call check_number(reference, step, finder, pairs, error)
      if (allocated(error)) return
      if (reference%knows_hash(step) .and. reference%hash(step) /= found) then
         call raise(error, run_error, 'step '//to_text(step - 1_ip)//': '//finder//' found as many pairs as '// &
                    trim(witness(reference, step))//' ('//to_text(pairs%n)//'), but not the same ones')
         return
      end if
      reference%pairs(step) = pairs%n
      reference%hash(step) = found
      reference%knows_number(step) = .true.
      reference%knows_hash(step) = .true.
   end subroutine check_list

   !> Sum of the hashes of all steps
   pure integer(lp) function total_hash(hash)
      !> Hash of each step
      integer(lp), intent(in) :: hash(:)
      integer :: k

      total_hash = 0_lp
      do k = 1, size(hash)
         total_hash = add_modulo(total_hash, hash(k))
      end do
   end function total_hash

   !> Who says what the list of a step is
   pure function witness(reference, step) result(text)
      type(reference_t), intent(in) :: reference
      integer(ip), intent(in) :: step
      character(len=:), allocatable :: text

      text = reference%other
      if (reference%by_oracle(step)) text = 'all_pairs'
      if (text == 'the trace') text = 'the trace says'
   end function witness

end module polydem_reference
