!> Cross product in about twice the working precision, for differences that would cancel in plain arithmetic.
module polydem_exact_cross
   use polydem_kinds, only: wp
   implicit none
   private
   public :: exact_cross

contains

   !> (end - start) x (offset + vertex - start), accurate to about one rounding error.
   !>
   !> Differences and products are split into a rounded value and its error (T. J. Dekker, Numer. Math. 18
   !> (1971) 224; D. E. Knuth, The Art of Computer Programming, vol. 2).
   pure real(wp) function exact_cross(start, end, offset, vertex)
      !> Start of the first vector [m]
      real(wp), intent(in) :: start(2)
      !> End of the first vector [m]
      real(wp), intent(in) :: end(2)
      !> First summand of the end of the second vector, which starts at `start` too [m]
      real(wp), intent(in) :: offset(2)
      !> Second summand of the end of the second vector [m]
      real(wp), intent(in) :: vertex(2)
      real(wp) :: edge(2), edge_error(2), arm(2), arm_error(2), from(2), from_error(2)
      real(wp) :: plus, plus_error, minus, minus_error

      call add(end, -start, edge, edge_error)
      call add(offset, -start, from, from_error)
      call add(from, vertex, arm, arm_error)
      arm_error = arm_error + from_error
      call multiply(edge(1), arm(2), plus, plus_error)
      call multiply(edge(2), arm(1), minus, minus_error)
      exact_cross = (plus - minus) + ((plus_error - minus_error) &
                                      + (edge(1)*arm_error(2) - edge(2)*arm_error(1)) &
                                      + (edge_error(1)*arm(2) - edge_error(2)*arm(1)))
   end function exact_cross

   !> Sum and its rounding error
   elemental subroutine add(a, b, rounded, error)
      real(wp), intent(in) :: a, b
      real(wp), intent(out) :: rounded, error
      real(wp) :: b_in_it

      rounded = a + b
      b_in_it = rounded - a
      error = (a - (rounded - b_in_it)) + (b - b_in_it)
   end subroutine add

   !> Product and its rounding error
   pure subroutine multiply(a, b, rounded, error)
      real(wp), intent(in) :: a, b
      real(wp), intent(out) :: rounded, error
      real(wp), parameter :: splitter = 2.0_wp**ishft(digits(1.0_wp) + 1, -1) + 1.0_wp
      real(wp) :: a_high, a_low, b_high, b_low

      rounded = a*b
      a_high = splitter*a - (splitter*a - a)
      a_low = a - a_high
      b_high = splitter*b - (splitter*b - b)
      b_low = b - b_high
      error = ((a_high*b_high - rounded) + a_high*b_low + a_low*b_high) + a_low*b_low
   end subroutine multiply

end module polydem_exact_cross
