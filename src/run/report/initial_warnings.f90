!> Warnings about the initial state of a scene, the same for `check` and for the head of the log of a run.
!>
!> Each warning names a probable mistake of the input. The warnings cost no time in a step; the guards that a run
!> evaluates during its steps are in `monitor`.
module polydem_initial_warnings
   use polydem_elementary, only: hypotenuse, two_pi
   use polydem_entry_warnings, only: warn_of_entries
   use polydem_fixed_overlaps, only: find_fixed_overlaps
   use polydem_guard, only: shorter_step
   use polydem_kinds, only: ip, lp, wp
   use polydem_log, only: log_t
   use polydem_parts, only: parts_t
   use polydem_regions, only: is_beside_walls
   use polydem_settings, only: forces_settings_t, grains_settings_t, settings_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: counted, text_t, to_text
   use polydem_scene_measures, only: scene_measures_t
   use polydem_removed_walls, only: warn_of_removed
   use polydem_wall_warnings, only: add
   implicit none
   private
   public :: warn_of_risks

   !> Depth of an initial overlap, as a fraction of the thickness of the thinner body, above which there is a warning
   real(wp), parameter :: deep_fraction = 0.05_wp
   !> Warning limit of the distance that a body moves in a step, and of the overlap that an impact causes, as a fraction
   !> of the thickness of the thinnest body
   real(wp), parameter :: fast_fraction = 0.25_wp
   !> Plausible range of the median diameter [m]
   real(wp), parameter :: diameters(2) = [1.0e-6_wp, 1.0_wp]
   !> Range of densities of solids, including foams [kg/m3]
   real(wp), parameter :: densities(2) = [1.0_wp, 3.0e4_wp]
   !> Greatest density that was probably meant in g/cm3: it is less than that of most foams [kg/m3]
   real(wp), parameter :: greatest_in_grams = 12.0_wp
   !> Ratio of the pressure of the weight to the stiffness above which bodies at rest overlap deeply, and one at which
   !> they overlap little [1]
   real(wp), parameter :: softest = 0.05_wp, firm = 0.01_wp
   !> Number of last bits of a coordinate that a displacement per step and a depth of overlap need: the error of one of
   !> them is then 2.5 %
   real(wp), parameter :: needed_bits = 20.0_wp

