!> Results of the loop over the contacts of a step. The arrays stay from step to step, so that a step allocates no
!> memory.
module polydem_loop_results
   use polydem_contact_incidence, only: incidence_t
   use polydem_contact_rows, only: contact_rows_t
   use polydem_contacts, only: contacts_t
   use polydem_force_sums, only: force_sums_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_term_list, only: term_list_t
   use polydem_contact_flags, only: flag_limits_t
   use polydem_contact_shares, only: contact_shares_t
   use polydem_wall_terms, only: wall_terms_t
   implicit none
   private
   public :: loop_results_t, range_results_t

   !> What one thread finds in its range of pairs, as sums and single values
   type :: range_results_t
      !> Terms of bodies beyond the range
      type(term_list_t) :: deferred
      !> Number of contacts that this rank owns, and of those without direction
      integer(ip) :: n_contacts = 0_ip, n_degenerate = 0_ip
      !> Lowest index in the pair list of a contact whose bodies pass through each other; 0 if there is none
      integer(ip) :: passing_pair = 0_ip
      !> Sums for a stress-controlled cell, as in `polydem_cell_load`
      integer(lp) :: virial(2, 3) = 0_lp
   end type range_results_t

   !> Results of the loop of a step, and the limits of its flags
   type :: loop_results_t
      !> Step of the loop; -1 before the first
      integer(lp) :: step = -1_lp
      !> Whether the loop keeps the table of all contacts
      logical :: has_table = .false.
      !> Results of the ranges of pairs, one per thread
      type(range_results_t), allocatable :: ranges(:)
      !> Their contacts, if the table is asked for, and those of them that are flagged
      type(contact_rows_t), allocatable :: all_of(:), flagged_of(:)
      !> Their contacts with fixed bodies
      type(wall_terms_t), allocatable :: walls_of(:)
      !> Time of the loop over each range [s]
      real(dp), allocatable :: elapsed(:)
      !> Part of all pairs up to the end of each range, (0:number of ranges)
      real(dp), allocatable :: upto(:)
      !> Number of contacts that this rank owns
      integer(ip) :: n_contacts = 0_ip
      !> Sums of the contact forces on each body
      type(force_sums_t) :: force_sums
      !> Contacts with fixed bodies
      type(wall_terms_t) :: walls
      !> Shares of contacts between the same two bodies, if the force law needs them
      type(contact_shares_t) :: shares
      !> Limits beyond which contacts are flagged
      type(flag_limits_t) :: flag_limits
      !> Contacts that are deep, degenerate or stiff
      type(contacts_t) :: flagged
      !> Lowest index in the pair list of a contact whose bodies pass through each other; 0 if there is none
      integer(ip) :: passing_pair = 0_ip
      !> Sums of the contacts of this rank for a stress-controlled cell, as in `polydem_cell_load`
      integer(lp) :: virial(2, 3) = 0_lp
      !> Contacts of each body, if the table of contacts is kept
      type(incidence_t) :: incidence
   end type loop_results_t

end module polydem_loop_results
