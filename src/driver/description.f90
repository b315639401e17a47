!> What a run consists of, in words: for `check` and for the head of the log.
module polydem_description
   use polydem_body_sizes, only: thickness_of_bodies
   use polydem_depths, only: count_deeper, deepest_contact, depth_text, write_depths
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_log, only: log_t
   use polydem_result_folder, only: overlaps_path
   use polydem_simulation, only: simulation_t
   use polydem_stable_step, only: contact_numbers, stable_step_of_contacts
   use polydem_strings, only: to_text
   use polydem_survey, only: survey_scene, survey_t
   implicit none
   private
   public :: describe, has_deep_contacts, list_overlaps

contains

   !> Write the parts that the scene uses, its counts and measures, and the step against its bounds.
   subroutine describe(simulation, log)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      !> Log
      type(log_t), intent(inout) :: log
      type(survey_t) :: survey

      call survey_scene(simulation, survey)
      associate (s => simulation)
         call log%write_line('bodies     '//to_text(size(s%bodies%free, kind=ip))//' free, '// &
                             to_text(s%bodies%n - size(s%bodies%free, kind=ip))//' fixed, '// &
                             to_text(survey%corners)//' corners')
         call write_measures(s, survey, log)
         call log%write_line('boxes      '//to_text(s%boxes%n)//', of which '// &
                             to_text(count(s%boxes%fixed, kind=ip))//' of fixed bodies')
         call log%write_line('parts      '//s%settings%neighbours%finder//', '//s%law%description//gravity_text(s)// &
                             ', '//s%settings%integrate%scheme//motion_text(s)//ledger_text(s))
         call log%write_line('step       dt = '//to_text(s%dt)//' s, '// &
                             to_text(s%dt/s%expected_stable_step, 3)//' of the stable step '// &
                             to_text(s%expected_stable_step)//' s expected from the shapes')
         if (s%contacts%n > 0_ip) call log%write_line('           '//contacts_step_text(s))
         call log%write_line('duration   '//to_text(real(s%n_steps, wp)*s%dt)//' s, '//to_text(s%n_steps)// &
                             ' steps'//rounding_text(real(s%n_steps, wp)*s%dt, s%settings%integrate%duration))
         if (s%contacts%n > 0_ip) then
            call log%write_line('at start   '//to_text(s%contacts%n)//' contacts, the deepest '//deepest(s))
            call log%write_line('           they hold '//to_text(survey%stored, 3)//' J/m; bodies have '// &
                                to_text(survey%kinetic, 3)//' J/m of motion, their weight times the extent is '// &
                                to_text(survey%potential, 3)//' J/m')
         end if
         if (s%relaxation%sweeps > 0_ip) then
            call log%write_line('relaxed    in '//to_text(s%relaxation%sweeps)//' sweeps: the deepest contact from '// &
                                to_text(s%relaxation%before, 3)//' to '//to_text(s%relaxation%after, 3)// &
                                ' of the thinner body; no centre moved more than '//to_text(s%relaxation%move, 3)//' m')
         end if
      end associate
   end subroutine describe

   !> Whether there are contacts that `list_overlaps` lists
   logical function has_deep_contacts(simulation)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation

      has_deep_contacts = count_deeper(simulation%contacts, thickness_of_bodies(simulation%bodies), &
                                       simulation%settings%guards%listed_depth) > 0_ip
   end function has_deep_contacts

   !> Write how large, heavy and fast the bodies are.
   subroutine write_measures(simulation, survey, log)
      type(simulation_t), intent(in) :: simulation
      type(survey_t), intent(in) :: survey
      type(log_t), intent(inout) :: log
      logical :: any_free

      any_free = size(simulation%bodies%free) > 0
      call log%write_line('extent     '//extent_text(survey%extent))
      if (any_free) then
         call log%write_line('           free bodies '//extent_text(survey%free_extent))
         call log%write_line('sizes      diameters of free bodies '//range_text(survey%diameter([1, 3]))// &
                             ' m, median '//to_text(survey%diameter(2), 3)//' m')
      end if
      call log%write_line('thinnest   body '//to_text(simulation%bodies%id(survey%thinnest))//', '// &
                          to_text(survey%thickness, 3)//' m')
      if (any_free) then
         call log%write_line('masses     of free bodies '//range_text(survey%mass(1:2))//' kg/m, '// &
                             to_text(survey%mass(3), 3)//' kg/m in all, densities '// &
                             range_text(survey%density)//' kg/m3')
      end if
      call log%write_line('speeds     of free bodies up to '//to_text(survey%speed, 3)// &
                          ' m/s at the start, of walls up to '//to_text(survey%wall_speed, 3)// &
                          ' m/s, after a fall '//to_text(survey%fall_speed, 3)//' m/s')
   end subroutine write_measures

   function extent_text(extent) result(text)
      real(wp), intent(in) :: extent(2, 2)
      character(len=:), allocatable :: text

      text = 'x '//range_text(extent(1, :))//' m, y '//range_text(extent(2, :))//' m'
   end function extent_text

   function range_text(range) result(text)
      real(wp), intent(in) :: range(2)
      character(len=:), allocatable :: text

      text = to_text(range(1), 3)//' to '//to_text(range(2), 3)
   end function range_text

   !> The step against the stable one of the contacts that there are
   function contacts_step_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text
      real(wp) :: stable
      integer(ip) :: critical

      associate (s => simulation)
         call stable_step_of_contacts(s%settings%forces, s%integrator%stability(), s%bodies, &
                                      contact_numbers(s%bodies%n, s%incidence), s%contacts, stable, critical)
         text = to_text(s%dt/stable, 3)//' of the stable step '//to_text(stable)//' s of the contacts at the start'
      end associate
   end function contacts_step_text

   !> Write how deep contacts are at the start, and a table of the deep ones.
   subroutine list_overlaps(simulation, folder, log, error)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      !> Folder in which a table of the deep ones is made; empty: none is made
      character(len=*), intent(in) :: folder
      !> Log
      type(log_t), intent(inout) :: log
      !> Allocated if the table cannot be written
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: thickness(:)
      integer(ip) :: n

      associate (s => simulation, limit => simulation%settings%guards%listed_depth)
         thickness = thickness_of_bodies(s%bodies)
         n = count_deeper(s%contacts, thickness, limit)
         if (n == 0_ip) return
         call log%write_line('deep       '//to_text(n)//' contacts by more than '//to_text(limit, 3)// &
                             ' of the thinner body, most of all')
         call log%write_line('           '//depth_text(s%bodies, s%contacts, thickness, &
                                                       deepest_contact(s%contacts, thickness)))
         if (folder == '') then
            call log%write_line('           (a run lists them in overlaps.csv)')
         else
            call write_depths(overlaps_path(folder), s%bodies, s%contacts, thickness, limit, error)
            call log%write_line('           all of them: '//overlaps_path(folder))
         end if
      end associate
   end subroutine list_overlaps

   !> A remark if a whole number of steps does not make the duration that was asked for
   function rounding_text(duration, wanted) result(text)
      real(wp), intent(in) :: duration, wanted
      character(len=:), allocatable :: text

      text = ''
      if (abs(duration - wanted) > 1.0e-6_wp*wanted) text = ' (not the '//to_text(wanted)// &
                                                            ' s asked for: no whole number of steps)'
   end function rounding_text

   function gravity_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text

      text = ''
      associate (gravity => simulation%settings%forces%gravity)
         if (abs(gravity(1)) + abs(gravity(2)) > 0.0_wp) text = ', gravity'
      end associate
   end function gravity_text

   function motion_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      do k = 1, size(simulation%motions)
         text = text//', '//trim(simulation%motions(k)%kind)//' of '// &
            to_text(size(simulation%motions(k)%slots, kind=ip))//' walls'
      end do
   end function motion_text

   function ledger_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text

      text = ''
      if (simulation%settings%output%ledger) text = ', ledger'
   end function ledger_text

   !> The contact with the greatest area over length
   function deepest(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text
      real(wp) :: depth, greatest
      integer(ip) :: c, worst

      worst = 1_ip
      greatest = -1.0_wp
      associate (contacts => simulation%contacts)
         do c = 1_ip, contacts%n
            depth = contacts%area(c)/contacts%length(c)
            if (depth > greatest) then
               greatest = depth
               worst = c
            end if
         end do
         text = to_text(greatest, 3)//' m between the bodies '//to_text(simulation%bodies%id(contacts%first(worst)))// &
            ' and '//to_text(simulation%bodies%id(contacts%second(worst)))
      end associate
   end function deepest

end module polydem_description
