!> Active candidates: those that are compared in every step of an interval (`polydem_line_filter`).
module polydem_active_pairs
   use polydem_candidates, only: candidates_t
   use polydem_kinds, only: bp, ip
   implicit none
   private
   public :: active_pairs_t

   !> Active candidates
   type, extends(candidates_t) :: active_pairs_t
      !> Number of each active candidate in the list of all candidates, (active candidate)
      integer(ip), allocatable :: owner(:)
      !> Number of candidates that are active because a gap is close to zero at the start of the interval; the others
      !> are active because of their motion
      integer(ip) :: n_close = 0_ip
      !> Number of candidates that surely overlap
      integer(ip) :: n_sure = 0_ip
   contains
      procedure :: reserve
      procedure :: append
      procedure :: remove
      procedure :: write_back
   end type active_pairs_t

contains

   !> Make room for n active candidates.
   pure subroutine reserve(self, n)
      class(active_pairs_t), intent(inout) :: self
      !> Number of candidates
      integer(ip), intent(in) :: n
      integer(ip), allocatable :: box(:, :), owner(:)
      integer(bp), allocatable :: overlap(:)
      integer(ip) :: m

      if (allocated(self%owner)) then
         if (size(self%owner) >= n) return
      end if
      m = n + n/2_ip + 64_ip
      allocate (box(2, m), owner(m), overlap(m))
      if (self%n > 0_ip) then
         box(:, 1:self%n) = self%box(:, 1:self%n)
         owner(1:self%n) = self%owner(1:self%n)
         overlap(1:self%n) = self%overlap(1:self%n)
      end if
      call move_alloc(box, self%box)
      call move_alloc(owner, self%owner)
      call move_alloc(overlap, self%overlap)
   end subroutine reserve

   !> Append a candidate.
   pure subroutine append(self, k, candidates)
      class(active_pairs_t), intent(inout) :: self
      !> Number of the candidate
      integer(ip), intent(in) :: k
      !> All candidates
      class(candidates_t), intent(in) :: candidates

      call self%reserve(self%n + 1_ip)
      self%n = self%n + 1_ip
      self%box(:, self%n) = candidates%box(:, k)
      self%overlap(self%n) = candidates%overlap(k)
      self%owner(self%n) = k
   end subroutine append

   !> Remove a candidate; the last one takes its place.
   pure subroutine remove(self, p)
      class(active_pairs_t), intent(inout) :: self
      !> Place of the candidate
      integer(ip), intent(in) :: p

      self%box(:, p) = self%box(:, self%n)
      self%overlap(p) = self%overlap(self%n)
      self%owner(p) = self%owner(self%n)
      self%n = self%n - 1_ip
   end subroutine remove

   !> Copy the states to the list of all candidates.
   pure subroutine write_back(self, candidates)
      class(active_pairs_t), intent(in) :: self
      !> All candidates
      class(candidates_t), intent(inout) :: candidates
      integer(ip) :: k

      do k = 1_ip, self%n
         candidates%overlap(self%owner(k)) = self%overlap(k)
      end do
   end subroutine write_back

end module polydem_active_pairs
