!> Description of a run: its scene, models and time step, for `check` and for the head of the log.
module polydem_description
   use polydem_contact_depth, only: thinner_pieces
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_log, only: log_t
   use polydem_namelist_entries, only: entries, first_row
   use polydem_overlap_table, only: write_overlap_table
   use polydem_pair_entries, only: n_pair_entries, pair_entries
   use polydem_pair_value, only: pair_value_t
   use polydem_pair_values, only: parameter_at
   use polydem_result_files, only: overlaps_name
   use polydem_run_duration, only: longest_run
   use polydem_rigidity, only: describe_rigidity
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text, counted
   use polydem_scene_measures, only: scene_measures_t
   use polydem_wall, only: have_same_drivers
   implicit none
   private
   public :: describe, list_overlaps

   !> Share of the undamped stable step below which the log gives damping as the reason for a short step
   real(wp), parameter :: strongly_damped = 0.3_wp
   !> Greatest number of pairs of materials in the log
   integer(ip), parameter :: most_pairs = 15_ip

contains

   !> Write the models that the scene uses, its counts and measures, and the time step relative to its stable value.
   subroutine describe(simulation, measures, log)
      !> A simulation at time 0
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      type(log_t), intent(inout) :: log

      associate (s => simulation)
         call log%write_line('bodies     '//to_text(measures%free)//' free, '//to_text(measures%fixed)//' fixed, '// &
                             to_text(measures%corners)//' vertices')
         if (s%bodies%cell%is_periodic) call log%write_line('cell       '//cell_text(s))
         if (allocated(s%sources_and_sinks)) call write_sources(s, log)
         call write_measures(measures, log)
         call log%write_line('boxes      '//to_text(measures%boxes)//', including '//to_text(measures%fixed_boxes)// &
                             ' of fixed bodies')
         call log%write_line('parts      '//s%settings%neighbours%finder//', '//s%law%description// &
                             s%body_forces%description()//gravity_text(s)//', '// &
                             s%settings%integrate%scheme//motion_text(s)//balance_text(s))
         if (allocated(measures%of_material)) call write_materials(simulation, measures%of_material, log)
         if (gravity_text(s) /= '' .and. s%law%rest_note() /= '') &
            call log%write_line('           note: '//s%law%rest_note())
         call describe_rigidity(s, measures, log)
         call log%write_line('step       dt = '//to_text(s%dt)//' s, '// &
                             to_text(s%dt/s%expected_stable_step, 3)//' of the stable time step '// &
                             to_text(s%expected_stable_step)//' s estimated from the shapes')
         if (s%expected%body > 0_lp) call log%write_line('           for impacts at '// &
            to_text(s%expected%speed, 3)//' m/s ('//s%expected%origin//'), which make contacts of body '// &
            to_text(s%expected%body)//' '//to_text(s%expected%depth, 3)//' m deep and '// &
            to_text(s%expected%length, 3)//' m long')
         if (s%expected%damped < strongly_damped) call log%write_line('           (strong damping of such contacts '// &
            'reduces it to '//to_text(s%expected%damped, 3)// &
            ' of the step without damping; shorter contacts allow more)')
         if (measures%contacts > 0_lp) call log%write_line('           '//to_text(s%dt/measures%stable_step, 3)// &
            ' of the stable time step '//to_text(measures%stable_step)//' s of the initial contacts')
         call log%write_line('duration   '//duration_text(s))
         if (measures%contacts > 0_lp) then
            call log%write_line('at start   '//counted(measures%contacts, 'contact')//', the deepest '// &
                                measures%longest_depth)
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

   !> Periodic axes and sides of the cell, and the number of bodies that were outside
   function cell_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text
      character(len=1), parameter :: name(2) = ['x', 'y']
      integer :: axis

      text = 'periodic'
      associate (cell => simulation%bodies%cell)
         do axis = 1, 2
            if (.not. cell%size(axis) > 0.0_wp) cycle
            text = text//', '//name(axis)//' '//to_text(cell%low(axis))//' to '// &
               to_text(cell%low(axis) + cell%size(axis))//' m'
         end do
         if (allocated(cell%load)) then
            do axis = 1, 2
               if (.not. cell%load%is_controlled(axis)) cycle
               text = text//'; stress-controlled at '//to_text(cell%load%stress(axis), 3)//' N/m2 along '//name(axis)
               if (cell%load%axis(axis)%damping > 0.0_wp) text = text//', closes at '// &
                  to_text(cell%load%stress(axis)*cell%size(3 - axis)/cell%load%axis(axis)%damping, 3)//' m/s'
            end do
            text = text//'; mass '//to_text(cell%load%axis(1)%mass, 3)//' kg/m'
         end if
      end associate
      if (simulation%n_outside == 1_lp) text = text//'; 1 body outside was moved into it'
      if (simulation%n_outside > 1_lp) text = text//'; '//to_text(simulation%n_outside)// &
         ' bodies outside were moved into it'
   end function cell_text

   !> Write what the sources give: the mean mass of the first bodies, and rate or number.
   subroutine write_sources(simulation, log)
      type(simulation_t), intent(in) :: simulation
      type(log_t), intent(inout) :: log
      character(len=:), allocatable :: text
      real(wp) :: mass
      integer :: k

      do k = 1, size(simulation%sources_and_sinks%sources)
         associate (source => simulation%sources_and_sinks%sources(k), &
                    given => simulation%sources_and_sinks%sources(k)%settings)
            mass = source%mean_mass()
            text = 'source     '//given%name//': bodies of '//to_text(mass, 3)//' kg/m on average'
            if (given%count > 0) text = text//', up to '//to_text(given%count)//' free bodies in the run'
            if (given%count == 0) text = text//', '//to_text(given%rate, 3)//' per second, '// &
               to_text(given%rate*mass, 3)//' kg/(m s)'
            call log%write_line(text)
         end associate
      end do
   end subroutine write_sources

   !> Write sizes, masses, densities and speeds of the bodies.
   subroutine write_measures(measures, log)
      type(scene_measures_t), intent(in) :: measures
      type(log_t), intent(inout) :: log
      logical :: any_free

      any_free = measures%free > 0_lp
      if (measures%free + measures%fixed == 0_lp) return
      call log%write_line('extent     '//extent_text(measures%extent))
      if (any_free) then
         call log%write_line('           free bodies '//extent_text(measures%free_extent))
         call log%write_line('sizes      diameters of free bodies '//range_text(measures%diameter([1, 3]))// &
                             ' m, median '//to_text(measures%diameter(2), 3)//' m')
      end if
      call log%write_line('thinnest   body '//to_text(measures%thinnest)//', '// &
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

   !> Write the number of deep initial contacts and the deepest one, and write a table of them to a file. Collective.
   subroutine list_overlaps(simulation, measures, folder, log, error)
      !> A simulation at time 0
      type(simulation_t), intent(inout) :: simulation
      type(scene_measures_t), intent(in) :: measures
      !> Folder for the table of deep contacts; empty: no table
      character(len=*), intent(in) :: folder
      type(log_t), intent(inout) :: log
      !> Allocated if the table cannot be written
      type(error_t), allocatable, intent(inout) :: error

      if (measures%deep == 0_lp) return
      associate (s => simulation, limit => simulation%settings%guards%listed_depth)
         call log%write_line('overlaps   '//counted(measures%deep, 'initial contact')//' deeper than '// &
                             to_text(limit, 3)//' of the thickness of the thinner body; the deepest:')
         call log%write_line('           '//measures%deepest)
         if (folder == '') then
            call log%write_line('           (a run lists them in overlaps.csv)')
         else
            associate (pairs => s%search%neighbours%pairs)
               call write_overlap_table(folder//'/'//overlaps_name, s%bodies, s%contacts, &
                                        thinner_pieces(s%bodies, s%contacts, pairs%first, pairs%second), limit, &
                                        error, s%comm)
            end associate
            call log%write_line('           full list: '//folder//'/'//overlaps_name)
         end if
      end associate
   end subroutine list_overlaps

   !> Write the number of bodies of each material, and the parameters of the contacts of each pair.
   subroutine write_materials(simulation, of_material, log)
      type(simulation_t), intent(in) :: simulation
      !> Number of bodies of each material
      integer(lp), intent(in) :: of_material(0:)
      type(log_t), intent(inout) :: log
      character(len=:), allocatable :: text
      integer(ip) :: i, j, n

      n = 0_ip
      text = 'materials '
      do i = 0_ip, ubound(of_material, 1, kind=ip)
         if (of_material(i) > 0_lp) text = text//' '//material_name(simulation, i)//' ('// &
            to_text(of_material(i))//trim(merge(' body  ', ' bodies', of_material(i) == 1_lp))//'),'
      end do
      call log%write_line(text(:len(text) - 1))
      do i = 0_ip, ubound(of_material, 1, kind=ip)
         do j = i, ubound(of_material, 1, kind=ip)
            if (of_material(i) == 0_lp .or. of_material(j) == 0_lp) cycle
            n = n + 1_ip
            if (n <= most_pairs) call log%write_line('           '//material_name(simulation, i)//' on '// &
               material_name(simulation, j)//': '//pair_text(simulation, [i, j]))
         end do
      end do
      if (n > most_pairs) call log%write_line('           and '//to_text(n - most_pairs)//' more pairs')
   end subroutine write_materials

   !> Name of a material in the log
   function material_name(simulation, number) result(name)
      type(simulation_t), intent(in) :: simulation
      integer(ip), intent(in) :: number
      character(len=:), allocatable :: name

      name = '(none)'
      if (number > 0_ip) name = simulation%settings%material(number)%name
   end function material_name

   !> Parameters of the contacts of two materials that the force law uses
   function pair_text(simulation, materials) result(text)
      type(simulation_t), intent(in) :: simulation
      integer(ip), intent(in) :: materials(2)
      character(len=:), allocatable :: text

      type(pair_value_t) :: value
      integer :: k

      text = ''
      do k = 1, n_pair_entries
         if (.not. simulation%law%logged(k)) cycle
         value = parameter_at(simulation%law%pairs, k)
         if (text /= '') text = text//', '
         text = text//trim(pair_entries(k))//' '//to_text(value%of(materials), 3)// &
            trim(' '//entries(first_row('forces', trim(pair_entries(k))))%unit)
      end do
   end function pair_text

   !> Duration and number of steps, and the requested duration if it is another one
   function duration_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text
      real(wp) :: duration

      duration = real(simulation%n_steps, wp)*simulation%dt
      text = to_text(duration)//' s, '//to_text(simulation%n_steps)//' steps'
      associate (n => size(simulation%settings%stage, kind=lp), wanted => longest_run(simulation%settings))
         if (n > 0_lp) then
            text = 'at most '//text//' in '//counted(n, 'stage')
         else if (abs(duration - wanted) > 1.0e-6_wp*wanted) then
            text = text//' (requested: '//to_text(wanted)//' s, not a whole number of steps)'
         end if
      end associate
   end function duration_text

   !> ', gravity' if there is gravity; else empty
   function gravity_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text

      text = ''
      associate (gravity => simulation%forces%gravity)
         if (abs(gravity(1)) + abs(gravity(2)) > 0.0_wp) text = ', gravity'
      end associate
   end function gravity_text

   !> Kinds of the motions and number of bodies of each wall that moves or is load-controlled
   function motion_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text, kinds
      ! First slot of each wall that is not told yet
      integer(ip) :: first(size(simulation%walls%wall))
      integer(lp) :: n
      integer :: j, k

      text = ''
      associate (walls => simulation%walls)
         do k = 1, size(first)
            first(k) = huge(1_ip)
            if (walls%wall(k)%is_driven()) first(k) = minval(walls%wall(k)%slots)
         end do
         do while (any(first < huge(1_ip)))
            k = minloc(first, 1)
            kinds = ''
            do j = 1, size(walls%wall(k)%motions)
               kinds = kinds//' and '//walls%motions(walls%wall(k)%motions(j))%motion%kind
            end do
            if (size(walls%wall(k)%loads) > 0) kinds = kinds//' and load-controlled'
            n = 0_lp
            do j = 1, size(first)
               if (.not. have_same_drivers(walls%wall(j), walls%wall(k))) cycle
               n = n + size(walls%wall(j)%slots, kind=lp)
               first(j) = huge(1_ip)
            end do
            text = text//', '//kinds(len(' and ') + 1:)//' of '//counted(n, 'wall')
         end do
      end associate
   end function motion_text

   !> ', energy balance' if the run evaluates it; else empty
   function balance_text(simulation) result(text)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: text

      text = ''
      if (simulation%settings%output%energy_balance) text = ', energy balance'
   end function balance_text

end module polydem_description
