!> Warnings of a scene as it is at the start, for `check` and for the head of the log of a run: the same for both.
!>
!> They say what is probably a mistake and cost nothing in a step. What a run watches in its steps is in `watch`.
module polydem_dangers
   use polydem_body_sizes, only: thickness_of_bodies
   use polydem_depths, only: count_deeper, deepest_contact, depth_share, depth_text
   use polydem_guards, only: greatest_move
   use polydem_kinds, only: ip, lp, wp
   use polydem_log, only: log_t
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   use polydem_survey, only: survey_scene, survey_t
   implicit none
   private
   public :: warn_of_dangers

   !> Share of the thinner body above which an overlap at the start is warned of
   real(wp), parameter :: deep = 0.05_wp
   !> Share of the thinnest body that nothing should move in a step, and that no impact should exceed
   real(wp), parameter :: far = 0.25_wp
   !> Median diameters of grains that are measured in metres [m]
   real(wp), parameter :: diameters(2) = [1.0e-6_wp, 1.0_wp]
   !> Densities of solids, foams included [kg/m3]
   real(wp), parameter :: densities(2) = [1.0_wp, 3.0e4_wp]
   !> More than the gravity in any centrifuge for soils [m/s2]
   real(wp), parameter :: strongest_gravity = 5.0e3_wp
   !> Pressure of the weight over the stiffness above which grains lie deep in each other
   real(wp), parameter :: softest = 0.05_wp

   !> Where warnings go
   type :: teller_t
      !> Warnings so far
      integer(lp) :: n = 0_lp
   contains
      procedure :: tell
   end type teller_t

