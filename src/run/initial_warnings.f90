!> Warnings about the initial state of a scene, the same for `check` and for the head of the log of a run.
!>
!> Each warning names a probable mistake of the input. The warnings cost no time in a step; the guards that a run
!> evaluates during its steps are in `monitor`.
module polydem_initial_warnings
   use polydem_elementary, only: hypotenuse
   use polydem_guards, only: shorter_step
   use polydem_kinds, only: lp, wp
   use polydem_log, only: log_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: text_t, to_text
   use polydem_scene_measures, only: scene_measures_t
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
   !> Gravity above that of any geotechnical centrifuge [m/s2]
   real(wp), parameter :: strongest_gravity = 5.0e3_wp
   !> Ratio of the pressure of the weight to the stiffness above which bodies at rest overlap deeply [1]
   real(wp), parameter :: softest = 0.05_wp

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
      ! A law that is not conservative needs damping, which removes the energy that the law adds.
      undamped = simulation%law%undamped_warning()
      if (undamped /= '') call add(warnings, undamped)
      do k = 1, size(warnings)
         call log%write_line('warning: '//warnings(k)%text)
      end do
      n = size(warnings, kind=lp)
   end subroutine warn_of_risks

   !> Warn of lengths, densities and gravity that are implausible in SI units.
   subroutine warn_of_units(simulation, measures, warnings)
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(text_t), allocatable, intent(inout) :: warnings(:)
      real(wp) :: gravity

      associate (median => measures%diameter(2), density => measures%density)
         if (median > diameters(2) .or. median < diameters(1)) call add(warnings, &
            'lengths are in metres: the median diameter of the free bodies is '//to_text(median, 3)// &
            ' m; convert lengths that are given in other units')
         if (density(2) > densities(2) .or. density(1) < densities(1)) call add(warnings, &
            'masses are in kg per metre of depth, lengths in metres: free bodies have densities from '// &
            to_text(density(1), 3)//' to '//to_text(density(2), 3)//' kg/m3, which no solid has; check the units')
      end associate
      associate (g => simulation%settings%forces%gravity)
         gravity = hypotenuse(g(1), g(2))
      end associate
      if (gravity > strongest_gravity) call add(warnings, &
         'gravity is in m/s2: '//to_text(gravity, 3)//' m/s2 is '//to_text(gravity/9.81_wp, 3)// &
         ' times that of the Earth; check the units')
      if (measures%softness > softest) call add(warnings, &
         'the pressure under the full height of the free bodies is '//to_text(measures%softness, 3)// &
         ' of the stiffness: the lowest bodies overlap deeply. Increase stiffness in &forces, and check that '// &
         'lengths are in metres')
   end subroutine warn_of_units

   !> Warn of a time step that is unstable as soon as bodies touch.
   subroutine warn_of_step(simulation, warnings)
      type(simulation_t), intent(in) :: simulation
      type(text_t), allocatable, intent(inout) :: warnings(:)

      character(len=:), allocatable :: remedy

      remedy = 'Reduce dt, or omit it'
      if (.not. simulation%settings%integrate%dt > 0.0_wp) remedy = 'Reduce fraction in &integrate'
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
      logical :: is_energetic

      if (measures%contacts == 0_lp) return
      is_energetic = measures%stored > measures%kinetic + measures%potential .and. &
         measures%depth_share > simulation%settings%guards%listed_depth
      if (measures%depth_share <= deep_fraction .and. .not. is_energetic) return
      call add(warnings, 'deep contacts at the start: '//to_text(measures%deep)//'; in the deepest '// &
               measures%deepest//'. All contacts store '//to_text(measures%stored, 3)//' J/m, which can '// &
               'accelerate all free bodies to '// &
               to_text(sqrt(2.0_wp*measures%stored/max(measures%mass(3), tiny(1.0_wp))), 3)// &
               ' m/s. Separate the bodies: set relaxed_depth in &guards')
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
         if (measures%move > fast_fraction*measures%thickness) call add(warnings, 'body '// &
            to_text(measures%farthest)//' moves '//to_text(measures%move/measures%thickness, 3)//thinnest// &
            ' in one step: it may pass through other bodies undetected; '//shorter_step(s%settings%integrate))
         fastest = max(measures%wall_speed, merge(measures%fall_speed, 0.0_wp, measures%free > 0_lp))
         mover = 'a body that falls through the extent'
         if (measures%wall_speed >= fastest) mover = 'a wall'
         if (measures%move <= fast_fraction*measures%thickness .and. fastest*s%dt > fast_fraction*measures%thickness) &
            call add(warnings, mover//' reaches '//to_text(fastest, 3)//' m/s and then moves '// &
            to_text(fastest*s%dt/measures%thickness, 3)//thinnest//' in one step; '//shorter_step(s%settings%integrate))
         if (measures%impact > fast_fraction*measures%thickness) call add(warnings, 'body '// &
            to_text(measures%fastest)//' is so fast that stopping it takes an overlap of '// &
            'about '//to_text(measures%impact, 3)//' m, '//to_text(measures%impact/measures%thickness, 3)//thinnest// &
            ': it may pass through other bodies. Increase stiffness in &forces, or use thicker bodies')
      end associate
   end subroutine warn_of_speeds

   !> Append a warning to the list.
   pure subroutine add(warnings, text)
      type(text_t), allocatable, intent(inout) :: warnings(:)
      character(len=*), intent(in) :: text

      warnings = [warnings, text_t(text)]
   end subroutine add

end module polydem_initial_warnings
