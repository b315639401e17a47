!> How deep a block at rest sinks into what carries it.
module polydem_static_depth
   use polydem_kinds, only: wp
   implicit none
   private
   public :: static_depth

contains

   !> Depth d [m] at which the elastic force of a flat contact, E w d/l, balances a load.
   !>
   !> The characteristic length l = 4 r1 r2/(r1 + r2) (Matuttis & Chen 2014, inverse of eq. 7.6) holds the
   !> distances of the two centres from the centroid of the overlap, which lies d/2 inside either body: a weak
   !> dependence on d that a few substitutions resolve to rounding.
   pure real(wp) function static_depth(load, stiffness, width, height, support, offset)
      !> Normal load per unit depth of the plane [N/m]
      real(wp), intent(in) :: load
      !> Young's modulus E [N/m2]
      real(wp), intent(in) :: stiffness
      !> Width w of the contact [m]
      real(wp), intent(in) :: width
      !> Height of the block [m]
      real(wp), intent(in) :: height
      !> Thickness of the support [m]
      real(wp), intent(in) :: support
      !> Distance of the two centres along the contact [m]
      real(wp), intent(in) :: offset
      real(wp) :: r1, r2
      integer :: k

      static_depth = 0.0_wp
      do k = 1, 12
         r1 = 0.5_wp*(height - static_depth)
         r2 = hypot(0.5_wp*(support - static_depth), offset)
         static_depth = load/(stiffness*width)*4.0_wp*r1*r2/(r1 + r2)
      end do
   end function static_depth

end module polydem_static_depth
