!> Materials of the bodies of a result from which a run starts. A result has numbers, and the names in its provenance.
module polydem_start_materials
   use polydem_bodies, only: bodies_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip
   use polydem_pair_parameters, only: material_number
   use polydem_settings, only: settings_t
   use polydem_strings, only: quoted, split_words
   implicit none
   private
   public :: material_names_text, translate_materials

contains

   !> Names of the materials of a run, separated by blanks
   pure function material_names_text(settings) result(text)
      type(settings_t), intent(in) :: settings
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      do k = 1, size(settings%material)
         text = text//settings%material(k)%name//' '
      end do
      text = trim(text)
   end function material_names_text

   !> Replace the numbers of a result by those of the run. Bodies without a material get that of &scene.
   subroutine translate_materials(settings, names, bodies, error)
      type(settings_t), intent(in) :: settings
      !> Names of the materials of the result
      character(len=*), intent(in) :: names
      !> Bodies; their materials are set if the run has materials
      type(bodies_t), intent(inout) :: bodies
      !> Names a material that the run does not have
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: words(:)
      integer(ip) :: number(0:len(names)), of_fixed, k, s

      number(0) = material_number(settings, settings%scene%material)
      of_fixed = number(0)
      if (settings%scene%wall_material /= '') of_fixed = material_number(settings, settings%scene%wall_material)
      words = split_words(names)
      do k = 1_ip, size(words, kind=ip)
         number(k) = material_number(settings, trim(words(k)))
         if (number(k) == 0_ip) call raise(error, input_error, 'the result has the material '// &
            quoted(trim(words(k)))//', but the namelist has no &material of this name')
      end do
      if (allocated(error) .or. size(settings%material) == 0) return
      if (.not. allocated(bodies%material)) allocate (bodies%material(bodies%n), source=0_ip)
      do s = 1_ip, bodies%n
         if (bodies%material(s) == 0_ip .and. bodies%fixed(s)) then
            bodies%material(s) = of_fixed
         else
            bodies%material(s) = number(bodies%material(s))
         end if
      end do
   end subroutine translate_materials

end module polydem_start_materials