contains

   !> Write a warning about each risk of the initial state.
   subroutine warn_of_risks(simulation, measures, log, n)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(log_t), intent(inout) :: log
      !> Number of warnings
      integer(lp), intent(out) :: n
      type(text_t), allocatable :: warnings(:)
      character(len=:), allocatable :: undamped
      integer :: k

      allocate (warnings(0))
      if (measures%free > 0_lp) call warn_of_units(simulation, measures, warnings)
      call warn_of_step(simulation, warnings)
      call warn_of_overlaps(simulation, measures, warnings)
      call warn_of_speeds(simulation, measures, warnings)
      call warn_of_fixed_overlaps(simulation, warnings)
      call warn_of_regions(simulation%settings, simulation%forces, warnings)
      call warn_of_tables(simulation, warnings)
      if (measures%free > 0_lp) call warn_of_rounding(simulation, measures, warnings)
      call warn_of_entries(simulation, measures, warnings)
      call warn_of_removed(simulation%settings, warnings)
      ! A law that is not conservative needs damping, which removes the energy that the law adds.
      undamped = simulation%law%undamped_warning()
      if (undamped /= '') call add(warnings, undamped)
      do k = 1, size(warnings)
         call log%write_line('warning: '//warnings(k)%text)
      end do
      n = size(warnings, kind=lp)
   end subroutine warn_of_risks

   !> Warn of tables of motions that end before the run does.
   subroutine warn_of_tables(simulation, warnings)
      type(simulation_t), intent(in) :: simulation
      type(text_t), allocatable, intent(inout) :: warnings(:)
      real(wp) :: last
      integer :: k

      do k = 1, size(simulation%walls%motions)
         associate (motion => simulation%walls%motions(k)%motion, duration => simulation%settings%integrate%duration)
            if (.not. motion%rests_after < huge(1.0_wp)) cycle
            last = motion%start + motion%rests_after
            if (last < min(duration, motion%end)*(1.0_wp - 1.0e-9_wp)) call add(warnings, &
               'the table of a motion ends at '//to_text(last, 3)//' s, before the run does at '// &
               to_text(duration, 3)//' s; from then on its bodies rest in the last pose')
         end associate
      end do
   end subroutine warn_of_tables

   !> Warn of lengths and densities that are implausible in SI units.
   subroutine warn_of_units(simulation, measures, warnings)
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(text_t), allocatable, intent(inout) :: warnings(:)

      associate (median => measures%diameter(2), density => measures%density)
         if (median > diameters(2) .or. median < diameters(1)) call add(warnings, &
            'lengths are in metres: the median diameter of the free bodies is '//to_text(median, 3)// &
            ' m; convert lengths that are given in other units')
         if (density(2) > densities(2) .or. density(1) < densities(1)) call add(warnings, &
            'masses are in kg per metre of depth, lengths in metres: free bodies have densities from '// &
            to_text(density(1), 3)//' to '//to_text(density(2), 3)//' kg/m3, which no solid has; check the units')
         if (density(1) >= densities(1) .and. density(1) <= greatest_in_grams) call add(warnings, &
            'densities are in kg/m3: that of the lightest free body is '//to_text(density(1), 3)// &
            ' kg/m3, as of a light foam; did you mean '//to_text(1000.0_wp*density(1), 3)//' kg/m3, which is '// &
            to_text(density(1), 3)//' g/cm3?')
      end associate
      associate (scene => simulation%settings%scene)
         if (scene%name == 'hopper' .and. scene%opening < measures%diameter(1)) call add(warnings, &
            'opening = '//to_text(scene%opening, 3)//' m is less than the diameter of the smallest grain, '// &
            to_text(measures%diameter(1), 3)//' m: hardly any grain flows out. Increase opening in &scene')
      end associate
      if (measures%softness > softest .and. simulation%pressure%is_of_bodies) call add(warnings, &
         'the pressure under the full height of the free bodies is '//to_text(measures%softness, 3)// &
         ' of the least stiffness: the lowest bodies overlap deeply. Increase stiffness in &forces or &material '// &
         '(with '//to_text(measures%stiffness*measures%softness/firm, 2)//' it is '//to_text(firm, 2)// &
         '), and check that lengths are in metres')
   end subroutine warn_of_units

   !> Warn of groups of grains that will meet no wall.
   subroutine warn_of_regions(settings, forces, warnings)
      type(settings_t), intent(in) :: settings
      !> Parameters of the forces at the start
      type(forces_settings_t), intent(in) :: forces
      type(text_t), allocatable, intent(inout) :: warnings(:)
      type(parts_t) :: parts
      integer :: k

      if (size(settings%wall) == 0 .or. settings%scene%bodies_file /= '') return
      ! Walls that go elsewhere may come to the grains.
      if (any([(moves_away(settings%motion(k)%kind), k=1, size(settings%motion))]) .or. size(settings%load) > 0) return
      parts%walls = settings%wall
      do k = 1, size(settings%grains)
         if (is_beside_walls(settings%grains(k), parts, ways_of(settings, forces, settings%grains(k)))) &
            call add(warnings, 'the grains of group '//settings%grains(k)%name//' start beside '// &
                     'all walls and will meet none; move their region between or above the walls')
      end do
   end subroutine warn_of_regions

   !> Whether a motion brings walls to other places
   pure logical function moves_away(kind)
      character(len=*), intent(in) :: kind

      moves_away = kind /= 'oscillation' .and. kind /= 'conveyor'
   end function moves_away

   !> Whether the grains of a group go against and along each axis: by gravity, with their velocity, or through the
   !> copies of a periodic cell, (axis, sense)
   pure function ways_of(settings, forces, group) result(ways)
      type(settings_t), intent(in) :: settings
      !> Parameters of the forces at the start
      type(forces_settings_t), intent(in) :: forces
      type(grains_settings_t), intent(in) :: group
      logical :: ways(2, 2)
      integer :: axis, k

      ways(:, 1) = group%velocity < 0.0_wp .or. forces%gravity < 0.0_wp
      ways(:, 2) = group%velocity > 0.0_wp .or. forces%gravity > 0.0_wp
      do k = 1, size(settings%stage)
         if (size(settings%stage(k)%gravity) /= 2) cycle
         ways(:, 1) = ways(:, 1) .or. settings%stage(k)%gravity < 0.0_wp
         ways(:, 2) = ways(:, 2) .or. settings%stage(k)%gravity > 0.0_wp
      end do
      do axis = 1, 2
         ways(axis, :) = ways(axis, :) .or. group%speed > 0.0_wp .or. abs(forces%turn_rate) > 0.0_wp .or. &
            abs(forces%shake(axis)) > 0.0_wp .or. scan(settings%cell%periodic, 'xy'(axis:axis)) > 0
      end do
   end function ways_of

   !> Warn of a time step that is unstable as soon as bodies touch.
   subroutine warn_of_step(simulation, warnings)
      type(simulation_t), intent(in) :: simulation
      type(text_t), allocatable, intent(inout) :: warnings(:)

      character(len=:), allocatable :: remedy

      remedy = 'Reduce dt, or omit it'
      if (.not. simulation%settings%integrate%dt > 0.0_wp) remedy = 'Reduce safety_factor in &integrate'
      associate (dt => simulation%dt, stable => simulation%expected_stable_step)
         if (dt <= stable) return
         call add(warnings, 'dt = '//to_text(dt)//' s is '//to_text(dt/stable, 3)//' times the stable time step '// &
                  to_text(stable, 3)//' s estimated from the shapes: the integration of contacts of '// &
                  'these bodies will be unstable. '//remedy)
      end associate
   end subroutine warn_of_step

   !> Warn of initial overlaps whose elastic energy is large.
   subroutine warn_of_overlaps(simulation, measures, warnings)
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(text_t), allocatable, intent(inout) :: warnings(:)
      character(len=:), allocatable :: remedy
      logical :: is_energetic

      if (measures%contacts == 0_lp) return
      is_energetic = measures%stored > measures%kinetic + measures%potential .and. &
         measures%depth_share > simulation%settings%guards%listed_depth
      if (measures%depth_share <= deep_fraction .and. .not. is_energetic) return
      ! Contacts of a result are as deep as loads have made them.
      remedy = '. The result from which the run starts has them'
      if (simulation%settings%scene%name /= 'result') remedy = '. Separate the bodies: '// &
         trim(merge('set   ', 'reduce', .not. simulation%settings%scene%remove_overlap > 0.0_wp))// &
         ' remove_overlap in &scene'
      call add(warnings, 'deep contacts at the start: '//to_text(measures%deep)//'; in the deepest '// &
               measures%deepest//'. All contacts store '//to_text(measures%stored, 3)//' J/m, which can '// &
               'accelerate all free bodies to '// &
               to_text(sqrt(2.0_wp*measures%stored/max(measures%mass(3), tiny(1.0_wp))), 3)// &
               ' m/s'//remedy)
   end subroutine warn_of_overlaps

   !> Warn of bodies that can pass through others: by moving too far in one step, or by their momentum.
   subroutine warn_of_speeds(simulation, measures, warnings)
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(text_t), allocatable, intent(inout) :: warnings(:)
      character(len=:), allocatable :: mover, thinnest
      real(wp) :: fastest

      associate (s => simulation)
         thinnest = ' times the thickness of the thinnest body ('//to_text(measures%thickness, 3)//' m, body '// &
            to_text(measures%thinnest)//')'
         mover = 'body '//to_text(measures%farthest)
         if (measures%move < 1.001_wp*measures%wall_speed*s%dt) &
            mover = mover//motion_text(s%settings, measures%move/s%dt)
         if (measures%move > fast_fraction*measures%thickness) call add(warnings, mover//' moves '// &
            to_text(measures%move/measures%thickness, 3)//thinnest// &
            ' in one step: it may pass through other bodies undetected; '//shorter_step(s%settings%integrate))
         fastest = max(measures%wall_speed, merge(measures%fall_speed, 0.0_wp, measures%free > 0_lp))
         mover = 'a body that falls through the extent'
         if (measures%wall_speed >= fastest) mover = 'a wall'//motion_text(s%settings, fastest)
         if (measures%move <= fast_fraction*measures%thickness .and. fastest*s%dt > fast_fraction*measures%thickness) &
            call add(warnings, mover//' reaches '//to_text(fastest, 3)//' m/s and then moves '// &
            to_text(fastest*s%dt/measures%thickness, 3)//thinnest//' in one step; '//shorter_step(s%settings%integrate))
         if (measures%impact > fast_fraction*measures%thickness) call add(warnings, 'body '// &
            to_text(measures%fastest)//' is so fast that stopping it takes an overlap of '// &
            'about '//to_text(measures%impact, 3)//' m, '//to_text(measures%impact/measures%thickness, 3)//thinnest// &
            ': it may pass through other bodies. Increase stiffness in &forces, or use thicker bodies')
      end associate
   end subroutine warn_of_speeds

   !> Clause about the oscillation that gives a wall most of its speed; empty if there is none
   pure function motion_text(settings, speed) result(text)
      type(settings_t), intent(in) :: settings
      !> Speed of the wall [m/s]
      real(wp), intent(in) :: speed
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      do k = 1, size(settings%motion)
         associate (motion => settings%motion(k))
            associate (amplitude => hypotenuse(motion%amplitude(1), motion%amplitude(2)))
               if (.not. two_pi*motion%frequency*amplitude > 0.5_wp*speed) cycle
               text = ' that shakes with the amplitude '//to_text(amplitude, 3)//' m and the frequency '// &
                  to_text(motion%frequency, 3)//' Hz (is it in m and in Hz?)'
            end associate
         end associate
      end do
   end function motion_text

   !> Warn of fixed bodies that overlap at the start, unless a load moves one of them: a load-controlled wall passes
   !> over others. Every rank has all of them.
   subroutine warn_of_fixed_overlaps(simulation, warnings)
      type(simulation_t), intent(in) :: simulation
      type(text_t), allocatable, intent(inout) :: warnings(:)
      integer(lp) :: n
      integer(ip) :: first, second
      real(wp) :: area, place(2)
      logical, allocatable :: is_loaded(:)
      integer :: k

      associate (bodies => simulation%bodies)
         is_loaded = spread(.false., 1, bodies%n)
         do k = 1, size(simulation%walls%wall)
            if (size(simulation%walls%wall(k)%loads) > 0) is_loaded(simulation%walls%wall(k)%slots) = .true.
         end do
         call find_fixed_overlaps(bodies, is_loaded, n, first, second, area, place)
         if (n == 0_lp) return
         call add(warnings, counted(n, 'pair')//' of fixed bodies overlap, most of all the bodies '// &
                  to_text(bodies%id(first))//' and '//to_text(bodies%id(second))//' in '//to_text(area, 3)// &
                  ' m2 near ('//to_text(place(1), 3)//', '//to_text(place(2), 3)//') m: a body that touches both '// &
                  'there is pushed twice. Let walls share edges instead')
      end associate
   end subroutine warn_of_fixed_overlaps

   !> Warn of bodies so far from the origin that rounding of their coordinates holds them fast, or spoils their forces.
   subroutine warn_of_rounding(simulation, measures, warnings)
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(text_t), allocatable, intent(inout) :: warnings(:)
      character(len=*), parameter :: remedy = 'Move the origin to the bodies (./polydem import --origin centre)'
      character(len=:), allocatable :: bits

      associate (s => simulation, bit => measures%last_bit, depth => measures%static_depth)
         bits = ' of the last bit of the coordinates ('//to_text(bit, 3)//' m, as far from the origin as the free '// &
            'bodies are)'
         if (measures%speed > 0.0_wp .and. measures%speed*s%dt < needed_bits*bit .and. &
             s%settings%integrate%accumulation /= 'compensated') call add(warnings, &
            'the fastest free body moves '//to_text(measures%speed*s%dt, 3)//' m per step, '// &
            to_text(measures%speed*s%dt/bit, 3)//bits//': rounding changes its speed, or stops it. '//remedy// &
            ", set accumulation = 'compensated' in &integrate (with scheme velocity_verlet), or increase dt")
         if (depth(1) > 0.0_wp .and. depth(1) < needed_bits*bit) call add(warnings, &
            'the lightest free body sinks by about '//to_text(depth(1), 3)//' m under its weight, '// &
            to_text(depth(1)/bit, 3)//bits//', and by '//to_text(depth(2), 3)//' m under the full height of the '// &
            'bodies: rounding changes the forces of contacts. '//remedy//', or decrease stiffness in &forces')
      end associate
   end subroutine warn_of_rounding

end module polydem_initial_warnings
