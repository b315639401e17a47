!> What one thread finds in its range of pairs, as sums and single values. The arrays stay from step to step, so that a
!> step allocates no memory.
module polydem_range_results
   use polydem_force_sums, only: term_list_t
   use polydem_kinds, only: dp, ip
   implicit none
   private
   public :: range_results_t

   !> Results of a range of pairs
   type :: range_results_t
      !> Terms of bodies beyond the range
      type(term_list_t) :: late
      !> Number of contacts that this rank owns, and of those without direction
      integer(ip) :: n_contacts = 0_ip, n_degenerate = 0_ip
      !> Lowest index in the pair list of a contact whose bodies pass through each other; 0 if there is none
      integer(ip) :: passing_pair = 0_ip
      !> Time spent in the search for overlaps and in the forces, measured for some of the blocks [s]
      real(dp) :: seconds(2) = 0.0_dp
   end type range_results_t

end module polydem_range_results
