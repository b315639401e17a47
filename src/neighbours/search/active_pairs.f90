!> Active candidates: those that are compared in every step of an interval (`polydem_inner_list`).
module polydem_active_pairs
   use polydem_candidates, only: candidates_t, compared_pairs_t
   use polydem_grow, only: grow
   use polydem_index_list, only: index_list_t
   use polydem_kinds, only: ip
   implicit none
   private
   public :: active_pairs_t

   !> Active candidates
   type, extends(compared_pairs_t) :: active_pairs_t
      !> Number of each active candidate in the list of all candidates, (active candidate)
      integer(ip), allocatable :: owner(:)
      !> Place of each candidate among the active ones, 0 if it is not active, (candidate)
      integer(ip), allocatable :: place(:)
      !> Number of candidates that are active because a gap is close to zero at the start of the interval; the others
      !> are active because of their motion
      integer(ip) :: n_close = 0_ip
      !> Number of candidates that surely overlap
      integer(ip) :: n_sure = 0_ip
   contains
      procedure :: reserve
      procedure :: append
      procedure :: activate
      procedure :: activate_all
      procedure :: forget
      procedure :: reserve_places
      procedure :: write_back
   end type active_pairs_t

contains

   !> Make room for n active candidates.
   pure subroutine reserve(self, n)
      class(active_pairs_t), intent(inout) :: self
      !> Number of candidates
      integer(ip), intent(in) :: n
      integer(ip) :: m

      if (allocated(self%owner)) then
         if (size(self%owner) >= n) return
      end if
      m = n + n/2_ip + 64_ip
      call grow(self%box, self%n, m)
      call grow(self%owner, self%n, m)
      call grow(self%overlap, self%n, m)
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

   !> Make a candidate active, unless it is.
   pure subroutine activate(self, k, candidates)
      class(active_pairs_t), intent(inout) :: self
      !> Number of the candidate
      integer(ip), intent(in) :: k
      !> All candidates
      class(candidates_t), intent(in) :: candidates

      call self%reserve_places(k)
      if (self%place(k) /= 0_ip) return
      call self%append(k, candidates)
      self%place(k) = self%n
   end subroutine activate

   !> Make the candidates of a list active, unless they are.
   pure subroutine activate_all(self, list, candidates)
      class(active_pairs_t), intent(inout) :: self
      !> Numbers of the candidates
      type(index_list_t), intent(in) :: list
      !> All candidates
      class(candidates_t), intent(in) :: candidates
      integer(ip) :: m

      do m = 1_ip, list%n
         call self%activate(list%at(m), candidates)
      end do
   end subroutine activate_all

   !> Take a candidate out of the active ones before it is removed.
   pure subroutine forget(self, k)
      class(active_pairs_t), intent(inout) :: self
      !> Number of the candidate
      integer(ip), intent(in) :: k
      integer(ip) :: p

      call self%reserve_places(k)
      p = self%place(k)
      if (p == 0_ip) return
      self%place(k) = 0_ip
      self%box(:, p) = self%box(:, self%n)
      self%overlap(p) = self%overlap(self%n)
      self%owner(p) = self%owner(self%n)
      if (p < self%n) self%place(self%owner(p)) = p
      self%n = self%n - 1_ip
   end subroutine forget

   !> Make room for the places of n candidates; new ones are not active.
   pure subroutine reserve_places(self, n)
      class(active_pairs_t), intent(inout) :: self
      !> Number of candidates
      integer(ip), intent(in) :: n

      if (.not. allocated(self%place)) allocate (self%place(0))
      if (n > size(self%place)) call grow(self%place, size(self%place, kind=ip), n + n/4_ip + 64_ip, 0_ip)
   end subroutine reserve_places

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
