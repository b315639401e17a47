!> Warnings about entries of the namelist that are probably a mistake: unusual values, what never happens, stresses that
!> the stiffness does not bear, walls that are pulled away, falls that nothing stops, sinks that bodies pass, materials
!> that nothing has, and runs that take too many steps.
module polydem_entry_warnings
   use polydem_kinds, only: ip, lp, wp
   use polydem_run_duration, only: longest_run, longest_stage, number_of_stage
   use polydem_scene_measures, only: scene_measures_t
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_source_locations, only: place_of
   use polydem_static_pressure, only: load_pressure
   use polydem_strings, only: text_t, to_text
   use polydem_wall_warnings, only: add, warn_of_copies, warn_of_pulls, warn_of_rows
   implicit none
   private
   public :: warn_of_entries

   !> Relative length of rounding errors
   real(wp), parameter :: rounding = 1.0e-9_wp
   !> Ratio of a stress to the stiffness above which contacts are deep, and one at which they are not
   real(wp), parameter :: deep_stress = 0.01_wp, shallow_stress = 1.0e-3_wp
   !> How a time is to the end of the run
   character(len=*), parameter :: behind = 'is not before the end of the run'
   !> Number of steps above which a run takes days
   integer(lp), parameter :: many_steps = 10_lp**9

