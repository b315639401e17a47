!> Bodies that enter and leave during a run: its sources and sinks, and the table of departures.
!>
!> What happens depends on the step, the bodies and the state here alone, which a checkpoint contains, so a restart
!> decides alike. The step of a departure is the first one without the body.
module polydem_sources_and_sinks
   use polydem_errors, only: input_error, raise
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_named_values, only: named_values_t
   use polydem_serializer, only: serializer_t
   use polydem_series, only: series_t
   use polydem_settings, only: sink_settings_t
   use polydem_source, only: source_t
   implicit none
   private
   public :: sources_and_sinks_t, sink_t, departure_t, set_departure, is_due, number_of_values

   !> Number of values of a body that leaves: mass, velocity, place and number of the material
   integer, parameter :: number_of_values = 6

   !> More than the balance has totals
   integer(lp), parameter :: most_totals = 1000_lp

   !> A sink: a rectangle in which free bodies leave
   type :: sink_t
      !> Its group &sink
      type(sink_settings_t) :: settings
      !> Number of the stage in which bodies leave; 0: in all
      integer(ip) :: stage = 0_ip
      !> Number of bodies that have left
      integer(lp) :: departed = 0_lp
      !> Mass that has left [kg/m]
      real(wp) :: mass = 0.0_wp
   end type sink_t

   !> Bodies that leave before the next step, the same on all ranks
   type :: departure_t
      !> Identifiers, ascending, and numbers of their sinks; 0: an action removes it
      integer(lp), allocatable :: id(:), sink(:)
      !> Mass [kg/m], velocity [m/s], place [m] and number of the material of each, (number_of_values, body)
      real(dp), allocatable :: value(:, :)
   end type departure_t

   !> Sources and sinks of a run
   type :: sources_and_sinks_t
      !> Sources, in the order of the namelist
      type(source_t), allocatable :: sources(:)
      !> Sinks, likewise
      type(sink_t), allocatable :: sinks(:)
      !> Departures that no file has yet
      type(series_t) :: departures
      !> Totals of the balance of the bodies that leave before the next step; not allocated: to be computed
      real(wp), allocatable :: leaving(:)
   contains
      procedure :: has_event
      procedure :: has_departures
      procedure :: keep_departures
      procedure :: set_columns
      procedure :: serialize
   end type sources_and_sinks_t

