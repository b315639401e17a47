!> Warnings at the end of a run: of what the input asked for and the run did not give.
module polydem_end_warnings
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
      if (allocated(simulation%walls%loads)) call warn_of_loads(simulation, log)
      if (.not. allocated(simulation%traffic)) return
      do k = 1, size(simulation%traffic%sources)
         call warn_of_source(simulation, simulation%traffic%sources(k), log)
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
            if (.not. load%yields(axis)) cycle
            borne = -load%damping*load%speed(axis)/cell%size(3 - axis)
            if (abs(borne) <= noticed*abs(load%stress(axis))) cycle
            call log%write_line('warning: the size of the cell along '//name(axis)//' changes at '// &
               to_text(load%speed(axis), 3)//' m/s at the end: its damping bears '//to_text(borne, 3)//' of '// &
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

   !> Warn of a source from which no body, or fewer than the rate asks for, have entered.
   subroutine warn_of_source(simulation, source, log)
      type(simulation_t), intent(in) :: simulation
      type(source_t), intent(in) :: source
      type(log_t), intent(inout) :: log
      character(len=:), allocatable :: text
      integer(lp) :: due, first

      associate (s => simulation, given => source%settings)
         if (source%stage > 0_ip .and. source%stage /= s%stages%number) return
         first = 0_lp
         if (source%stage > 0_ip) first = s%stages%first(source%stage)
         due = 1_lp
         if (given%count == 0) due = source%due(s%step, first, s%dt)
         if (real(due - source%entered, wp) <= noticed*real(due, wp)) return
         text = 'warning: '//to_text(source%entered)//' bodies have entered from &source '//given%name
         if (given%count == 0) text = text//', of '//to_text(due)//' that its rate asks for'
         if (source%blocked > 0_lp) then
            text = text//': they found no room '//to_text(source%blocked)//' times. Give it a larger or freer '// &
               'rectangle, a greater velocity, or a lower rate'
         else
            text = text//'. They enter every '//to_text(given%interval)//' steps: reduce interval'
         end if
         call log%write_line(text)
      end associate
   end subroutine warn_of_source

end module polydem_end_warnings
