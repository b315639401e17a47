!> How deep a block at rest sinks into what carries it.
module polydem_static_depth
   use polydem_kinds, only: wp
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: static_depth

contains

   !> Depth d [m] at which the elastic force of a flat contact, E w d/l, balances a load.
   pure real(wp) function static_depth(forces, load, block, support, offset)
      !> Group &forces
      type(forces_settings_t), intent(in) :: forces
      !> Normal load per unit depth of the plane [N/m]
      real(wp), intent(in) :: load
      !> Width w and height of the block, (2) [m]
      real(wp), intent(in) :: block(2)
      !> Width, at least w, and thickness of the support, (2) [m]
      real(wp), intent(in) :: support(2)
      !> Distance of the two centres along the contact [m]
      real(wp), intent(in) :: offset

      if (forces%law == 'conservative') then
         static_depth = load/(forces%stiffness*block(1))*length_of_pair(block, support)
      else
         static_depth = depth_of_area_law(forces%stiffness, load, block, support, offset)
      end if
   end function static_depth

   !> Depth [m] where l = 4 r1 r2/(r1 + r2) (Matuttis & Chen 2014, inverse of eq. 7.6).
   !>
   !> It holds the distances of the two centres from the centroid of the overlap, which lies d/2 inside either body: a
   !> weak dependence on d that a few substitutions resolve to rounding.
   pure real(wp) function depth_of_area_law(stiffness, load, block, support, offset) result(depth)
      real(wp), intent(in) :: stiffness, load, block(2), support(2), offset
      real(wp) :: r1, r2
      integer :: k

      depth = 0.0_wp
      do k = 1, 12
         r1 = 0.5_wp*(block(2) - depth)
         r2 = hypot(0.5_wp*(support(2) - depth), offset)
         depth = load/(stiffness*block(1))*4.0_wp*r1*r2/(r1 + r2)
      end do
   end function depth_of_area_law

   !> Length l [m] of the conservative law for a flat contact of width w: 2 s1 s2 min(s1, s2)/((s1 + s2) w), where s is
   !> the side of the square of a body's area.
   pure real(wp) function length_of_pair(block, support)
      real(wp), intent(in) :: block(2), support(2)
      real(wp) :: s1, s2

      s1 = sqrt(block(1)*block(2))
      s2 = sqrt(support(1)*support(2))
      length_of_pair = 2.0_wp*s1*s2*min(s1, s2)/((s1 + s2)*block(1))
   end function length_of_pair

end module polydem_static_depth