contains

   !> Whether bodies may enter or leave at an interval and in a stage
   elemental logical function is_due(interval, stage, step, present_stage)
      !> Steps between two times, and stage of the source or sink
      integer(ip), intent(in) :: interval, stage
      !> Number of completed steps
      integer(lp), intent(in) :: step
      !> Number of the present stage
      integer(ip), intent(in) :: present_stage

      is_due = mod(step, int(interval, lp)) == 0_lp .and. (stage == 0_ip .or. stage == present_stage)
   end function is_due

   !> Whether bodies may leave after a step, in some stage
   pure logical function has_departures(self, step)
      class(sources_and_sinks_t), intent(in) :: self
      !> Number of the step
      integer(lp), intent(in) :: step
      integer :: k

      has_departures = .false.
      do k = 1, size(self%sinks)
         has_departures = has_departures .or. mod(step, int(self%sinks(k)%settings%interval, lp)) == 0_lp
      end do
   end function has_departures

   !> Whether bodies may enter or leave after a step, in some stage
   pure logical function has_event(self, step)
      class(sources_and_sinks_t), intent(in) :: self
      !> Number of the step
      integer(lp), intent(in) :: step
      integer :: k

      has_event = self%has_departures(step)
      do k = 1, size(self%sources)
         has_event = has_event .or. mod(step, int(self%sources(k)%settings%interval, lp)) == 0_lp
      end do
   end function has_event

   !> Count departures, and keep their rows until a file takes them.
   subroutine keep_departures(self, step, time, departing)
      class(sources_and_sinks_t), intent(inout) :: self
      !> First step without the bodies
      integer(lp), intent(in) :: step
      !> Its time [s]
      real(dp), intent(in) :: time
      !> The bodies
      type(departure_t), intent(in) :: departing
      integer :: k

      do k = 1, size(departing%id)
         associate (s => departing%sink(k), value => departing%value(:, k))
            if (s > 0_lp) then
               self%sinks(s)%departed = self%sinks(s)%departed + 1_lp
               self%sinks(s)%mass = self%sinks(s)%mass + real(value(1), wp)
            end if
            call set_departure(self%departures%row, s, departing%id(k), real(value, wp))
         end associate
         call self%departures%keep_row(step, time)
      end do
   end subroutine keep_departures

   !> Set the columns of a departure.
   subroutine set_departure(row, sink, id, value)
      !> Names and values of the columns
      type(named_values_t), intent(inout) :: row
      !> Number of the sink, and identifier of the body
      integer(lp), intent(in) :: sink, id
      !> Mass, velocity, place and material
      real(wp), intent(in) :: value(number_of_values)

      call row%set('sink', real(sink, wp), '1', 'number of the sink among the groups &sink, from 1; 0: none')
      call row%set('id', real(id, wp), '1', 'identifier of the body')
      call row%set('material', value(6), '1', 'its material: position among the groups &material, 0: none of them')
      call row%set('mass', value(1), 'kg/m', 'its mass')
      call row%set('velocity_x', value(2), 'm/s', 'its velocity along x when it left')
      call row%set('velocity_y', value(3), 'm/s', 'its velocity along y')
      call row%set('x', value(4), 'm', 'place of its centre of mass then, along x')
      call row%set('y', value(5), 'm', 'this place along y')
   end subroutine set_departure

   !> Set the columns of the series: numbers and masses so far.
   subroutine set_columns(self, row)
      class(sources_and_sinks_t), intent(in) :: self
      !> Row of the series
      type(named_values_t), intent(inout) :: row
      integer :: k

      do k = 1, size(self%sources)
         associate (source => self%sources(k))
            call row%set(source%settings%name//'.entered', real(source%entered, wp), '1', 'bodies that have entered')
            call row%set(source%settings%name//'.mass', source%mass, 'kg/m', 'their mass')
         end associate
      end do
      do k = 1, size(self%sinks)
         associate (sink => self%sinks(k))
            call row%set(sink%settings%name//'.departed', real(sink%departed, wp), '1', 'bodies that have left')
            call row%set(sink%settings%name//'.mass', sink%mass, 'kg/m', 'their mass')
         end associate
      end do
   end subroutine set_columns

   !> Serialize what changes.
   subroutine serialize(self, step, serializer)
      class(sources_and_sinks_t), intent(inout) :: self
      !> Number of completed steps
      integer(lp), intent(in) :: step
      class(serializer_t), intent(inout) :: serializer
      integer(lp) :: n
      integer :: k

      n = 0_lp
      if (allocated(self%leaving)) n = size(self%leaving, kind=lp)
      call serializer%field('/run/leaving', n, '1', 'number of totals of the bodies that leave before the next step')
      if (serializer%is_reading .and. .not. allocated(serializer%error)) then
         if (n < 0_lp .or. n > most_totals) call raise(serializer%error, input_error, &
            '/run/leaving is not a number of totals')
         if (allocated(serializer%error)) return
         if (allocated(self%leaving)) deallocate (self%leaving)
         if (n > 0_lp) allocate (self%leaving(n), source=0.0_wp)
      end if
      if (n > 0_lp) call serializer%field('/run/leaving_totals', self%leaving, '1', &
                                          'totals of the balance of these bodies')
      do k = 1, size(self%sources)
         call self%sources(k)%serialize(step, serializer)
      end do
      do k = 1, size(self%sinks)
         associate (sink => self%sinks(k))
            call serializer%field('/run/sink_'//sink%settings%name//'_count', sink%departed, '1', &
                                  'bodies that have left')
            call serializer%field('/run/sink_'//sink%settings%name//'_mass', sink%mass, 'kg/m', 'their mass')
         end associate
      end do
      call self%departures%serialize(serializer)
   end subroutine serialize

end module polydem_sources_and_sinks
