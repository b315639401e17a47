!> Depth to which a block at rest sinks into its support.
module polydem_static_depth
   use polydem_force_law, only: choose_parts, force_law_t
   use polydem_kinds, only: wp
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: static_depth

contains

   !> Depth d at which the elastic force of a flat contact, E w d/l, balances a load [m]
   real(wp) function static_depth(forces, load, block, support, offset)
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
      type(force_law_t) :: law

      call choose_parts(forces, law)
      static_depth = law%static_depth(load, block, support, offset)
   end function static_depth

end module polydem_static_depth
