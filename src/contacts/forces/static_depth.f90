!> Depth to which a block at rest sinks into its support.
module polydem_static_depth
   use polydem_errors, only: error_t, input_error, raise
   use polydem_force_law, only: force_law_t
   use polydem_law_factory, only: choose_parts
   use polydem_force_part, only: resting_block_t
   use polydem_kinds, only: wp
   use polydem_pair_parameters, only: pair_parameters
   use polydem_settings, only: settings_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: resting_block_t, static_depth

contains

   !> Find the depth d at which the elastic force of a flat contact, E w d/l, balances a load and the cohesion.
   subroutine static_depth(settings, block, depth, error)
      !> Groups &forces, &material and &contact_pair
      type(settings_t), intent(in) :: settings
      !> The block, of width w
      type(resting_block_t), intent(in) :: block
      !> Depth d [m]
      real(wp), intent(out) :: depth
      !> Allocated if the depth is not less than the height of the block
      type(error_t), allocatable, intent(inout) :: error
      type(force_law_t) :: law
      type(resting_block_t) :: loaded

      call choose_parts(settings%forces, law, pair_parameters(settings, settings%forces))
      loaded = block
      loaded%load = block%load + law%pairs%cohesion%of(block%materials)*block%width
      depth = law%static_depth(loaded)
      if (depth >= 0.0_wp .and. depth < block%height) return
      call raise(error, input_error, 'a block of height '//to_text(block%height)//' m sinks deeper than its height '// &
                 'under a load of '//to_text(block%load)//' N/m; increase stiffness in &forces, or '// &
                 'decrease height or density')
   end subroutine static_depth

end module polydem_static_depth
