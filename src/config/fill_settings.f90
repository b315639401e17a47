!> Copies the values of the table of entries to the components of the settings types.
module polydem_fill_settings
   use polydem_bench_settings, only: bench_settings_t
   use polydem_kinds, only: ip, wp
   use polydem_namelist_entries, only: entries, first_row
   use polydem_namelist_values, only: value_t
   use polydem_settings, only: settings_t
   use polydem_strings, only: text_t
   implicit none
   private
   public :: fill_settings, fill_bench

   !> Copy the value of an entry, named 'group.key', to a component.
   interface take
      module procedure take_real, take_reals, take_integer, take_integers, take_logical, take_text, take_texts
   end interface take

contains

   !> Fill every component from the entry of the same name.
   pure subroutine fill_settings(values, settings)
      !> Values, (row of the table)
      type(value_t), intent(in) :: values(:)
      !> Settings to fill; `file`, `text` and `resolved` are not changed
      type(settings_t), intent(inout) :: settings

      call fill_scene(values, settings)
      call fill_guards(values, settings)
      call take(values, 'boxes.largest_ratio', settings%boxes%largest_ratio)
      call take(values, 'boxes.margin', settings%boxes%margin)
      call take(values, 'neighbours.finder', settings%neighbours%finder)
      call take(values, 'neighbours.skin', settings%neighbours%skin)
      call take(values, 'overlap.degenerate', settings%overlap%degenerate)
      associate (forces => settings%forces, integrate => settings%integrate, output => settings%output)
         call take(values, 'forces.gravity', forces%gravity)
         call take(values, 'forces.stiffness', forces%stiffness)
         call take(values, 'forces.law', forces%law)
         call take(values, 'forces.damping', forces%damping)
         call take(values, 'forces.damping_coefficient', forces%damping_coefficient)
         call take(values, 'forces.damping_from_touch', forces%damping_from_touch)
         call take(values, 'forces.restitution', forces%restitution)
         call take(values, 'forces.tilt_damping', forces%tilt_damping)
         call take(values, 'forces.friction', forces%friction)
         call take(values, 'forces.friction_coefficient', forces%friction_coefficient)
         call take(values, 'forces.tangential_stiffness', forces%tangential_stiffness)
         call take(values, 'forces.tangential_damping', forces%tangential_damping)
         call take(values, 'forces.midstep_slip', forces%midstep_slip)
         call take(values, 'forces.friction_tolerance', forces%friction_tolerance)
         call take(values, 'integrate.scheme', integrate%scheme)
         call take(values, 'integrate.accumulation', integrate%accumulation)
         call take(values, 'integrate.dt', integrate%dt)
         call take(values, 'integrate.fraction', integrate%fraction)
         call take(values, 'integrate.duration', integrate%duration)
         call take(values, 'output.folder', output%folder)
         call take(values, 'output.frame_interval', output%frame_interval)
         call take(values, 'output.frames_per_segment', output%frames_per_segment)
         call take(values, 'output.log_interval', output%log_interval)
         call take(values, 'output.contacts', output%contacts)
         call take(values, 'output.ledger', output%ledger)
         call take(values, 'output.trace_steps', output%trace_steps)
         call take(values, 'output.trace_start', output%trace_start)
         call take(values, 'output.step_profile', output%step_profile)
      end associate
      call take(values, 'exchange.cut', settings%exchange%cut)
      call take(values, 'exchange.margin', settings%exchange%margin)
      call take(values, 'exchange.balance', settings%exchange%balance)
      call take(values, 'exchange.imbalance', settings%exchange%imbalance)
      call take(values, 'checkpoint.steps', settings%checkpoint%steps)
      call take(values, 'checkpoint.interval', settings%checkpoint%interval)
      call take(values, 'checkpoint.elapsed', settings%checkpoint%elapsed)
   end subroutine fill_settings

   !> Fill every component of the settings of a bench from the entry of the same name.
   pure subroutine fill_bench(values, bench)
      !> Values, (row of the table)
      type(value_t), intent(in) :: values(:)
      !> Settings to fill; `file`, `text` and `resolved` are not changed
      type(bench_settings_t), intent(inout) :: bench

      call take(values, 'bench.scenes', bench%scenes)
      call take(values, 'bench.names', bench%names)
      call take(values, 'bench.prepare', bench%prepare)
      call take(values, 'bench.finders', bench%finders)
      call take(values, 'bench.threads', bench%threads)
      call take(values, 'bench.repeats', bench%repeats)
      call take(values, 'bench.mode', bench%mode)
      call take(values, 'bench.steps', bench%steps)
      call take(values, 'bench.folder', bench%folder)
      bench%scenes_place = values(row_of(values, 'bench.scenes'))%place
      bench%prepare_place = values(row_of(values, 'bench.prepare'))%place
   end subroutine fill_bench

   !> Fill the components of group &scene.
   pure subroutine fill_scene(values, settings)
      type(value_t), intent(in) :: values(:)
      type(settings_t), intent(inout) :: settings

      associate (scene => settings%scene)
         call take(values, 'scene.name', scene%name)
         call take(values, 'scene.bodies_file', scene%bodies_file)
         call take(values, 'scene.seed', scene%seed)
         call take(values, 'scene.boxes', scene%boxes)
         call take(values, 'scene.bodies', scene%bodies)
         call take(values, 'scene.packing', scene%packing)
         call take(values, 'scene.corners_min', scene%corners_min)
         call take(values, 'scene.corners_max', scene%corners_max)
         call take(values, 'scene.short_axis', scene%short_axis)
         call take(values, 'scene.long_axis_min', scene%long_axis_min)
         call take(values, 'scene.long_axis_max', scene%long_axis_max)
         call take(values, 'scene.size_ratio', scene%size_ratio)
         call take(values, 'scene.order', scene%order)
         call take(values, 'scene.density', scene%density)
         call take(values, 'scene.radius', scene%radius)
         call take(values, 'scene.width', scene%width)
         call take(values, 'scene.height', scene%height)
         call take(values, 'scene.opening', scene%opening)
         call take(values, 'scene.slope', scene%slope)
         call take(values, 'scene.fraction', scene%fraction)
         call take(values, 'scene.overlap', scene%overlap)
         call take(values, 'scene.speed', scene%speed)
         call take(values, 'scene.spin', scene%spin)
         call take(values, 'scene.movers', scene%movers)
         call take(values, 'scene.motion', scene%motion)
         call take(values, 'scene.motion_bodies', scene%motion_bodies)
         call take(values, 'scene.motion_pivot', scene%motion_pivot)
         call take(values, 'scene.motion_rate', scene%motion_rate)
         call take(values, 'scene.motion_velocity', scene%motion_velocity)
         call take(values, 'scene.motion_amplitude', scene%motion_amplitude)
         call take(values, 'scene.motion_frequency', scene%motion_frequency)
         call take(values, 'scene.motion_start', scene%motion_start)
         call take(values, 'scene.motion_ramp', scene%motion_ramp)
      end associate
   end subroutine fill_scene

   !> Fill the components of group &guards.
   pure subroutine fill_guards(values, settings)
      type(value_t), intent(in) :: values(:)
      type(settings_t), intent(inout) :: settings

      associate (guards => settings%guards)
         call take(values, 'guards.displacement', guards%displacement)
         call take(values, 'guards.displacement_limit', guards%displacement_limit)
         call take(values, 'guards.step', guards%step)
         call take(values, 'guards.overlap', guards%overlap)
         call take(values, 'guards.overlap_limit', guards%overlap_limit)
         call take(values, 'guards.passing', guards%passing)
         call take(values, 'guards.energy', guards%energy)
         call take(values, 'guards.energy_limit', guards%energy_limit)
         call take(values, 'guards.listed_depth', guards%listed_depth)
         call take(values, 'guards.relaxed_depth', guards%relaxed_depth)
      end associate
   end subroutine fill_guards

   pure subroutine take_real(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: component

      component = values(row_of(values, name))%reals(1)
   end subroutine take_real

   pure subroutine take_reals(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: component(:)

      component = values(row_of(values, name))%reals
   end subroutine take_reals

   pure subroutine take_integer(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      integer(ip), intent(inout) :: component

      component = values(row_of(values, name))%integers(1)
   end subroutine take_integer

   pure subroutine take_integers(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      integer(ip), allocatable, intent(inout) :: component(:)

      component = values(row_of(values, name))%integers
   end subroutine take_integers

   pure subroutine take_logical(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      logical, intent(inout) :: component

      component = values(row_of(values, name))%flag
   end subroutine take_logical

   pure subroutine take_text(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(inout) :: component

      component = values(row_of(values, name))%text
   end subroutine take_text

   pure subroutine take_texts(values, name, component)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      type(text_t), allocatable, intent(inout) :: component(:)

      component = values(row_of(values, name))%texts
   end subroutine take_texts

   !> Row of the entry that is in use; the first row of the entry if none is in use
   pure integer function row_of(values, name) result(row)
      type(value_t), intent(in) :: values(:)
      character(len=*), intent(in) :: name
      integer :: dot, first

      dot = index(name, '.')
      first = first_row(name(:dot - 1), name(dot + 1:))
      do row = first, size(entries)
         if (values(row)%in_force .and. entries(row)%group == name(:dot - 1) &
            .and. entries(row)%key == name(dot + 1:)) return
      end do
      row = first
   end function row_of

end module polydem_fill_settings
