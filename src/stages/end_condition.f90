!> The condition that ends a stage of a run.
!>
!> A quantity is compared with a limit every so many steps, counted from the start of the stage, and at its last
!> possible step. Quantities are exact sums, so all ranks decide alike. A condition that holds at a step ends the stage
!> with the next one, so that the last step is known before it begins.
module polydem_end_condition
   use polydem_begin_stage, only: begin_stage, check_reference, find_last_steps, wall_vector
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t, raise, run_error
   use polydem_kinds, only: ip, lp, wp
   use polydem_quantities, only: count_grains, kinetic_energy, solid_fraction, stress, unbalanced_force
   use polydem_sample_area, only: find_area, sample_area_t
   use polydem_settings, only: stage_settings_t
   use polydem_simulation, only: simulation_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: to_text
   implicit none
   private
   public :: is_check, needs_contacts, measure_condition, decide_end, pass_end, condition_text, is_at_limit, &
             ended_at_once

contains

   !> Whether the condition of the present stage is checked after a step
   pure logical function is_check(simulation, step)
      type(simulation_t), intent(in) :: simulation
      !> The step, not before the present one
      integer(lp), intent(in) :: step

      is_check = .false.
      associate (stages => simulation%stages)
         if (stages%number == 0) return
         associate (stage => simulation%settings%stage(stages%number), passed => step - stages%first(stages%number))
            if (stage%until == 'duration' .or. stages%is_decided .or. passed <= 0_lp) return
            is_check = mod(passed, int(stage%check, lp)) == 0_lp .or. step == stages%last
         end associate
      end associate
   end function is_check

   !> Whether the check after a step needs the table of contacts: for its quantity, or because the run may stop with a
   !> frame of this step
   pure logical function needs_contacts(simulation, step)
      type(simulation_t), intent(in) :: simulation
      !> The step, not before the present one
      integer(lp), intent(in) :: step

      needs_contacts = is_check(simulation, step)
      if (needs_contacts) needs_contacts = step == simulation%stages%last .or. any(simulation%settings%stage( &
         simulation%stages%number)%until == [character(len=10) :: 'unbalanced', 'stress'])
   end function needs_contacts

   !> Measure the quantity of the present stage if this step is a check. Collective.
   subroutine measure_condition(simulation)
      !> The simulation at the end of a step; `stages` changes
      type(simulation_t), intent(inout) :: simulation
      type(sample_area_t) :: area
      real(wp) :: value, moved(2)

      if (.not. is_check(simulation, simulation%step)) return
      associate (stage => simulation%settings%stage(simulation%stages%number))
         select case (stage%until)
         case ('kinetic')
            call kinetic_energy(simulation%bodies, simulation%comm, value)
         case ('unbalanced')
            call unbalanced_force(simulation%forces%gravity, simulation%contacts, simulation%comm, &
                                  simulation%bodies, simulation%loop%force_sums, value)
         case ('count')
            call count_grains(simulation%bodies, simulation%comm, stage%low, stage%high, value)
         case ('stress')
            call measure_stress(simulation, stage%component, value)
         case ('departed')
            value = departures(simulation, stage%sink)
         case ('solid_fraction')
            area = sample_area_t(stage%low, stage%high, stage%high - stage%low)
            if (.not. all(stage%low < stage%high)) call find_area(simulation, area)
            call solid_fraction(simulation%bodies, simulation%comm, area, value)
         case default
            associate (reference => simulation%stages%reference)
               moved = wall_vector(simulation) - reference
               value = hypotenuse(moved(1), moved(2))/max(hypotenuse(reference(1), reference(2)), tiny(1.0_wp))
            end associate
         end select
      end associate
      simulation%stages%value = value
   end subroutine measure_condition

   !> Number of bodies that have left since the start of the run, the same on all ranks
   pure real(wp) function departures(simulation, name)
      type(simulation_t), intent(in) :: simulation
      !> Name of a sink; empty: all of them
      character(len=*), intent(in) :: name
      integer :: k

      departures = 0.0_wp
      do k = 1, size(simulation%sources_and_sinks%sinks)
         associate (sink => simulation%sources_and_sinks%sinks(k))
            if (name == '' .or. name == sink%settings%name) departures = departures + real(sink%departed, wp)
         end associate
      end do
   end function departures

   !> Measure the magnitude of a component of the mean stress of the sample. Collective.
   subroutine measure_stress(simulation, component, value)
      type(simulation_t), intent(inout) :: simulation
      !> 'pressure', 'xx', 'xy', 'yx' or 'yy'
      character(len=*), intent(in) :: component
      !> The magnitude [N/m2]
      real(wp), intent(out) :: value
      type(sample_area_t) :: area
      real(wp) :: tensor(2, 2)

      call find_area(simulation, area)
      call stress(simulation%bodies, simulation%contacts, simulation%comm, area, tensor)
      if (component == 'pressure') then
         value = abs(0.5_wp*(tensor(1, 1) + tensor(2, 2)))
      else
         value = abs(tensor(scan('xy', component(1:1)), scan('xy', component(2:2))))
      end if
   end subroutine measure_stress

   !> Decide after a check whether the next step is the last of the stage.
   subroutine decide_end(simulation)
      !> The simulation at the end of a step, measured; `stages` and `n_steps` change
      type(simulation_t), intent(inout) :: simulation

      if (.not. is_check(simulation, simulation%step)) return
      associate (stages => simulation%stages, step => simulation%step)
         associate (stage => simulation%settings%stage(stages%number))
            if (.not. holds(stage, stages%value)) then
               stages%held_since = -1_lp
               return
            end if
            if (stages%held_since < 0_lp) stages%held_since = step
            ! Rounding does not make the time of a whole number of steps too short.
            if (real(step - stages%held_since, wp)*simulation%dt < stage%hold*(1.0_wp - 1.0e-6_wp)) return
            stages%is_decided = .true.
            stages%last = min(stages%last, step + 1_lp)
         end associate
      end associate
      call find_last_steps(simulation)
   end subroutine decide_end

   !> Whether a value fulfils the condition of a stage
   pure logical function holds(stage, value)
      type(stage_settings_t), intent(in) :: stage
      real(wp), intent(in) :: value

      holds = value < stage%below
      if (stage%above > 0.0_wp) holds = value > stage%above
   end function holds

   !> Begin the next stage if this step is the last of the present one. Collective; all ranks get the same error.
   subroutine pass_end(simulation, begins, error)
      !> The simulation at the end of a step
      type(simulation_t), intent(inout) :: simulation
      !> Whether a stage begins
      logical, intent(out) :: begins
      !> Allocated if the condition has not ended the stage in time, and the run must stop
      type(error_t), allocatable, intent(inout) :: error

      begins = .false.
      if (is_at_limit(simulation)) then
         associate (stage => simulation%settings%stage(simulation%stages%number))
            call raise(error, run_error, place_of(simulation%settings, 'stage.'//stage%name, 'longest')// &
                       ': stage '//stage%name//' has lasted '//to_text(stage%longest)//' s, but '// &
                       condition_text(simulation)//'. Increase longest and add --continue --changed, change the '// &
                       'limit, or set at_limit = ''next''')
         end associate
         return
      end if
      associate (stages => simulation%stages)
         begins = stages%number > 0 .and. stages%number < size(simulation%settings%stage) &
                  .and. simulation%step == stages%last
      end associate
      if (.not. begins) return
      call begin_stage(simulation)
      call check_reference(simulation, error)
   end subroutine pass_end

   !> Whether a condition has ended a stage as soon as it could: it held from the start
   pure logical function ended_at_once(simulation, number, steps)
      type(simulation_t), intent(in) :: simulation
      !> Number of the stage
      integer(ip), intent(in) :: number
      !> Number of its steps
      integer(lp), intent(in) :: steps

      associate (stage => simulation%settings%stage(number))
         ended_at_once = stage%until /= 'duration' .and. &
                         real(steps - 1_lp, wp) <= real(stage%check, wp) + anint(stage%hold/simulation%dt) + 1.0_wp
      end associate
   end function ended_at_once

   !> Whether the present stage has lasted as long as it may, and the run must stop
   pure logical function is_at_limit(simulation)
      type(simulation_t), intent(in) :: simulation

      is_at_limit = .false.
      associate (stages => simulation%stages)
         if (stages%number == 0) return
         associate (stage => simulation%settings%stage(stages%number))
            is_at_limit = simulation%step == stages%last .and. stage%until /= 'duration' .and. &
                          .not. stages%is_decided .and. stage%at_limit == 'stop'
         end associate
      end associate
   end function is_at_limit

   !> The quantity of the present stage and its limit, such as 'unbalanced is 0.02, not below 0.001'; empty if a time
   !> ends the stage
   pure function condition_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text

      text = ''
      associate (stages => simulation%stages)
         if (stages%number == 0) return
         associate (stage => simulation%settings%stage(stages%number))
            if (stage%until == 'duration') return
            text = trim(stage%until)//' is '
            if (stages%value >= huge(1.0_wp)) then
               text = text//'not defined without contacts'
            else if (stages%value >= 0.0_wp) then
               text = text//to_text(stages%value, 4)
            else
               text = text//'not known yet'
            end if
            if (stages%value < 0.0_wp .or. .not. holds(stage, stages%value)) text = text//', not'
            if (stage%above > 0.0_wp) text = text//' above '//to_text(stage%above, 4)
            if (.not. stage%above > 0.0_wp) text = text//' below '//to_text(stage%below, 4)
            if (stage%hold > 0.0_wp .and. stages%held_since >= 0_lp) text = text//' for '// &
               to_text(real(simulation%step - stages%held_since, wp)*simulation%dt, 3)//' of '// &
               to_text(stage%hold, 3)//' s'
         end associate
      end associate
   end function condition_text

end module polydem_end_condition
