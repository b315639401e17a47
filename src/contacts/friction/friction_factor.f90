!> Incomplete Cholesky factor of the mobilities among the contacts off their bounds.
!>
!> The factor L D L' approximates h W restricted to these contacts. It preconditions conjugate gradients, which then
!> need a quarter of the iterations in a dense drum. The columns are in the order of the contact table. A column holds
!> the later contacts that share a body with its contact; elimination adds entries between these neighbours (fill of
!> the first level) while there is room. All other fill is dropped, and its magnitude is added to the diagonal of both
!> contacts: this adds a positive semidefinite matrix, so that all pivots stay positive (A. Jennings & G.M. Malik,
!> J. Inst. Math. Appl. 20 (1977) 307).
!>
!> Large networks are cut into pieces of the contact table, which threads share; couplings between pieces are dropped.
!> The pieces do not depend on the number of threads.
!>
!> A body with many contacts would couple each of them with all others. Its couplings are dropped: such a body is
!> heavy, so that they are weak.
module polydem_friction_factor
   use polydem_contact_incidence, only: incidence_t
   use polydem_friction_network, only: friction_network_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: friction_factor_t, build_factor, apply_factor

   !> Contacts of a piece
   integer(ip), parameter :: piece_size = 16384_ip
   !> Couplings through bodies with more contacts are dropped
   integer(ip), parameter :: most_contacts = 16_ip
   !> Greatest number of entries in a column, and entries that are solved together
   integer(ip), parameter :: most_entries = 12_ip, group = 4_ip
   !> Pivots below this share of the mobility are rounding errors of dependent contacts
   real(wp), parameter :: least_pivot = 1.0e-3_wp

   !> Columns of the factor, each with room for `most_entries`, and the same entries packed for solving
   type :: friction_factor_t
      private
      !> Number of contacts
      integer(ip) :: n = 0_ip
      !> Contacts of the entries of each column, (entry, contact)
      integer(ip), allocatable :: contact(:, :)
      !> Entries below the diagonal of L, (entry, contact)
      real(wp), allocatable :: lower(:, :)
      !> Number of entries of each column, and number of those that are neighbours, (contact)
      integer(ip), allocatable :: n_entries(:), n_near(:)
      !> Reciprocal diagonal of D, (contact) [N/m per m/s]
      real(wp), allocatable :: inverse_pivot(:)
      !> Column, contacts and entries of each group, (entry, group); missing entries are 0 and of the column
      integer(ip), allocatable :: owner(:), packed_contact(:, :)
      real(wp), allocatable :: packed(:, :)
      !> Last group of each piece
      integer(ip), allocatable :: last_group(:)
   end type friction_factor_t

