!> What all recipes share: the grains that the entries of &scene describe.
module polydem_recipe
   use polydem_kinds, only: wp
   use polydem_parts, only: new_grains
   use polydem_settings, only: grains_settings_t, scene_settings_t
   implicit none
   private
   public :: recipe_grains

contains

   !> Grains of a recipe without number and region
   pure function recipe_grains(scene) result(grains)
      !> Settings: grains, speed, spin, packing
      type(scene_settings_t), intent(in) :: scene
      type(grains_settings_t) :: grains

      grains = new_grains('grains')
      if (scene%packing /= '') grains%arrangement = 'packing'
      grains%packing = scene%packing
      grains%ellipse_settings_t = scene%ellipse_settings_t
      grains%angle = [0.0_wp, 360.0_wp]
      grains%size_ratio = scene%size_ratio
      if (scene%size_ratio > 1.0_wp) grains%sizes = 'octaves'
      grains%speed = scene%speed
      grains%order = scene%order
   end function recipe_grains

end module polydem_recipe
