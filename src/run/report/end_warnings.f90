!> Warnings at the end of a run: of what the input asked for and the run did not give.
module polydem_end_warnings
   use polydem_driven, only: along_angle
   use polydem_end_condition, only: ended_at_once
   use polydem_kinds, only: ip, lp, wp
   use polydem_log, only: log_t
   use polydem_simulation, only: simulation_t
   use polydem_source, only: source_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: write_end_warnings, warn_of_end

   !> Share of a load above which it is told that damping bears it, and share of the bodies that are due above which it
   !> is told that they found no room
   real(wp), parameter :: noticed = 0.1_wp

contains

   !> Write the warnings.
   subroutine write_end_warnings(simulation, log)
      !> The simulation after its last step
      type(simulation_t), intent(in) :: simulation
      type(log_t), intent(inout) :: log
      integer :: k

      associate (stages => simulation%stages)
         if (stages%number > 0_ip) call warn_of_end(simulation, stages%number, &
                                                    simulation%step - stages%first(stages%number), log)
      end associate
      if (allocated(simulation%bodies%cell%load)) call warn_of_cell(simulation, log)
      if (allocated(simulation%walls%loads)) then
         call warn_of_loads(simulation, log)
         call warn_of_passing_walls(simulation, log)
      end if
      if (.not. allocated(simulation%sources_and_sinks)) return
      do k = 1, size(simulation%sources_and_sinks%sources)
         call warn_of_source(simulation, simulation%sources_and_sinks%sources(k), log)
      end do
   end subroutine write_end_warnings

   !> Warn of a stage whose condition held from the start.
   subroutine warn_of_end(simulation, number, steps, log)
      !> The simulation at the end of the stage, or later
      type(simulation_t), intent(in) :: simulation
      !> Number of the stage
      integer(ip), intent(in) :: number
      !> Number of its steps
      integer(lp), intent(in) :: steps
      type(log_t), intent(inout) :: log

      if (.not. ended_at_once(simulation, number, steps)) return
      call log%write_line('warning: stage '//simulation%settings%stage(number)%name//' ended at its first check, '// &
         'after '//to_text(real(steps, wp)*simulation%dt, 3)//' s: its condition held from the start. Grains at '// &
         'rest before they fall have no energy, for example: give hold, the time for which it must hold, or '// &
         'another limit')
   end subroutine warn_of_end

   !> Warn of a cell whose damping bears much of the stress.
   subroutine warn_of_cell(simulation, log)
      type(simulation_t), intent(in) :: simulation
      type(log_t), intent(inout) :: log
      character(len=1), parameter :: name(2) = ['x', 'y']
      real(wp) :: borne
      integer :: axis

      associate (cell => simulation%bodies%cell, load => simulation%bodies%cell%load)
         do axis = 1, 2
            if (.not. load%is_controlled(axis)) cycle
            borne = -load%axis(axis)%damping*load%axis(axis)%speed/cell%size(3 - axis)
            if (abs(borne) <= noticed*abs(load%stress(axis))) cycle
            call log%write_line('warning: the size of the cell along '//name(axis)//' changes at '// &
               to_text(load%axis(axis)%speed, 3)//' m/s at the end: its damping bears '//to_text(borne, 3)//' of '// &
               to_text(load%stress(axis), 3)//' N/m2, the contacts only the rest. Let it run longer, or reduce '// &
               'damping_ratio and mass in &cell')
         end do
      end associate
   end subroutine warn_of_cell

   !> Warn of walls whose damping bears much of their load.
   subroutine warn_of_loads(simulation, log)
      type(simulation_t), intent(in) :: simulation
      type(log_t), intent(inout) :: log
      real(wp) :: borne
      integer :: k

      do k = 1, size(simulation%walls%loads)
         associate (load => simulation%walls%loads(k))
            borne = load%damping*load%speed
            if (abs(borne) <= noticed*abs(load%applied)) cycle
            call log%write_line('warning: the wall of &load '//load%name//' moves at '//to_text(load%speed, 3)// &
               ' at the end (SI units): its damping bears '//to_text(borne, 3)//' of the load '// &
               to_text(load%applied, 3)//', the contacts only the rest. Let it run longer, or reduce damping_ratio '// &
               'and mass in &load')
         end associate
      end do
   end subroutine warn_of_loads

   !> Warn of two walls with loads along one axis that were apart at the start and overlap now, or have changed places:
   !> fixed bodies do not push each other.
   subroutine warn_of_passing_walls(simulation, log)
      type(simulation_t), intent(in) :: simulation
      type(log_t), intent(inout) :: log
      !> Least and greatest coordinates, (bound, wall, axis), and those along the axis of the loads at the start [m]
      real(wp) :: extents(2, 2, 2), start(2, 2)
      integer :: axis, i, j, k, lower, upper

      associate (loads => simulation%walls%loads, walls => simulation%walls%wall, bodies => simulation%bodies)
         do k = 2, size(loads)
            do j = 1, k - 1
               axis = loads(j)%direction
               if (axis == along_angle .or. loads(k)%direction /= axis .or. loads(j)%wall == loads(k)%wall) cycle
               if (bodies%cell%size(axis) > 0.0_wp) cycle
               do i = 1, 2
                  extents(:, 1, i) = walls(loads(j)%wall)%extent(i, bodies)
                  extents(:, 2, i) = walls(loads(k)%wall)%extent(i, bodies)
               end do
               associate (across => extents(:, :, 3 - axis), along => extents(:, :, axis))
                  if (maxval(across(1, :)) >= minval(across(2, :))) cycle
                  start = along - spread([loads(j)%place, loads(k)%place], 1, 2)
                  lower = minloc(start(1, :), 1)
                  upper = 3 - lower
                  if (start(2, lower) > start(1, upper) .or. along(2, lower) <= along(1, upper)) cycle
               end associate
               call log%write_line('warning: the walls of &load '//loads(j)%name//' and &load '//loads(k)%name// &
                  ' have passed into or through each other: fixed bodies do not push each other. Loads need bodies '// &
                  'between their walls that bear them, or an ''end''')
            end do
         end do
      end associate
   end subroutine warn_of_passing_walls

   !> Warn of a source from which no body, or fewer than the rate asks for, have entered, and of one that does not fill
   !> the run up to its count.
   subroutine warn_of_source(simulation, source, log)
      type(simulation_t), intent(in) :: simulation
      type(source_t), intent(in) :: source
      type(log_t), intent(inout) :: log
      character(len=:), allocatable :: text
      integer(lp) :: due, first, there

      associate (s => simulation, given => source%settings)
         if (source%stage > 0_ip .and. source%stage /= s%stages%number) return
         first = 0_lp
         if (source%stage > 0_ip) first = s%stages%first(source%stage)
         if (given%count == 0_ip) then
            due = source%due(s%step, first, s%dt)
            there = source%entered
            text = to_text(there)//' bodies have entered from &source '//given%name//', of '//to_text(due)// &
               ' that its rate asks for'
         else
            due = int(given%count, lp)
            there = int(s%bodies%n_all - count(s%bodies%fixed, kind=ip), lp)
            text = to_text(there)//' free bodies are there at the end, of '//to_text(due)//' up to which &source '// &
               given%name//' fills the run; '//to_text(source%entered)//' have entered'
         end if
         if (real(due - there, wp) <= noticed*real(due, wp)) return
         if (source%blocked > 0_lp) then
            text = text//': they found no room '//to_text(source%blocked)//' times. Give it a larger or freer '// &
               'rectangle, a greater velocity, or a lower '//trim(merge('count', 'rate ', given%count > 0_ip))
         else
            text = text//'. They enter every '//to_text(given%interval)//' steps: reduce interval'
         end if
         call log%write_line('warning: '//text)
      end associate
   end subroutine warn_of_source

end module polydem_end_warnings
