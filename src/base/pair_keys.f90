!> Keys: two indices in one word, which sort by the first and then by the second.
module polydem_pair_keys
   use polydem_kinds, only: ip, lp
   implicit none
   private
   public :: pair_key, first_of, second_of

contains

   !> Key of two indices
   elemental integer(lp) function pair_key(first, second)
      !> Indices, not negative
      integer(ip), intent(in) :: first, second

      pair_key = ior(shiftl(int(first, lp), 32), int(second, lp))
   end function pair_key

   !> First index of a key
   elemental integer(ip) function first_of(key)
      !> A key
      integer(lp), intent(in) :: key

      first_of = int(shiftr(key, 32), ip)
   end function first_of

   !> Second index of a key
   elemental integer(ip) function second_of(key)
      !> A key
      integer(lp), intent(in) :: key

      second_of = int(iand(key, int(huge(1_ip), lp)), ip)
   end function second_of

end module polydem_pair_keys
