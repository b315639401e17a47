!> Candidates: pairs of boxes that may overlap, and whether they overlapped at the last comparison.
!>
!> The comparison of all candidates is one loop over plain arrays. A list of candidates also finds those of a box. It
!> has two forms: linked lists, to which single candidates are added (`polydem_linked_candidates`), and rows, which a
!> search replaces as a whole (`polydem_candidate_rows`).
module polydem_candidates
   use polydem_index_list, only: index_list_t
   use polydem_instruction_set, only: isa_avx2, isa_base
   use polydem_kinds, only: bp, ip, lp, wp
   use polydem_line_lanes_avx2, only: find_states_avx2 => find_states
   use polydem_line_lanes_base, only: find_states
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: candidates_t, compared_pairs_t, overlapping

   !> Number of pairs that are compared at once
   integer(ip), parameter :: block_size = 128_ip

   !> Pairs of boxes and their states
   type :: compared_pairs_t
      !> Instruction set of the kernels; set before the first step
      integer :: isa = isa_base
      !> Number of pairs; a box with itself is none
      integer(ip) :: n = 0_ip
      !> Boxes of each pair, (2, pair)
      integer(ip), allocatable :: box(:, :)
      !> 1 if the boxes overlapped at the last comparison, else 0, (pair)
      integer(bp), allocatable :: overlap(:)
   contains
      procedure :: compare
      procedure :: find_states_of
   end type compared_pairs_t

   !> A list of all candidates
   type, extends(compared_pairs_t), abstract :: candidates_t
   contains
      procedure(append_of_box), deferred :: append_candidates_of
      procedure :: append_candidates_of_all
      procedure(count_bytes), deferred :: bytes
   end type candidates_t

   abstract interface
      !> Append the candidates of a box to a list.
      pure subroutine append_of_box(self, i, list)
         import :: candidates_t, index_list_t, ip
         class(candidates_t), intent(in) :: self
         !> Box
         integer(ip), intent(in) :: i
         !> Numbers of candidates
         type(index_list_t), intent(inout) :: list
      end subroutine append_of_box

      !> Allocated memory [B]
      pure integer(lp) function count_bytes(self)
         import :: candidates_t, lp
         class(candidates_t), intent(in) :: self
      end function count_bytes
   end interface

contains

   !> Compare the boxes of a range of pairs and record the pairs that begin or cease to overlap.
   subroutine compare(self, low, high, bounds, piece, changes)
      class(compared_pairs_t), intent(inout) :: self
      !> First and last pair
      integer(ip), intent(in) :: low, high
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      !> Piece of each box, (box)
      integer(ip), intent(in) :: piece(:)
      !> List of changes; the new changes are appended
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: from, to, k
      integer(bp) :: state(block_size)
      logical :: any_differ

      do from = low, high, block_size
         to = min(from + block_size - 1_ip, high)
         call self%find_states_of(to - from + 1_ip, self%box(:, from:to), bounds, state)
         call find_differences(to - from + 1_ip, self%overlap(from:to), state, any_differ)
         if (.not. any_differ) cycle
         do k = from, to
            if (state(k - from + 1_ip) == 0_bp .or. self%box(1, k) == self%box(2, k)) cycle
            self%overlap(k) = 1_bp - self%overlap(k)
            call changes%record(piece(self%box(1, k)), piece(self%box(2, k)), &
                                2_ip*int(self%overlap(k), ip) - 1_ip)
         end do
      end do
   end subroutine compare

   !> Find which pairs overlap.
   pure subroutine find_states_of(self, n, box, bounds, state)
      class(compared_pairs_t), intent(in) :: self
      !> Number of pairs
      integer(ip), intent(in) :: n
      !> Boxes of each pair, (2, pair)
      integer(ip), intent(in) :: box(2, n)
      !> Bounds of the boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      !> 1 if the boxes overlap, else 0, (pair)
      integer(bp), intent(out) :: state(n)

      if (self%isa == isa_avx2) then
         call find_states_avx2(n, box, size(bounds, 2, ip), bounds, state)
      else
         call find_states(n, box, size(bounds, 2, ip), bounds, state)
      end if
   end subroutine find_states_of

   !> Replace states by their differences from former ones, without branches.
   pure subroutine find_differences(n, before, state, any_differ)
      integer(ip), intent(in) :: n
      integer(bp), intent(in) :: before(n)
      !> 1 if the state changed, else 0
      integer(bp), intent(inout) :: state(n)
      logical, intent(out) :: any_differ
      integer(ip) :: k
      integer(bp) :: some

      some = 0_bp
      do k = 1_ip, n
         state(k) = ieor(state(k), before(k))
         some = ior(some, state(k))
      end do
      any_differ = some /= 0_bp
   end subroutine find_differences

   !> Append the candidates of several boxes to a list.
   pure subroutine append_candidates_of_all(self, boxes, list)
      class(candidates_t), intent(in) :: self
      !> The boxes
      type(index_list_t), intent(in) :: boxes
      !> Numbers of candidates
      type(index_list_t), intent(inout) :: list
      integer(ip) :: k

      do k = 1_ip, boxes%n
         call self%append_candidates_of(boxes%at(k), list)
      end do
   end subroutine append_candidates_of_all

   !> Whether two boxes share a point. The function has no branches because the result is hard to predict
   pure logical function overlapping(a, b)
      !> Bounds xmin, ymin, xmax, ymax of both boxes [m]
      real(wp), intent(in) :: a(4), b(4)

      overlapping = min(min(b(3) - a(1), a(3) - b(1)), min(b(4) - a(2), a(4) - b(2))) >= 0.0_wp
   end function overlapping

end module polydem_candidates
