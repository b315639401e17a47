!> Size factors of the grains of a group: all lengths of a grain are multiplied by its factor.
!>
!> A distribution is the factor as a function of the share u of the grains, by number, that are smaller.
!>
!> * octaves: s = 1/sqrt(1 - u (1 - ratio**-2)). The number density is proportional to s**-3, so each octave of sizes
!>   covers the same area.
!> * log_normal: s = spread**z, where z has the standard normal distribution between -2 and 2.
!> * grading: of the area, the fraction p_i has a factor below s_i. Between two sieves the number density is
!>   proportional to s**-3, so p is a straight line over the logarithm of s.
module polydem_sizes
   use polydem_elementary, only: exponential, logarithm
   use polydem_kinds, only: ip, wp
   use polydem_settings, only: shape_settings_t
   implicit none
   private
   public :: draw_sizes, sizes_of, size_at, sizes_differ

   !> Share of the normal distribution below -2
   real(wp), parameter :: cut_share = 0.02275013194817921_wp

contains

   !> Whether the grains of a group differ in size by more than their lengths say
   pure logical function sizes_differ(group)
      !> The group
      class(shape_settings_t), intent(in) :: group

      sizes_differ = group%size_ratio > 1.0_wp .or. group%sizes == 'log_normal' .or. group%sizes == 'grading'
   end function sizes_differ

   !> Size factors of n grains in descending order, without randomness
   pure function sizes_of(group, n) result(sizes)
      !> Distribution
      class(shape_settings_t), intent(in) :: group
      !> Number of grains
      integer(ip), intent(in) :: n
      real(wp) :: sizes(n)
      integer(ip) :: k

      if (group%sizes /= 'log_normal' .and. group%sizes /= 'grading') then
         sizes = draw_sizes(group%size_ratio, n)
         return
      end if
      do k = 1_ip, n
         sizes(k) = size_at(group, (real(n - k, wp) + 0.5_wp)/real(n, wp))
      end do
   end function sizes_of

   !> Size factors between 1 and the size ratio, in descending order, without randomness.
   !>
   !> The number density of the sizes is proportional to size**-3, so each octave of sizes covers the same area. The
   !> fraction of grains smaller than s is (1 - s**-2)/(1 - ratio**-2). Grain k of n has the size at which this fraction
   !> is (n - k)/(n - 1). The list contains both extremes.
   pure function draw_sizes(ratio, n) result(sizes)
      !> Largest size factor, at least 1
      real(wp), intent(in) :: ratio
      !> Number of grains
      integer(ip), intent(in) :: n
      real(wp) :: sizes(n)
      real(wp) :: share
      integer(ip) :: k

      sizes = 1.0_wp
      if (ratio <= 1.0_wp) return
      sizes(1) = ratio
      do k = 2_ip, n - 1_ip
         share = real(n - k, wp)/real(n - 1_ip, wp)
         sizes(k) = 1.0_wp/sqrt(1.0_wp - share*(1.0_wp - ratio**(-2)))
      end do
   end function draw_sizes

   !> Size factor below which a share of the grains is
   pure real(wp) function size_at(group, share)
      !> Distribution
      class(shape_settings_t), intent(in) :: group
      !> Share by number, from 0 to 1
      real(wp), intent(in) :: share

      select case (group%sizes)
      case ('log_normal')
         size_at = exponential(normal_at(cut_share + share*(1.0_wp - 2.0_wp*cut_share))*logarithm(group%size_spread))
      case ('grading')
         size_at = graded_at(group%grading(1::2), group%grading(2::2), share)
      case ('octaves')
         size_at = 1.0_wp/sqrt(1.0_wp - share*(1.0_wp - group%size_ratio**(-2)))
      case default
         size_at = 1.0_wp
      end select
   end function size_at

   !> Size factor below which a share of the grains of a grading is
   pure real(wp) function graded_at(sieve, passing, share) result(at)
      !> Factors of the sieves, ascending, and fraction of the area of grains that are smaller, from 0 to 1
      real(wp), intent(in) :: sieve(:), passing(:)
      real(wp), intent(in) :: share
      real(wp) :: number(size(sieve) - 1), rest
      integer :: k

      do k = 1, size(number)
         number(k) = (passing(k + 1) - passing(k))/logarithm(sieve(k + 1)/sieve(k)) &
                     *(sieve(k)**(-2) - sieve(k + 1)**(-2))
      end do
      rest = share*sum(number)
      do k = 1, size(number) - 1
         if (rest <= number(k)) exit
         rest = rest - number(k)
      end do
      at = sieve(k)
      if (number(k) > 0.0_wp) at = sieve(k)/sqrt(1.0_wp - min(1.0_wp, rest/number(k)) &
                                                 *(1.0_wp - (sieve(k)/sieve(k + 1))**2))
   end function graded_at

   !> Inverse of the standard normal distribution between -2 and 2, to 1e-7 (P.J. Acklam, An algorithm for computing the
   !> inverse normal cumulative distribution function, 2003; his formula for the middle)
   pure real(wp) function normal_at(share)
      !> Probability of smaller values
      real(wp), intent(in) :: share
      real(wp), parameter :: a(6) = [2.506628277459239_wp, -30.66479806614716_wp, 138.3577518672690_wp, &
         -275.9285104469687_wp, 220.9460984245205_wp, -39.69683028665376_wp]
      real(wp), parameter :: b(6) = [1.0_wp, -13.28068155288572_wp, 66.80131188771972_wp, -155.6989798598866_wp, &
         161.5858368580409_wp, -54.47609879822406_wp]
      real(wp) :: q, square, above, below
      integer :: k

      q = share - 0.5_wp
      square = q*q
      above = a(6)
      below = b(6)
      do k = 5, 1, -1
         above = above*square + a(k)
         below = below*square + b(k)
      end do
      normal_at = q*above/below
   end function normal_at

end module polydem_sizes
