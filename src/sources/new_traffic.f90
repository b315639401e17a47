!> Start of the sources and sinks of a run.
module polydem_new_traffic
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_outline_file, only: read_outlines
   use polydem_pair_parameters, only: density_of, material_number
   use polydem_run_duration, only: number_of_stage
   use polydem_settings, only: settings_t
   use polydem_source, only: new_source
   use polydem_source_locations, only: place_of
   use polydem_traffic, only: set_departure, traffic_t
   implicit none
   private
   public :: new_traffic, start_traffic

contains

   !> Start the sources and sinks of a run. Nothing is allocated if there are none.
   subroutine new_traffic(settings, traffic, error)
      type(settings_t), intent(in) :: settings
      type(traffic_t), allocatable, intent(out) :: traffic
      !> Names the source whose outlines cannot be read
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, seed

      if (size(settings%source) + size(settings%sink) == 0) return
      call start_traffic(size(settings%source), size(settings%sink), traffic)
      do k = 1_ip, size(traffic%sources, kind=ip)
         associate (given => settings%source(k))
            seed = given%seed
            if (seed == 0_ip) seed = modulo(settings%scene%seed + 1001_ip*k, huge(1_ip))
            call new_source(given, seed, traffic%sources(k))
            if (given%outlines /= '') call read_outlines(given%outlines, traffic%sources(k)%group%outline, &
                                                         traffic%sources(k)%group%outline_corners, &
                                                         traffic%sources(k)%group%outline_pieces, error)
            if (allocated(error)) error%message = place_of(settings, 'source.'//given%name, 'outlines')// &
               ': &source '//given%name//': outlines: '//error%message
            if (allocated(error)) return
            traffic%sources(k)%stage = number_of_stage(settings, given%stage)
            traffic%sources(k)%material = material_number(settings, given%material)
            if (given%material == '') traffic%sources(k)%material = material_number(settings, settings%scene%material)
            traffic%sources(k)%density = given%density
            if (.not. given%density > 0.0_wp) &
               traffic%sources(k)%density = density_of(settings, traffic%sources(k)%material)
         end associate
      end do
      do k = 1_ip, size(traffic%sinks, kind=ip)
         traffic%sinks(k)%settings = settings%sink(k)
         traffic%sinks(k)%stage = number_of_stage(settings, settings%sink(k)%stage)
      end do
   end subroutine new_traffic

   !> Start some sources and sinks, or none in a run in which actions let bodies enter and leave.
   subroutine start_traffic(n_sources, n_sinks, traffic)
      !> Numbers of sources and sinks
      integer, intent(in) :: n_sources, n_sinks
      type(traffic_t), allocatable, intent(out) :: traffic

      allocate (traffic)
      allocate (traffic%sources(n_sources), traffic%sinks(n_sinks))
      traffic%departures%name = 'departures'
      call set_departure(traffic%departures%row, 0_lp, 0_lp, [real(wp) :: 0, 0, 0, 0, 0, 0])
   end subroutine start_traffic

end module polydem_new_traffic