contains

   !> Append a warning about each such entry.
   subroutine warn_of_entries(simulation, measures, warnings)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      !> The warnings so far
      type(text_t), allocatable, intent(inout) :: warnings(:)

      if (allocated(simulation%settings%unusual)) warnings = [warnings, simulation%settings%unusual]
      if (.not. is_cut_short(simulation%settings)) then
         call warn_of_times(simulation%settings, warnings)
         call warn_of_intervals(simulation, warnings)
      end if
      call warn_of_stresses(simulation, measures, warnings)
      if (measures%free > 0_lp) then
         call warn_of_pulls(simulation, measures, warnings)
         call warn_of_endless_fall(simulation, measures, warnings)
      end if
      call warn_of_sinks(simulation, warnings)
      call warn_of_rows(simulation%settings, warnings)
      call warn_of_copies(simulation%settings, warnings)
      if (allocated(measures%of_material)) call warn_of_materials(simulation%settings, measures%of_material, warnings)
      call warn_of_steps(simulation, measures, warnings)
   end subroutine warn_of_entries

   !> Warn of what begins behind the end of the run, and of ramps that are longer than the time that they have. A run
   !> that the command line makes shorter than its namelist is meant so.
   subroutine warn_of_times(settings, warnings)
      type(settings_t), intent(in) :: settings
      type(text_t), allocatable, intent(inout) :: warnings(:)
      integer :: k

      do k = 1, size(settings%motion)
         associate (motion => settings%motion(k))
            call begin('motion', motion%name, 'start', motion%start)
            call grow('motion', motion%name, 'ramp', motion%ramp, motion%stage, motion%start, motion%end)
         end associate
      end do
      do k = 1, size(settings%load)
         associate (load => settings%load(k))
            call begin('load', load%name, 'start', load%start)
            call grow('load', load%name, 'ramp', load%ramp, load%stage, load%start, load%end)
         end associate
      end do
      do k = 1, size(settings%wall)
         call begin('wall', settings%wall(k)%name, 'vanish_at', settings%wall(k)%vanish_at)
      end do
      call grow('cell', '', 'shear_ramp', settings%cell%shear_ramp, '', 0.0_wp, 0.0_wp)
      call grow('cell', '', 'stress_ramp', settings%cell%stress_ramp, settings%cell%stage, 0.0_wp, 0.0_wp)

   contains

      !> Warn of a time that is not before the end of the run.
      subroutine begin(group, name, key, time)
         character(len=*), intent(in) :: group, name, key
         real(wp), intent(in) :: time

         call compare(settings, group, name, key, time, longest_run(settings), behind, 'it never happens', warnings)
      end subroutine begin

      !> Warn of a ramp that is longer than its stage, or the time from a start to an end, 0 without one.
      subroutine grow(group, name, key, ramp, stage, start, end)
         character(len=*), intent(in) :: group, name, key
         real(wp), intent(in) :: ramp
         character(len=*), intent(in) :: stage
         real(wp), intent(in) :: start, end
         real(wp) :: time

         time = rest_of(settings, stage, start, end)
         ! What does not begin has a warning already. A ramp may be as long as its time.
         if (time > 0.0_wp .and. ramp > time*(1.0_wp + rounding)) call compare(settings, group, name, key, ramp, time, &
            'is longer than the time that it has', 'it is not complete at the end', warnings)
      end subroutine grow

   end subroutine warn_of_times

   !> Warn of intervals that are longer than the run, or the stage.
   subroutine warn_of_intervals(simulation, warnings)
      type(simulation_t), intent(in) :: simulation
      type(text_t), allocatable, intent(inout) :: warnings(:)
      real(wp) :: run
      integer :: k

      associate (s => simulation%settings, dt => simulation%dt)
         run = longest_run(s)
         do k = 1, size(s%source)
            call compare(s, 'source', s%source(k)%name, 'interval', real(s%source(k)%interval, wp)*dt, run, behind, &
                         'bodies enter at most once', warnings)
         end do
         do k = 1, size(s%sink)
            call compare(s, 'sink', s%sink(k)%name, 'interval', real(s%sink(k)%interval, wp)*dt, run, behind, &
                         'no body leaves', warnings)
         end do
         do k = 1, size(s%stage)
            if (s%stage(k)%until /= 'duration') call compare(s, 'stage', s%stage(k)%name, 'check', &
               real(s%stage(k)%check, wp)*dt, s%stage(k)%longest, 'is not less than longest', &
               'the condition is checked only there', warnings)
         end do
         call compare(s, 'output', '', 'frame_interval', s%output%frame_interval, run, behind, &
                      'there are only the first and the last frame', warnings)
         call compare(s, 'output', '', 'series_interval', s%output%series_interval, run, behind, &
                      'the series has hardly a row', warnings)
      end associate
   end subroutine warn_of_intervals

   !> Warn if a time is given and not less than its limit.
   subroutine compare(settings, group, name, key, time, limit, relation, effect, warnings)
      type(settings_t), intent(in) :: settings
      !> Entry that gives the time
      character(len=*), intent(in) :: group, name, key
      !> The time, and its limit [s]
      real(wp), intent(in) :: time, limit
      !> How the time is to the limit, and what follows
      character(len=*), intent(in) :: relation, effect
      type(text_t), allocatable, intent(inout) :: warnings(:)
      character(len=:), allocatable :: full

      if (.not. time > 0.0_wp .or. time < limit*(1.0_wp - rounding)) return
      full = group
      if (name /= '') full = group//'.'//name
      call add(warnings, place_of(settings, full, key)//': '''//key//''' in &'//trim(group//' '//name)//', '// &
               to_text(time, 3)//' s, '//relation//', '//to_text(limit, 3)//' s: '//effect)
   end subroutine compare

   !> Time that a load or a motion has: that of its stage, or from its start to its end or that of the run [s]
   pure real(wp) function rest_of(settings, stage, start, end) result(rest)
      type(settings_t), intent(in) :: settings
      !> Name of the stage, empty without one
      character(len=*), intent(in) :: stage
      !> Start and end, 0 without one [s]
      real(wp), intent(in) :: start, end
      integer(ip) :: k

      k = number_of_stage(settings, stage)
      if (k > 0_ip) then
         rest = longest_stage(settings%stage(k))
      else
         rest = longest_run(settings)
         if (end > 0.0_wp) rest = min(rest, end)
         rest = rest - start
      end if
   end function rest_of

   !> Whether the command line gives the duration of the run or of a stage
   pure logical function is_cut_short(settings)
      type(settings_t), intent(in) :: settings
      character(len=*), parameter :: option = '--set '
      integer :: k

      is_cut_short = index(place_of(settings, 'integrate', 'duration'), option) == 1
      do k = 1, size(settings%stage)
         associate (group => 'stage.'//settings%stage(k)%name)
            is_cut_short = is_cut_short .or. index(place_of(settings, group, 'duration'), option) == 1 .or. &
               index(place_of(settings, group, 'longest'), option) == 1
         end associate
      end do
   end function is_cut_short

   !> Warn of stresses and cohesion that are a large part of the stiffness.
   subroutine warn_of_stresses(simulation, measures, warnings)
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(text_t), allocatable, intent(inout) :: warnings(:)
      character(len=:), allocatable :: key
      integer :: k

      associate (s => simulation%settings, law => simulation%law)
         do k = 1, size(s%load)
            key = 'mass'
            if (abs(s%load(k)%force) > 0.0_wp) key = 'force'
            if (abs(s%load(k)%stress) > 0.0_wp) key = 'stress'
            call weigh('load.'//s%load(k)%name, key, '&load '//s%load(k)%name, load_pressure(simulation, s%load(k), k))
         end do
         if (s%cell%stress_controlled /= 'none') call weigh('cell', 'stress', '&cell', maxval(abs(s%cell%stress)))
         call weigh('forces', 'cohesion', '&forces or &material', law%pairs%cohesion%greatest())
      end associate

   contains

      !> Warn if a stress is a large part of the least stiffness.
      subroutine weigh(group, key, name, stress)
         character(len=*), intent(in) :: group, key, name
         real(wp), intent(in) :: stress
         character(len=:), allocatable :: text

         associate (share => stress/measures%stiffness)
            if (share <= deep_stress) return
            text = 'makes contacts about this part of a grain deep, while real grains hardly deform'
            if (share > 1.0_wp) text = 'is more than grains of this stiffness bear: they pass through each other'
            call add(warnings, place_of(simulation%settings, group, key)//': '''//key//''' in '//name//' acts with '// &
                     to_text(stress, 3)//' N/m2, '//to_text(share, 2)//' of the least stiffness, and '//text// &
                     '. With stiffness = '//to_text(stress/shallow_stress, 2)//' in &forces (or &material) it is '// &
                     to_text(shallow_stress, 2))
         end associate
      end subroutine weigh

   end subroutine warn_of_stresses

   !> Warn of gravity along an axis that repeats, where nothing stops the fall.
   subroutine warn_of_endless_fall(simulation, measures, warnings)
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(text_t), allocatable, intent(inout) :: warnings(:)

      associate (s => simulation%settings, cell => simulation%bodies%cell)
         if (measures%fixed > 0_lp .or. .not. cell%is_periodic) return
         if (s%forces%drag > 0.0_wp .or. abs(s%forces%turn_rate) > 0.0_wp) return
         if (.not. any(abs(s%forces%gravity) > 0.0_wp .and. cell%size > 0.0_wp)) return
         call add(warnings, place_of(s, 'forces', 'gravity')//': the cell repeats along gravity and has no walls, '// &
                  'so nothing stops the fall of its bodies. Give gravity = 0, 0 in &forces, walls or drag')
      end associate
   end subroutine warn_of_endless_fall

   !> Warn of sinks that bodies may pass between two times at which they may leave.
   subroutine warn_of_sinks(simulation, warnings)
      type(simulation_t), intent(in) :: simulation
      type(text_t), allocatable, intent(inout) :: warnings(:)
      real(wp) :: thickness, way
      integer :: axis, k

      do k = 1, size(simulation%settings%sink)
         associate (sink => simulation%settings%sink(k), gravity => simulation%forces%gravity)
            axis = maxloc(abs(gravity), 1)
            thickness = minval(sink%high - sink%low)
            if (any(abs(gravity) > 0.0_wp)) thickness = sink%high(axis) - sink%low(axis)
            way = simulation%expected%speed*real(sink%interval, wp)*simulation%dt
            if (way <= thickness) cycle
            call add(warnings, place_of(simulation%settings, 'sink.'//sink%name, 'interval')//': bodies of up to '// &
                     to_text(simulation%expected%speed, 3)//' m/s ('//simulation%expected%origin//') move '// &
                     to_text(way, 3)//' m in the '//to_text(sink%interval)//' steps between two times at which '// &
                     'they may leave, but &sink '//sink%name//' is only '//to_text(thickness, 3)//' m '// &
                     trim(merge('wide', 'high', axis == 1))//': they pass it. Enlarge it, or reduce ''interval''')
         end associate
      end do
   end subroutine warn_of_sinks

   !> Warn of materials that no body has, and none that will enter.
   subroutine warn_of_materials(settings, of_material, warnings)
      type(settings_t), intent(in) :: settings
      !> Number of bodies of each material
      integer(lp), intent(in) :: of_material(0:)
      type(text_t), allocatable, intent(inout) :: warnings(:)
      logical :: is_used
      integer :: j, k

      do k = 1, size(settings%material)
         associate (name => settings%material(k)%name)
            is_used = of_material(k) > 0_lp
            do j = 1, size(settings%source)
               is_used = is_used .or. settings%source(j)%material == name .or. &
                  (settings%source(j)%material == '' .and. settings%scene%material == name)
            end do
            if (.not. is_used) call add(warnings, place_of(settings, 'material.'//name, 'name')//': nothing '// &
               'consists of &material '//name//'; name it in &grains, &wall or &source, or as ''material'' or '// &
               '''wall_material'' in &scene')
         end associate
      end do
   end subroutine warn_of_materials

   !> Warn of a run that takes days, and say what its step follows from.
   subroutine warn_of_steps(simulation, measures, warnings)
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(text_t), allocatable, intent(inout) :: warnings(:)
      character(len=:), allocatable :: reason
      integer :: k

      if (simulation%n_steps <= many_steps) return
      associate (s => simulation%settings)
         if (s%integrate%dt > 0.0_wp) then
            reason = 'dt in &integrate; the stable time step is '//to_text(simulation%expected_stable_step, 3)//' s'
         else
            reason = 'the stiffness, '//to_text(measures%stiffness, 3)//' N/m2'
            if (measures%free > 0_lp) reason = reason//', and the lightest body, '// &
               to_text(measures%mass(1), 2)//' kg/m'
            if (s%forces%rolling_friction > 1.0_wp) reason = reason//', with rolling_friction = '// &
               to_text(s%forces%rolling_friction, 2)
            do k = 1, size(s%load)
               if (s%load(k)%mass > 0.0_wp .and. s%load(k)%mass < measures%mass(1)) reason = &
                  'the mass of the wall in &load '//s%load(k)%name//', '//to_text(s%load(k)%mass, 2)//' kg/m'
            end do
         end if
      end associate
      call add(warnings, 'the run takes up to '//to_text(real(simulation%n_steps, wp), 3)//' steps of '// &
               to_text(simulation%dt, 3)//' s, which is a matter of days. dt follows from '//reason)
   end subroutine warn_of_steps

end module polydem_entry_warnings