contains

   !> Factorise the mobilities of the contacts whose force is below its limit.
   subroutine build_factor(network, incidence, force, factor)
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      !> Tangential force of each contact [N/m]
      real(wp), intent(in), contiguous :: force(:)
      type(friction_factor_t), intent(inout) :: factor
      integer(ip) :: k, low, high

      call reserve(network%n, factor)
      !$omp parallel do if (network%n > piece_size) schedule(static) default(none) &
      !$omp    shared(network, incidence, force, factor) private(k, low, high)
      do k = 1_ip, pieces_of(network%n)
         low = (k - 1_ip)*piece_size + 1_ip
         high = min(k*piece_size, network%n)
         call fill_columns(network, incidence, force, low, high, factor)
         call eliminate(low, high, network%mobility, factor%n_entries, factor%n_near, factor%contact, factor%lower, &
                        factor%inverse_pivot)
         call pack_columns(k, low, high, factor)
      end do
      !$omp end parallel do
   end subroutine build_factor

   !> Solve L D L' z = r. The threads of a parallel region share the work.
   subroutine apply_factor(factor, residual, solution)
      type(friction_factor_t), intent(in) :: factor
      !> Right-hand side r, (contact) [m/s]; 0 for contacts at their bounds
      real(wp), intent(in), contiguous :: residual(:)
      !> Solution z, (contact) [N/m]
      real(wp), intent(inout), contiguous :: solution(:)
      integer(ip) :: k

      !$omp do schedule(static)
      do k = 1_ip, pieces_of(factor%n)
         call solve_piece(factor, (k - 1_ip)*piece_size + 1_ip, min(k*piece_size, factor%n), &
                          first_group(k), factor%last_group(k), residual, solution)
      end do
      !$omp end do
   end subroutine apply_factor

   !> Solve for the contacts low to high of a piece, whose groups are first to last.
   pure subroutine solve_piece(factor, low, high, first, last, residual, solution)
      type(friction_factor_t), intent(in) :: factor
      integer(ip), intent(in) :: low, high, first, last
      real(wp), intent(in), contiguous :: residual(:)
      real(wp), intent(inout), contiguous :: solution(:)
      real(wp) :: value
      integer(ip) :: g, m

      solution(low:high) = residual(low:high)
      associate (contact => factor%packed_contact, lower => factor%packed, owner => factor%owner)
         do g = first, last
            value = solution(owner(g))
            do m = 1_ip, group
               solution(contact(m, g)) = solution(contact(m, g)) - lower(m, g)*value
            end do
         end do
         solution(low:high) = solution(low:high)*factor%inverse_pivot(low:high)
         do g = last, first, -1_ip
            value = (lower(1, g)*solution(contact(1, g)) + lower(2, g)*solution(contact(2, g))) &
               + (lower(3, g)*solution(contact(3, g)) + lower(4, g)*solution(contact(4, g)))
            solution(owner(g)) = solution(owner(g)) - value
         end do
      end associate
   end subroutine solve_piece

   !> Set the columns of a piece to the mobilities.
   pure subroutine fill_columns(network, incidence, force, low, high, factor)
      type(friction_network_t), intent(in) :: network
      type(incidence_t), intent(in) :: incidence
      real(wp), intent(in), contiguous :: force(:)
      integer(ip), intent(in) :: low, high
      type(friction_factor_t), intent(inout) :: factor
      integer(ip) :: body, c, k, q, side

      associate (start_first => incidence%start_first, start_second => incidence%start_second)
         do c = low, high
            factor%n_entries(c) = 0_ip
            factor%n_near(c) = 0_ip
            factor%contact(:, c) = 0_ip
            factor%inverse_pivot(c) = network%mobility(c)
            if (.not. abs(force(c)) < network%limit(c)) cycle
            do side = 1_ip, 2_ip
               body = network%body(side, c)
               if (.not. network%inverse(1, body) > 0.0_wp) cycle
               if ((start_first(body + 1_ip) - start_first(body)) &
                   + (start_second(body + 1_ip) - start_second(body)) > most_contacts) cycle
               do k = start_second(body), start_second(body + 1_ip) - 1_ip
                  q = incidence%contact(k)
                  if (q > c .and. q <= high) call add_neighbour(network, force, c, q, body, factor)
               end do
               do q = max(c + 1_ip, start_first(body)), min(high, start_first(body + 1_ip) - 1_ip)
                  call add_neighbour(network, force, c, q, body, factor)
               end do
            end do
         end do
      end associate
   end subroutine fill_columns

   !> Add the coupling of contacts c and q through a body to the column of c, if q is off its bounds.
   pure subroutine add_neighbour(network, force, c, q, body, factor)
      type(friction_network_t), intent(in) :: network
      real(wp), intent(in), contiguous :: force(:)
      integer(ip), intent(in) :: c, q, body
      type(friction_factor_t), intent(inout) :: factor
      real(wp) :: coupling
      integer(ip) :: side_c, side_q, place

      if (.not. abs(force(q)) < network%limit(q)) return
      side_c = merge(1_ip, 2_ip, network%body(1, c) == body)
      side_q = merge(1_ip, 2_ip, network%body(1, q) == body)
      coupling = network%inverse(1, body)*(network%row(1, c)*network%row(1, q) + network%row(2, c)*network%row(2, q)) &
         + network%inverse(2, body)*network%row(2_ip + side_c, c)*network%row(2_ip + side_q, q)
      if (side_c /= side_q) coupling = -coupling
      call find_place(q, .true., factor%n_entries(c), factor%contact(:, c), factor%lower(:, c), place)
      if (place == 0_ip) return
      factor%lower(place, c) = factor%lower(place, c) + coupling
      factor%n_near(c) = factor%n_entries(c)
   end subroutine add_neighbour

   !> Find the place of contact q in a column, a new one with a zero if it has none. The place is 0 if there is no room.
   pure subroutine find_place(q, may_add, n, contact, lower, place)
      integer(ip), intent(in) :: q
      !> Whether a new place may be taken
      logical, intent(in) :: may_add
      !> Number of entries, and their contacts; 0 beyond
      integer(ip), intent(inout) :: n, contact(most_entries)
      !> Entries
      real(wp), intent(inout) :: lower(most_entries)
      integer(ip), intent(out) :: place
      integer(ip) :: m

      place = 0_ip
      do m = 1_ip, most_entries
         place = max(place, merge(m, 0_ip, contact(m) == q))
      end do
      if (place > 0_ip .or. .not. may_add .or. n == most_entries) return
      n = n + 1_ip
      contact(n) = q
      lower(n) = 0.0_wp
      place = n
   end subroutine find_place

   !> Eliminate the contacts low to high one after the other.
   pure subroutine eliminate(low, high, mobility, n, n_near, contact, lower, inverse_pivot)
      integer(ip), intent(in) :: low, high
      real(wp), intent(in) :: mobility(high)
      !> Number of entries of each column, and of those that are neighbours
      integer(ip), intent(inout) :: n(high)
      integer(ip), intent(in) :: n_near(high)
      !> Contacts and values of the entries; the values change from mobilities to those of the factor
      integer(ip), intent(inout) :: contact(most_entries, high)
      real(wp), intent(inout) :: lower(most_entries, high)
      !> Mobilities, changed to the reciprocal diagonal of D
      real(wp), intent(inout) :: inverse_pivot(high)
      real(wp) :: share, change
      integer(ip) :: a, b, c, place, r, s

      do c = low, high
         if (.not. inverse_pivot(c) > least_pivot*mobility(c)) inverse_pivot(c) = mobility(c)
         inverse_pivot(c) = 1.0_wp/inverse_pivot(c)
         do a = 1_ip, n(c)
            share = lower(a, c)*inverse_pivot(c)
            inverse_pivot(contact(a, c)) = inverse_pivot(contact(a, c)) - share*lower(a, c)
            do b = a + 1_ip, n(c)
               r = min(contact(a, c), contact(b, c))
               s = max(contact(a, c), contact(b, c))
               change = -share*lower(b, c)
               call find_place(s, b <= n_near(c), n(r), contact(:, r), lower(:, r), place)
               if (place > 0_ip) then
                  lower(place, r) = lower(place, r) + change
               else
                  inverse_pivot([r, s]) = inverse_pivot([r, s]) + abs(change)
               end if
            end do
         end do
         lower(1:n(c), c) = lower(1:n(c), c)*inverse_pivot(c)
      end do
   end subroutine eliminate

   !> Pack the entries of piece k.
   pure subroutine pack_columns(k, low, high, factor)
      integer(ip), intent(in) :: k, low, high
      type(friction_factor_t), intent(inout) :: factor
      integer(ip) :: c, from, g, n

      g = first_group(k) - 1_ip
      do c = low, high
         do from = 0_ip, factor%n_entries(c) - 1_ip, group
            g = g + 1_ip
            n = min(group, factor%n_entries(c) - from)
            factor%owner(g) = c
            factor%packed_contact(:, g) = c
            factor%packed(:, g) = 0.0_wp
            factor%packed_contact(1:n, g) = factor%contact(from + 1_ip:from + n, c)
            factor%packed(1:n, g) = factor%lower(from + 1_ip:from + n, c)
         end do
      end do
      factor%last_group(k) = g
   end subroutine pack_columns

   !> Number of pieces of n contacts
   pure integer(ip) function pieces_of(n)
      integer(ip), intent(in) :: n

      pieces_of = (n + piece_size - 1_ip)/piece_size
   end function pieces_of

   !> First group of piece k
   pure integer(ip) function first_group(k)
      integer(ip), intent(in) :: k

      first_group = (k - 1_ip)*piece_size*(most_entries/group) + 1_ip
   end function first_group

   !> Allocate the arrays for n contacts.
   subroutine reserve(n, factor)
      integer(ip), intent(in) :: n
      type(friction_factor_t), intent(inout) :: factor
      integer(ip) :: m

      factor%n = n
      if (allocated(factor%owner)) then
         if (size(factor%n_near) >= n) return
      end if
      factor = friction_factor_t(n=n)
      m = n + n/4_ip + 16_ip
      allocate (factor%contact(most_entries, m), factor%lower(most_entries, m), factor%n_entries(m), factor%n_near(m), &
                factor%inverse_pivot(m), factor%last_group(pieces_of(m)))
      m = m*(most_entries/group)
      allocate (factor%owner(m), factor%packed_contact(group, m), factor%packed(group, m))
   end subroutine reserve

end module polydem_friction_factor
