!> Terms of contacts in the sums of forces on bodies, each with its body and the partner (see `polydem_force_sums`).
module polydem_term_list
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: term_list_t, n_terms, append_term, reserve_terms

   !> Number of rows of a term
   integer, parameter :: n_terms = 10

   !> A list of terms
   type :: term_list_t
      !> Number of terms
      integer(ip) :: n = 0_ip
      !> Slots of the body of each term and of its partner, (2, n) or longer
      integer(ip), allocatable :: slots(:, :)
      !> The terms, (n_terms, n) or longer
      real(wp), allocatable :: term(:, :)
   end type term_list_t

contains

   !> Make room for terms.
   pure subroutine reserve_terms(n, list)
      !> Number of terms in all
      integer(ip), intent(in) :: n
      type(term_list_t), intent(inout) :: list
      integer(ip), allocatable :: slots(:, :)
      real(wp), allocatable :: term(:, :)

      if (.not. allocated(list%slots)) allocate (list%slots(2, 0), list%term(n_terms, 0))
      if (n <= size(list%slots, 2)) return
      allocate (slots(2, 2_ip*n), term(n_terms, 2_ip*n))
      slots(:, :list%n) = list%slots(:, :list%n)
      term(:, :list%n) = list%term(:, :list%n)
      call move_alloc(slots, list%slots)
      call move_alloc(term, list%term)
   end subroutine reserve_terms

   !> Append a term; there must be room.
   pure subroutine append_term(slots, term, list)
      !> Slots of its body and of the partner
      integer(ip), intent(in) :: slots(2)
      !> The term
      real(wp), intent(in) :: term(n_terms)
      type(term_list_t), intent(inout) :: list

      list%n = list%n + 1_ip
      list%slots(:, list%n) = slots
      list%term(:, list%n) = term
   end subroutine append_term

end module polydem_term_list
