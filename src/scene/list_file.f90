!> Bodies of a scene that come from a file.
module polydem_list_file
   use polydem_bodies_reader, only: known_materials_t, read_bodies_file
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: exists
   use polydem_kinds, only: ip
   use polydem_pair_parameters, only: density_of, material_number
   use polydem_settings, only: settings_t
   use polydem_source_locations, only: place_of
   implicit none
   private
   public :: list_file, origin_of_file

contains

   !> Beginning of a message about the bodies file
   pure function origin_of_file(settings) result(origin)
      !> Group &scene
      type(settings_t), intent(in) :: settings
      character(len=:), allocatable :: origin

      origin = place_of(settings, 'scene', 'bodies_file')//": 'bodies_file' in &scene: "
   end function origin_of_file

   !> List the bodies of a file.
   subroutine list_file(settings, list, error)
      !> Groups &scene and &material
      type(settings_t), intent(in) :: settings
      !> The bodies are appended
      type(body_list_t), intent(inout) :: list
      !> Allocated if the file is bad
      type(error_t), allocatable, intent(inout) :: error

      associate (path => settings%scene%bodies_file)
         if (.not. exists(path)) call raise(error, input_error, path//': there is no such file')
         if (.not. allocated(error)) call read_bodies_file(path, settings%scene%density, list, error, &
                                                            materials_of(settings))
      end associate
      if (allocated(error)) error%message = origin_of_file(settings)//error%message
   end subroutine list_file

   !> The materials of the run, for the bodies of a file
   pure type(known_materials_t) function materials_of(settings) result(materials)
      type(settings_t), intent(in) :: settings
      integer(ip) :: k

      associate (n => size(settings%material, kind=ip), scene => settings%scene)
         allocate (materials%names(n), materials%density(n))
         do k = 1_ip, n
            materials%names(k)%text = settings%material(k)%name
            materials%density(k) = density_of(settings, k)
         end do
         materials%of_free = material_number(settings, scene%material)
         materials%of_fixed = materials%of_free
         if (scene%wall_material /= '') materials%of_fixed = material_number(settings, scene%wall_material)
      end associate
   end function materials_of

end module polydem_list_file
