!> Description of a run: its scene, models and time step, for `check` and for the head of the log.
module polydem_description
   use polydem_body_sizes, only: thickness_of_bodies
   use polydem_contact_depth, only: count_deeper, deepest_contact, depth_text
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_log, only: log_t
   use polydem_overlap_table, only: write_overlap_table
   use polydem_result_files, only: overlaps_name
   use polydem_simulation, only: simulation_t
   use polydem_stable_step, only: contact_numbers, stable_step_of_contacts
   use polydem_strings, only: to_text
   use polydem_scene_measures, only: measure_scene, scene_measures_t
   implicit none
   private
   public :: describe, has_deep_contacts, list_overlaps

contains

   !> Write the models that the scene uses, its counts and measures, and the time step relative to its stable value.
   subroutine describe(simulation, log)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      !> Log
      type(log_t), intent(inout) :: log
      type(scene_measures_t) :: measures

      call measure_scene(simulation, measures)
      associate (s => simulation)
         call log%write_line('bodies     '//to_text(size(s%bodies%free, kind=ip))//' free, '// &
                             to_text(s%bodies%n - size(s%bodies%free, kind=ip))//' fixed, '// &
                             to_text(measures%corners)//' vertices')
         call write_measures(s, measures, log)
         call log%write_line('boxes      '//to_text(s%boxes%n)//', including '// &
                             to_text(count(s%boxes%fixed, kind=ip))//' of fixed bodies')
         call log%write_line('parts      '//s%settings%neighbours%finder//', '//s%law%description//gravity_text(s)// &
                             ', '//s%settings%integrate%scheme//motion_text(s)//balance_text(s))
         call log%write_line('step       dt = '//to_text(s%dt)//' s, '// &
                             to_text(s%dt/s%expected_stable_step, 3)//' of the stable time step '// &
                             to_text(s%expected_stable_step)//' s estimated from the shapes')
         if (s%contacts%n > 0_ip) call log%write_line('           '//contacts_step_text(s))
         call log%write_line('duration   '//to_text(real(s%n_steps, wp)*s%dt)//' s, '//to_text(s%n_steps)// &
                             ' steps'//rounding_text(real(s%n_steps, wp)*s%dt, s%settings%integrate%duration))
         if (s%contacts%n > 0_ip) then
            call log%write_line('at start   '//to_text(s%contacts%n)//' contacts, the deepest '//deepest_text(s))
            call log%write_line('           elastic energy '//to_text(measures%stored, 3)//' J/m, kinetic energy '// &
                                to_text(measures%kinetic, 3)//' J/m, weight times extent '// &
                                to_text(measures%potential, 3)//' J/m')
         end if
         if (s%relaxation%sweeps > 0_ip) then
            call log%write_line('relaxed    '//to_text(s%relaxation%sweeps)//' sweeps reduced the deepest contact '// &
                                'from '//to_text(s%relaxation%before, 3)//' to '//to_text(s%relaxation%after, 3)// &
                                ' of the thinner body; no centre moved more than '//to_text(s%relaxation%move, 3)//' m')
         end if
      end associate
   end subroutine describe

   !> Whether `list_overlaps` has contacts to list: contacts deeper than `listed_depth` in &guards
   logical function has_deep_contacts(simulation)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation

      has_deep_contacts = count_deeper(simulation%contacts, thickness_of_bodies(simulation%bodies), &
                                       simulation%settings%guards%listed_depth) > 0_ip
   end function has_deep_contacts

   !> Write sizes, masses, densities and speeds of the bodies.
   subroutine write_measures(simulation, measures, log)
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(log_t), intent(inout) :: log
      logical :: any_free

      any_free = size(simulation%bodies%free) > 0
      call log%write_line('extent     '//extent_text(measures%extent))
      if (any_free) then
         call log%write_line('           free bodies '//extent_text(measures%free_extent))
         call log%write_line('sizes      diameters of free bodies '//range_text(measures%diameter([1, 3]))// &
                             ' m, median '//to_text(measures%diameter(2), 3)//' m')
      end if
      call log%write_line('thinnest   body '//to_text(simulation%bodies%id(measures%thinnest))//', '// &
                          to_text(measures%thickness, 3)//' m')
      if (any_free) then
         call log%write_line('masses     of free bodies '//range_text(measures%mass(1:2))//' kg/m, '// &
                             to_text(measures%mass(3), 3)//' kg/m in total, densities '// &
                             range_text(measures%density)//' kg/m3')
      end if
      call log%write_line('speeds     of free bodies up to '//to_text(measures%speed, 3)// &
                          ' m/s at the start, of walls up to '//to_text(measures%wall_speed, 3)// &
                          ' m/s, after a fall through the extent '//to_text(measures%fall_speed, 3)//' m/s')
   end subroutine write_measures

   !> An extent as text: least and greatest x and y
   function extent_text(extent) result(text)
      real(wp), intent(in) :: extent(2, 2)
      character(len=:), allocatable :: text

      text = 'x '//range_text(extent(1, :))//' m, y '//range_text(extent(2, :))//' m'
   end function extent_text

   !> A range as text: least and greatest value
   function range_text(range) result(text)
      real(wp), intent(in) :: range(2)
      character(len=:), allocatable :: text

      text = to_text(range(1), 3)//' to '//to_text(range(2), 3)
   end function range_text

   !> Ratio of the time step to the stable time step of the initial contacts, as text
   function contacts_step_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text
      real(wp) :: stable
      integer(ip) :: critical

      associate (s => simulation)
         call stable_step_of_contacts(s%law, s%integrator%stability(), s%bodies, &
                                      contact_numbers(s%bodies%n, s%incidence), s%contacts, stable, critical)
         text = to_text(s%dt/stable, 3)//' of the stable time step '//to_text(stable)//' s of the initial contacts'
      end associate
   end function contacts_step_text

   !> Write the number of deep initial contacts and the deepest one, and write a table of them to a file.
   subroutine list_overlaps(simulation, folder, log, error)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      !> Folder for the table of deep contacts; empty: no table
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
         call log%write_line('overlaps   '//to_text(n)//' initial contacts deeper than '//to_text(limit, 3)// &
                             ' of the thickness of the thinner body; the deepest:')
         call log%write_line('           '//depth_text(s%bodies, s%contacts, thickness, &
                                                       deepest_contact(s%contacts, thickness)))
         if (folder == '') then
            call log%write_line('           (a run lists them in overlaps.csv)')
         else
            call write_overlap_table(folder//'/'//overlaps_name, s%bodies, s%contacts, thickness, limit, error)
            call log%write_line('           full list: '//folder//'/'//overlaps_name)
         end if
      end associate
   end subroutine list_overlaps

   !> Remark if the requested duration is not an integer of steps; else empty
   function rounding_text(duration, wanted) result(text)
      real(wp), intent(in) :: duration, wanted
      character(len=:), allocatable :: text

      text = ''
      if (abs(duration - wanted) > 1.0e-6_wp*wanted) text = ' (requested: '//to_text(wanted)// &
                                                            ' s, not an integer of steps)'
   end function rounding_text

   !> ', gravity' if there is gravity; else empty
   function gravity_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text

      text = ''
      associate (gravity => simulation%settings%forces%gravity)
         if (abs(gravity(1)) + abs(gravity(2)) > 0.0_wp) text = ', gravity'
      end associate
   end function gravity_text

   !> Kind and number of bodies of each prescribed motion
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

   !> ', energy balance' if the run evaluates it; else empty
   function balance_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text

      text = ''
      if (simulation%settings%output%energy_balance) text = ', energy balance'
   end function balance_text

   !> Depth and bodies of the deepest contact, as text; the depth is overlap area over contact length [m]
   function deepest_text(simulation) result(text)
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
   end function deepest_text

end module polydem_description
