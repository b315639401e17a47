!> Pairs of boxes that may overlap, and whether they did when last compared.
!>
!> The list is unordered and dense, so that comparing all is one run over plain arrays. The candidates of
!> each box are linked too: entry (s, k) of `next` and `previous` belongs to box s (1 or 2) of candidate k
!> and is named by the number 2(k - 1) + s, its *link*. So dropping and adding cost the same however long
!> the list is.
module polydem_candidates
   use polydem_kinds, only: bp, dp, ip, lp, wp
   use polydem_pair_changes, only: pair_changes_t
   implicit none
   private
   public :: candidates_t, places_t, meet, overlapping

   !> Candidates that are compared in one go
   integer(ip), parameter :: block_size = 128_ip

   !> Candidates 1..n
   type :: candidates_t
      !> Number of candidates
      integer(ip) :: n = 0_ip
      !> Boxes of each, (2, candidate)
      integer(ip), allocatable :: box(:, :)
      !> 1 if they overlapped when last compared, else 0
      integer(bp), allocatable :: overlap(:)
      !> First link of each box, 0: none
      integer(ip), allocatable :: first(:)
      !> Next link of the same box, (2, candidate), 0: none
      integer(ip), allocatable :: next(:, :)
      !> Previous link of the same box, (2, candidate), 0: none
      integer(ip), allocatable :: previous(:, :)
   contains
      procedure :: start
      procedure :: add
      procedure :: compare
      procedure :: drop_parted
      procedure :: bytes
   end type candidates_t

   !> A growing list of places in some array
   type :: places_t
      !> Number of entries
      integer(ip) :: n = 0_ip
      !> Entries; may be longer than n
      integer(ip), allocatable :: at(:)
   contains
      procedure :: push
   end type places_t

