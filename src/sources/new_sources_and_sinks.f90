!> Start of the sources and sinks of a run.
module polydem_new_sources_and_sinks
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_outline_file, only: read_outlines
   use polydem_pair_parameters, only: density_of, material_number
   use polydem_run_duration, only: number_of_stage
   use polydem_settings, only: settings_t
   use polydem_source, only: new_source
   use polydem_source_locations, only: place_of
   use polydem_sources_and_sinks, only: set_departure, sources_and_sinks_t
   implicit none
   private
   public :: new_sources_and_sinks, start_sources_and_sinks

contains

   !> Start the sources and sinks of a run. Nothing is allocated if there are none.
   subroutine new_sources_and_sinks(settings, new, error)
      type(settings_t), intent(in) :: settings
      !> The sources and sinks
      type(sources_and_sinks_t), allocatable, intent(out) :: new
      !> Names the source whose outlines cannot be read
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, seed

      if (size(settings%source) + size(settings%sink) == 0) return
      call start_sources_and_sinks(size(settings%source), size(settings%sink), new)
      do k = 1_ip, size(new%sources, kind=ip)
         associate (given => settings%source(k))
            seed = given%seed
            if (seed == 0_ip) seed = modulo(settings%scene%seed + 1001_ip*k, huge(1_ip))
            call new_source(given, seed, new%sources(k))
            if (given%outlines /= '') call read_outlines(given%outlines, new%sources(k)%group%outline, &
                                                         new%sources(k)%group%outline_corners, &
                                                         new%sources(k)%group%outline_pieces, error)
            if (allocated(error)) error%message = place_of(settings, 'source.'//given%name, 'outlines')// &
               ': &source '//given%name//': outlines: '//error%message
            if (allocated(error)) return
            new%sources(k)%stage = number_of_stage(settings, given%stage)
            new%sources(k)%material = material_number(settings, given%material)
            if (given%material == '') new%sources(k)%material = material_number(settings, settings%scene%material)
            new%sources(k)%density = given%density
            if (.not. given%density > 0.0_wp) &
               new%sources(k)%density = density_of(settings, new%sources(k)%material)
         end associate
      end do
      do k = 1_ip, size(new%sinks, kind=ip)
         new%sinks(k)%settings = settings%sink(k)
         new%sinks(k)%stage = number_of_stage(settings, settings%sink(k)%stage)
      end do
   end subroutine new_sources_and_sinks

   !> Start some sources and sinks, or none in a run in which actions let bodies enter and leave.
   subroutine start_sources_and_sinks(n_sources, n_sinks, new)
      !> Numbers of sources and sinks
      integer, intent(in) :: n_sources, n_sinks
      !> The sources and sinks
      type(sources_and_sinks_t), allocatable, intent(out) :: new

      allocate (new)
      allocate (new%sources(n_sources), new%sinks(n_sinks))
      new%departures%name = 'departures'
      call set_departure(new%departures%row, 0_lp, 0_lp, [real(wp) :: 0, 0, 0, 0, 0, 0])
   end subroutine start_sources_and_sinks

end module polydem_new_sources_and_sinks
