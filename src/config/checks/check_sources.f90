!> Checks of the groups &source and &sink: entries that depend on each other.
module polydem_check_sources
   use polydem_blame_entry, only: blame
   use polydem_check_shapes, only: check_shape
   use polydem_errors, only: error_t, input_error, raise
   use polydem_group_instances, only: index_of_instance, instance_t, row_of
   use polydem_kinds, only: wp
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: check_sources

contains

   !> Check sources and sinks.
   pure subroutine check_sources(settings, instances, error)
      !> Settings with all entries filled in
      type(settings_t), intent(in) :: settings
      !> All groups with their values, which contain the places for messages
      type(instance_t), intent(in) :: instances(:)
      !> First contradiction
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: corner = 'must exceed ''low'' along x and y'
      integer :: j, k

      do k = 1, size(settings%source)
         associate (source => settings%source(k), &
                    instance => instances(index_of_instance(instances, 'source', settings%source(k)%name)))
            if (.not. all(source%low < source%high)) call blame(instance, 'high', corner, error, 'low')
            if (source%rate > 0.0_wp .and. source%count > 0) call blame(instance, 'rate', &
               'cannot be combined with ''count''; give only one of them', error, 'count')
            if (.not. source%rate > 0.0_wp .and. source%count == 0) call blame(instance, 'rate', &
               'is 0; give it, or give ''count'', for example count = 500', error)
            call check_shape(source, instance, error)
            if (source%shape == 'outline' .and. source%outlines == '' .and. &
                (size(source%outline) < 6 .or. modulo(size(source%outline), 2) == 1)) call blame(instance, 'outline', &
               'needs x and y of at least three corners; for example 0, 0, 0.01, 0, 0.01, 0.01', error)
            do j = 1, k - 1
               associate (other => settings%source(j))
                  if (source%count > other%count .or. source%count == 0) cycle
                  if (source%stage /= '' .and. other%stage /= '' .and. source%stage /= other%stage) cycle
                  call blame(instance, 'count', 'is reached by &source '//other%name//' before a body of this one '// &
                     'enters, since both count all free bodies: give a greater count, or a rate', error)
               end associate
            end do
         end associate
      end do
      do k = 1, size(settings%sink)
         associate (sink => settings%sink(k), &
                    instance => instances(index_of_instance(instances, 'sink', settings%sink(k)%name)))
            if (.not. all(sink%low < sink%high)) call blame(instance, 'high', corner, error, 'low')
            if (.not. settings%output%series_interval > 0.0_wp) cycle
            if (index_of_instance(instances, 'source', sink%name) > 0) call blame(instance, 'name', 'is that of a '// &
               'source; both would have a column '//sink%name//'.mass in the series. Give the sink another name', error)
         end associate
      end do
      if (settings%output%trace_steps > 0 .and. size(settings%source) + size(settings%sink) > 0) then
         associate (group => instances(index_of_instance(instances, 'output')))
            call raise(error, input_error, group%values(row_of(group, 'trace_steps'))%place// &
               ': ''trace_steps'' in &output cannot be combined with &source or &sink, because a trace has '// &
               'the same boxes in all steps')
         end associate
      end if
   end subroutine check_sources

end module polydem_check_sources