contains

   !> Write a warning of each danger.
   subroutine warn_of_dangers(simulation, log, n)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      !> Log
      type(log_t), intent(inout) :: log
      !> Number of warnings
      integer(lp), intent(out) :: n
      type(teller_t) :: teller
      type(survey_t) :: survey

      call survey_scene(simulation, survey)
      if (size(simulation%bodies%free) > 0) call warn_of_units(simulation, survey, teller, log)
      call warn_of_step(simulation, teller, log)
      call warn_of_overlaps(simulation, survey, teller, log)
      call warn_of_speeds(simulation, survey, teller, log)
      call warn_of_law(simulation, teller, log)
      n = teller%n
   end subroutine warn_of_dangers

   !> Numbers that are hardly meant in SI units.
   subroutine warn_of_units(simulation, survey, teller, log)
      type(simulation_t), intent(in) :: simulation
      type(survey_t), intent(in) :: survey
      type(teller_t), intent(inout) :: teller
      type(log_t), intent(inout) :: log
      real(wp) :: gravity

      associate (median => survey%diameter(2), density => survey%density)
         if (median > diameters(2) .or. median < diameters(1)) call teller%tell(log, &
            'lengths are in metres: the median diameter of the free bodies is '//to_text(median, 3)// &
            ' m. If they were meant in other units, convert them')
         if (density(2) > densities(2) .or. density(1) < densities(1)) call teller%tell(log, &
            'masses are in kg per metre of depth, lengths in metres: free bodies have densities from '// &
            to_text(density(1), 3)//' to '//to_text(density(2), 3)//' kg/m3, which no solid has')
      end associate
      associate (g => simulation%settings%forces%gravity)
         gravity = hypot(g(1), g(2))
      end associate
      if (gravity > strongest_gravity) call teller%tell(log, &
         'gravity is in m/s2: '//to_text(gravity, 3)//' m/s2 are '//to_text(gravity/9.81_wp, 3)// &
         ' times that of the earth')
      if (survey%softness > softest) call teller%tell(log, &
         'the weight of free bodies that lie on each other over their whole height is '// &
         to_text(survey%softness, 3)//' of the stiffness: those below are pressed deep into each other. '// &
         'Take a greater stiffness, and look if lengths are in metres')
   end subroutine warn_of_units

   !> A step that is unstable as soon as bodies touch.
   subroutine warn_of_step(simulation, teller, log)
      type(simulation_t), intent(in) :: simulation
      type(teller_t), intent(inout) :: teller
      type(log_t), intent(inout) :: log

      associate (dt => simulation%dt, stable => simulation%expected_stable_step)
         if (dt <= stable) return
         call teller%tell(log, 'dt = '//to_text(dt)//' s is '//to_text(dt/stable, 3)//' times the stable step '// &
                          to_text(stable, 3)//' s expected from the shapes: contacts of such bodies will be '// &
                          'unstable. Take a smaller dt, or leave it out')
      end associate
   end subroutine warn_of_step

   !> Overlaps that set energy free which nobody meant to be there.
   subroutine warn_of_overlaps(simulation, survey, teller, log)
      type(simulation_t), intent(in) :: simulation
      type(survey_t), intent(in) :: survey
      type(teller_t), intent(inout) :: teller
      type(log_t), intent(inout) :: log
      real(wp), allocatable :: thickness(:)
      real(wp) :: share
      integer(ip) :: c
      logical :: is_energetic

      associate (s => simulation)
         thickness = thickness_of_bodies(s%bodies)
         c = deepest_contact(s%contacts, thickness)
         if (c == 0_ip) return
         share = depth_share(s%contacts, thickness, c)
         is_energetic = survey%stored > survey%kinetic + survey%potential .and. share > s%settings%guards%listed_depth
         if (share <= deep .and. .not. is_energetic) return
         call teller%tell(log, to_text(count_deeper(s%contacts, thickness, s%settings%guards%listed_depth))// &
                          ' contacts are deep at the start: '//depth_text(s%bodies, s%contacts, thickness, c)// &
                          '. All contacts hold '//to_text(survey%stored, 3)//' J/m, enough for '// &
                          to_text(sqrt(2.0_wp*survey%stored/max(survey%mass(3), tiny(1.0_wp))), 3)// &
                          ' m/s of all free bodies. Move bodies apart (relaxed_depth in &guards)')
      end associate
   end subroutine warn_of_overlaps

   !> Bodies that may pass through others: in a step, or by their momentum.
   subroutine warn_of_speeds(simulation, survey, teller, log)
      type(simulation_t), intent(in) :: simulation
      type(survey_t), intent(in) :: survey
      type(teller_t), intent(inout) :: teller
      type(log_t), intent(inout) :: log
      character(len=:), allocatable :: thinnest
      real(wp) :: move, fastest
      integer(ip) :: slot

      associate (s => simulation)
         thinnest = ' of the '//to_text(survey%thickness, 3)//' m of the thinnest body, '// &
            to_text(s%bodies%id(survey%thinnest))//','
         call greatest_move(s%guard, s%bodies, s%dt, move, slot)
         if (move > far*survey%thickness) call teller%tell(log, 'body '//to_text(s%bodies%id(slot))//' moves '// &
            to_text(move/survey%thickness, 3)//thinnest//' in a step: it may pass through unseen. Take a smaller dt')
         fastest = max(survey%wall_speed, merge(survey%fall_speed, 0.0_wp, size(s%bodies%free) > 0))
         if (move <= far*survey%thickness .and. fastest*s%dt > far*survey%thickness) call teller%tell(log, &
            'walls reach '//to_text(survey%wall_speed, 3)//' m/s, a fall through the extent '// &
            to_text(survey%fall_speed, 3)//' m/s: that is '//to_text(fastest*s%dt/survey%thickness, 3)//thinnest// &
            ' in a step. Take a smaller dt')
         if (survey%impact > far*survey%thickness) call teller%tell(log, 'body '// &
            to_text(s%bodies%id(survey%fastest))//' is so fast that it takes an overlap of about '// &
            to_text(survey%impact, 3)//' m to stop it, '//to_text(survey%impact/survey%thickness, 3)//thinnest// &
            ' and may pass through. Take a greater stiffness, or a thicker body')
      end associate
   end subroutine warn_of_speeds

   !> The area law is not conservative; only damping hides it.
   subroutine warn_of_law(simulation, teller, log)
      type(simulation_t), intent(in) :: simulation
      type(teller_t), intent(inout) :: teller
      type(log_t), intent(inout) :: log

      associate (forces => simulation%settings%forces)
         if (forces%law /= 'area') return
         if (forces%damping /= 'none') then
            if (forces%restitution > 0.0_wp .and. forces%restitution < 1.0_wp) return
            if (forces%restitution <= 0.0_wp .and. forces%damping_coefficient > 0.0_wp) return
         end if
      end associate
      call teller%tell(log, 'the area law is not conservative, and without damping it heats grains whatever the '// &
                       'step: the kinetic energy of a gas grew by a third in 0.2 s. Take law = ''conservative'' in '// &
                       '&forces, or damping')
   end subroutine warn_of_law

   !> Write a warning, and count it.
   subroutine tell(self, log, text)
      class(teller_t), intent(inout) :: self
      !> Log
      type(log_t), intent(inout) :: log
      !> The warning
      character(len=*), intent(in) :: text

      self%n = self%n + 1_lp
      call log%write_line('warning: '//text)
   end subroutine tell

end module polydem_dangers
