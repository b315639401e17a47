!> Reproducible random numbers: the combined multiple recursive generator MRG32k3a.
!>
!> P. L'Ecuyer, Operations Research 47 (1999) 159, Fig. I. The arithmetic is exact in 64-bit integers. The same seed
!> therefore gives the same numbers with every compiler, and a namelist reproduces its scene.
module polydem_random
   use polydem_elementary, only: cosine, logarithm
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: random_t, new_random

   integer(lp), parameter :: m1 = 4294967087_lp
   integer(lp), parameter :: m2 = 4294944443_lp
   integer(lp), parameter :: a12 = 1403580_lp
   integer(lp), parameter :: a13 = 810728_lp
   integer(lp), parameter :: a21 = 527612_lp
   integer(lp), parameter :: a23 = 1370589_lp

   !> A stream of random numbers
   type :: random_t
      private
      integer(lp) :: s1(3) = 12345_lp
      integer(lp) :: s2(3) = 12345_lp
   contains
      procedure :: uniform
      procedure :: between
      procedure :: whole
      procedure :: normal
      procedure :: state
      procedure :: set_state
   end type random_t

contains

   !> A stream that depends on the seed only. Neighbouring seeds give unrelated streams.
   function new_random(seed) result(stream)
      !> Any integer
      integer(ip), intent(in) :: seed
      type(random_t) :: stream
      real(wp) :: ignored
      integer :: k

      stream%s1(1) = modulo(int(seed, lp)*2654435761_lp + 12345_lp, m1 - 1_lp) + 1_lp
      stream%s2(2) = modulo(int(seed, lp)*40503_lp + 67891_lp, m2 - 1_lp) + 1_lp
      do k = 1, 32
         ignored = stream%uniform()
      end do
   end function new_random

   !> A number in the open interval (0, 1), uniformly distributed
   real(wp) function uniform(self)
      class(random_t), intent(inout) :: self
      integer(lp) :: p1, p2, difference

      p1 = modulo(a12*self%s1(2) - a13*self%s1(1), m1)
      self%s1 = [self%s1(2), self%s1(3), p1]
      p2 = modulo(a21*self%s2(3) - a23*self%s2(1), m2)
      self%s2 = [self%s2(2), self%s2(3), p2]
      difference = p1 - p2
      if (difference <= 0_lp) difference = difference + m1
      ! In single precision the quotient could be rounded to 1.
      uniform = min(real(difference, wp)/real(m1 + 1_lp, wp), 1.0_wp - epsilon(1.0_wp))
   end function uniform

   !> A number between two bounds, uniformly distributed
   real(wp) function between(self, low, high)
      class(random_t), intent(inout) :: self
      !> The bounds
      real(wp), intent(in) :: low, high

      between = low + (high - low)*self%uniform()
   end function between

   !> A uniformly distributed integer from low to high, both included
   integer(ip) function whole(self, low, high)
      class(random_t), intent(inout) :: self
      !> The bounds
      integer(ip), intent(in) :: low, high

      whole = min(high, low + int(self%uniform()*real(high - low + 1_ip, wp), ip))
   end function whole

   !> A normally distributed number of mean 0 and variance 1 (Box & Muller 1958)
   real(wp) function normal(self)
      class(random_t), intent(inout) :: self
      real(wp), parameter :: two_pi = 6.283185307179586476925286766559_wp
      real(wp) :: radius

      radius = sqrt(-2.0_wp*logarithm(self%uniform()))
      normal = radius*cosine(two_pi*self%uniform())
   end function normal

   !> The state of the stream, for a checkpoint
   pure function state(self)
      class(random_t), intent(in) :: self
      integer(lp) :: state(6)

      state = [self%s1, self%s2]
   end function state

   !> Set the state of the stream.
   pure subroutine set_state(self, state)
      class(random_t), intent(inout) :: self
      !> A state; what no stream can have is brought into its range
      integer(lp), intent(in) :: state(6)

      self%s1 = modulo(state(1:3), m1)
      self%s2 = modulo(state(4:6), m2)
   end subroutine set_state

end module polydem_random