contains

   !> Begin with no candidate.
   pure subroutine start(self, n_boxes)
      class(candidates_t), intent(inout) :: self
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes

      self%n = 0_ip
      allocate (self%first(n_boxes), source=0_ip)
      call reserve(self, 8_ip*n_boxes)
   end subroutine start

   !> Append a candidate.
   pure subroutine add(self, a, b, overlap)
      class(candidates_t), intent(inout) :: self
      !> One box
      integer(ip), intent(in) :: a
      !> Another box
      integer(ip), intent(in) :: b
      !> Whether they overlap
      logical, intent(in) :: overlap
      integer(ip) :: s, link, other

      call reserve(self, self%n + 1_ip)
      self%n = self%n + 1_ip
      self%box(:, self%n) = [a, b]
      self%overlap(self%n) = merge(1_bp, 0_bp, overlap)
      do s = 1_ip, 2_ip
         link = 2_ip*(self%n - 1_ip) + s
         other = self%first(self%box(s, self%n))
         self%next(s, self%n) = other
         self%previous(s, self%n) = 0_ip
         if (other /= 0_ip) self%previous(side(other), place(other)) = link
         self%first(self%box(s, self%n)) = link
      end do
   end subroutine add

   !> Compare the boxes of some candidates and record where the answer changed.
   subroutine compare(self, low, high, bounds, body, changes)
      class(candidates_t), intent(inout) :: self
      !> First candidate
      integer(ip), intent(in) :: low
      !> Last candidate
      integer(ip), intent(in) :: high
      !> Boxes, (4, box) [m]
      real(wp), intent(in), contiguous :: bounds(:, :)
      !> Body of each box
      integer(ip), intent(in) :: body(:)
      !> Changes, appended to what is there
      type(pair_changes_t), intent(inout) :: changes
      integer(ip) :: from, to, k
      integer(bp) :: differ(block_size)
      logical :: any_differ

      do from = low, high, block_size
         to = min(from + block_size - 1_ip, high)
         call compare_block(to - from + 1_ip, self%box(:, from:to), self%overlap(from:to), &
                            size(bounds, 2, ip), bounds, differ, any_differ)
         if (.not. any_differ) cycle
         do k = from, to
            if (differ(k - from + 1_ip) == 0_bp) cycle
            self%overlap(k) = 1_bp - self%overlap(k)
            call changes%record(body(self%box(1, k)), body(self%box(2, k)), &
                                2_ip*int(self%overlap(k), ip) - 1_ip)
         end do
      end do
   end subroutine compare

   !> The inner loop of every step, on arrays of explicit shape and without branches.
   pure subroutine compare_block(n, box, overlap, n_boxes, bounds, differ, any_differ)
      integer(ip), intent(in) :: n, n_boxes
      integer(ip), intent(in) :: box(2, n)
      integer(bp), intent(in) :: overlap(n)
      real(wp), intent(in) :: bounds(4, n_boxes)
      !> 1 where the answer changed, else 0
      integer(bp), intent(out) :: differ(n)
      logical, intent(out) :: any_differ
      integer(ip) :: k
      integer(bp) :: some

      do k = 1_ip, n
         differ(k) = merge(1_bp, 0_bp, overlapping(bounds(:, box(1, k)), bounds(:, box(2, k))))
      end do
      some = 0_bp
      do k = 1_ip, n
         differ(k) = ieor(differ(k), overlap(k))
         some = ior(some, differ(k))
      end do
      any_differ = some /= 0_bp
   end subroutine compare_block

   !> Drop the candidates of a box whose grown boxes do not overlap any more.
   pure subroutine drop_parted(self, i, grown, n_dropped)
      class(candidates_t), intent(inout) :: self
      !> Box whose grown box is new
      integer(ip), intent(in) :: i
      !> Grown boxes, (4, box)
      real(dp), intent(in), contiguous :: grown(:, :)
      !> Number of candidates dropped
      integer(ip), intent(out) :: n_dropped
      integer(ip) :: link, next, moved

      n_dropped = 0_ip
      link = self%first(i)
      do while (link /= 0_ip)
         next = self%next(side(link), place(link))
         if (.not. meet(grown(:, i), grown(:, self%box(3_ip - side(link), place(link))))) then
            ! The last candidate takes the place of this one, and may be the next to look at.
            moved = place(link)
            if (next /= 0_ip) then
               if (place(next) == self%n) next = 2_ip*(moved - 1_ip) + side(next)
            end if
            call drop(self, moved)
            n_dropped = n_dropped + 1_ip
         end if
         link = next
      end do
   end subroutine drop_parted

   !> Memory held [B]
   pure integer(lp) function bytes(self)
      class(candidates_t), intent(in) :: self

      bytes = 0_lp
      if (.not. allocated(self%box)) return
      bytes = (int(storage_size(self%box), lp)*(3_lp*size(self%box, kind=lp) + size(self%first, kind=lp)) + &
               int(storage_size(self%overlap), lp)*size(self%overlap, kind=lp))/8_lp
   end function bytes

   !> Drop one candidate; the last takes its place.
   pure subroutine drop(self, k)
      type(candidates_t), intent(inout) :: self
      integer(ip), intent(in) :: k
      integer(ip) :: s

      do s = 1_ip, 2_ip
         call point_at(self, self%box(s, k), self%previous(s, k), self%next(s, k), 0_ip)
      end do
      if (k /= self%n) then
         do s = 1_ip, 2_ip
            self%box(s, k) = self%box(s, self%n)
            self%next(s, k) = self%next(s, self%n)
            self%previous(s, k) = self%previous(s, self%n)
            call point_at(self, self%box(s, k), self%previous(s, k), self%next(s, k), 2_ip*(k - 1_ip) + s)
         end do
         self%overlap(k) = self%overlap(self%n)
      end if
      self%n = self%n - 1_ip
   end subroutine drop

   !> Let the neighbours in the chain of a box point at a link between them, or at each other if it is 0.
   pure subroutine point_at(self, box, previous, next, link)
      type(candidates_t), intent(inout) :: self
      integer(ip), intent(in) :: box, previous, next, link

      if (previous == 0_ip) then
         self%first(box) = merge(next, link, link == 0_ip)
      else
         self%next(side(previous), place(previous)) = merge(next, link, link == 0_ip)
      end if
      if (next /= 0_ip) self%previous(side(next), place(next)) = merge(previous, link, link == 0_ip)
   end subroutine point_at

   !> Whether a link belongs to the first or the second box of its candidate
   pure integer(ip) function side(link)
      integer(ip), intent(in) :: link

      side = 2_ip - iand(link, 1_ip)
   end function side

   !> Candidate of a link
   pure integer(ip) function place(link)
      integer(ip), intent(in) :: link

      place = shiftr(link + 1_ip, 1)
   end function place

   !> Whether two boxes share a point; without branches, since the answer is hard to predict
   pure logical function overlapping(a, b)
      !> xmin, ymin, xmax, ymax of one box [m]
      real(wp), intent(in) :: a(4)
      !> The same of another [m]
      real(wp), intent(in) :: b(4)

      overlapping = min(min(b(3) - a(1), a(3) - b(1)), min(b(4) - a(2), a(4) - b(2))) >= 0.0_wp
   end function overlapping

   !> Whether two grown boxes share a point
   pure logical function meet(a, b)
      !> xmin, ymin, xmax, ymax of one
      real(dp), intent(in) :: a(4)
      !> The same of another
      real(dp), intent(in) :: b(4)

      meet = a(1) <= b(3) .and. b(1) <= a(3) .and. a(2) <= b(4) .and. b(2) <= a(4)
   end function meet

   pure subroutine reserve(self, n)
      type(candidates_t), intent(inout) :: self
      integer(ip), intent(in) :: n
      integer(ip), allocatable :: box(:, :), next(:, :), previous(:, :)
      integer(bp), allocatable :: overlap(:)
      integer(ip) :: m

      if (allocated(self%box)) then
         if (size(self%overlap) >= n) return
      end if
      m = n + n/2_ip + 64_ip
      allocate (box(2, m), next(2, m), previous(2, m), overlap(m))
      if (self%n > 0_ip) then
         box(:, 1:self%n) = self%box(:, 1:self%n)
         next(:, 1:self%n) = self%next(:, 1:self%n)
         previous(:, 1:self%n) = self%previous(:, 1:self%n)
         overlap(1:self%n) = self%overlap(1:self%n)
      end if
      call move_alloc(box, self%box)
      call move_alloc(next, self%next)
      call move_alloc(previous, self%previous)
      call move_alloc(overlap, self%overlap)
   end subroutine reserve

   !> Append an entry.
   pure subroutine push(self, entry)
      class(places_t), intent(inout) :: self
      !> Entry to append
      integer(ip), intent(in) :: entry
      integer(ip), allocatable :: longer(:)

      if (.not. allocated(self%at)) allocate (self%at(64))
      if (self%n == size(self%at)) then
         allocate (longer(2_ip*self%n))
         longer(1:self%n) = self%at
         call move_alloc(longer, self%at)
      end if
      self%n = self%n + 1_ip
      self%at(self%n) = entry
   end subroutine push

end module polydem_candidates
