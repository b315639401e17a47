!> The parts of a scene: those of the namelist, or those that a recipe makes. Only this module uses all recipes.
module polydem_recipes
   use polydem_bed, only: make_bed
   use polydem_channel, only: make_channel
   use polydem_drum, only: make_drum
   use polydem_errors, only: error_t, input_error, raise
   use polydem_gas, only: make_gas
   use polydem_heap, only: make_heap
   use polydem_hopper, only: make_hopper
   use polydem_incline, only: make_incline
   use polydem_parts, only: parts_t
   use polydem_settings, only: settings_t
   use polydem_source_locations, only: overrides_of, place_of
   use polydem_stack, only: make_stack
   implicit none
   private
   public :: find_parts, blame_recipe

contains

   !> Find the parts of a scene: those of the namelist, or those that its recipe makes.
   subroutine find_parts(settings, parts, error)
      !> Settings: groups &scene, &grains, &wall and &forces
      type(settings_t), intent(in) :: settings
      !> Its parts
      type(parts_t), intent(out) :: parts
      !> Allocated if the recipe cannot be followed
      type(error_t), allocatable, intent(inout) :: error

      parts%recipe = ''
      if (any(settings%scene%name == [character(len=5) :: 'parts', 'file'])) then
         parts%grains = settings%grains
         parts%walls = settings%wall
         return
      end if
      call parts%start(settings%scene%name)
      select case (settings%scene%name)
      case ('drum')
         call make_drum(settings%scene, parts, error)
      case ('hopper')
         call make_hopper(settings%scene, parts, error)
      case ('gas')
         call make_gas(settings%scene, parts)
      case ('channel')
         call make_channel(settings%scene, parts, error)
      case ('bed')
         call make_bed(settings%scene, parts, error)
      case ('heap')
         call make_heap(settings%scene, parts, error)
      case ('incline')
         call make_incline(settings, parts, error)
      case ('stack')
         call make_stack(settings%scene, parts)
      case default
         call raise(error, input_error, 'unknown scene '//settings%scene%name)
      end select
      if (allocated(error)) call blame_recipe(settings, error)
   end subroutine find_parts

   !> Complete a message about a recipe.
   pure subroutine blame_recipe(settings, error)
      type(settings_t), intent(in) :: settings
      !> The message of the recipe
      type(error_t), intent(inout) :: error

      error%message = place_of(settings, 'scene', 'name')//': &scene: '//error%message//overrides_of(settings, 'scene')
   end subroutine blame_recipe

end module polydem_recipes
