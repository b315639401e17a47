!> Hash of a list of pairs, for the comparison of lists.
module polydem_pair_list_hash
   use polydem_hash, only: add_modulo, pair_hash
   use polydem_kinds, only: ip, lp
   use polydem_pair_list, only: pair_list_t
   implicit none
   private
   public :: list_hash

contains

   !> Sum modulo 2^64 of the hashes of all pairs, slots counted from 0
   pure integer(lp) function list_hash(pairs)
      !> List of pairs
      type(pair_list_t), intent(in) :: pairs
      integer(ip) :: k

      list_hash = 0_lp
      do k = 1_ip, pairs%n
         list_hash = add_modulo(list_hash, pair_hash(pairs%first(k) - 1_ip, pairs%second(k) - 1_ip))
      end do
   end function list_hash

end module polydem_pair_list_hash
