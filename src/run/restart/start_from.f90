!> Start from a result: from its last checkpoint, or from one of its frames.
!>
!> A checkpoint has the whole state. The run goes on from it as the run of the result would, at time 0: contact history,
!> accelerations and state of the integrator are those of the checkpoint. The forces at time 0 follow from a copy of the
!> history, since evaluating them changes it. A frame has poses and velocities only. Bodies of walls that were removed
!> are left out.
module polydem_start_from
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_bodies_in_cell, only: set_cell
   use polydem_body_fields, only: serialize_bodies
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_changed_bodies, only: change_accelerations
   use polydem_checkpoint_bodies, only: read_bodies
   use polydem_checkpoint_fields, only: attempts_t, read_pairs, serialize_progress
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_communicator, only: communicator_t
   use polydem_enter_cell, only: join_copies
   use polydem_errors, only: error_t, input_error, raise
   use polydem_exchange_bodies, only: find_leaving
   use polydem_file_system, only: exists, is_folder
   use polydem_frame_reader, only: find_frame, list_frame, read_surroundings, surroundings_t
   use polydem_removed_bodies, only: find_removed_rows, rows_of
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_replace_bodies, only: rebuild_bodies
   use polydem_result_files, only: checkpoint_path, n_checkpoints, segment_path
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_source_locations, only: place_of
   use polydem_start_materials, only: translate_materials
   use polydem_strings, only: quoted, suggestion, to_text
   use polydem_wall_removal, only: find_release
   use polydem_wall, only: wall_t
   use polydem_wall_names, only: find_material_names, find_wall_names
   implicit none
   private
   public :: origin_t, find_origin, read_start, recall_history, return_to_state

   !> Where a run starts
   type :: origin_t
      !> Path of the checkpoint, or of the segment that has the frame
      character(len=:), allocatable :: path
      !> Whether it is a frame
      logical :: is_frame = .false.
      !> Number of frames before it in its segment
      integer(lp) :: row = 0_lp
      !> What the log says of it
      character(len=:), allocatable :: note
      !> What it says of its periodic cell and of pieces
      type(surroundings_t) :: around
      !> Rows of the bodies of a checkpoint that belong to walls that were removed, ascending
      integer(ip), allocatable :: removed(:)
   end type origin_t

contains

   !> Find the last checkpoint of the result from which a run starts, or its frame.
   subroutine find_origin(settings, origin, error)
      !> Settings with `start_from` in the group &scene
      type(settings_t), intent(in) :: settings
      type(origin_t), intent(out) :: origin
      !> Names the entry and what is wrong with the result
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: folder, frame, which
      real(dp) :: time
      integer(ip) :: number
      integer :: colon, status

      folder = settings%scene%start_from
      frame = ''
      colon = index(folder, ':', back=.true.)
      if (colon > 0) frame = folder(colon + 1:)
      if (is_number(frame)) then
         folder = folder(:colon - 1)
         origin%is_frame = .true.
      end if
      if (.not. is_folder(folder, error)) then
         call raise(error, input_error, quoted(folder)//' is no folder; give the folder of a result, such as '// &
                    'results/NAME, relative to the folder in which polydem is started')
      else if (origin%is_frame) then
         read (frame, *, iostat=status) number
         if (status /= 0) then
            call raise(error, input_error, folder//' has no frame '//frame//': the number is too large')
         else if (number < -1_ip) then
            call raise(error, input_error, 'there is no frame '//frame//'; frames count from 0, and -1 is the last one')
         else
            call find_frame(folder, number, origin%path, origin%row, time, error)
         end if
         which = 'frame '//frame
         if (frame == '-1') which = 'the last frame'
         if (.not. allocated(error)) origin%note = 'start      from '//which//' of '//folder//', at '// &
            to_text(real(time, wp))//' s; contact history and accelerations begin anew'
      else
         call find_checkpoint(folder, origin, error)
      end if
      if (.not. allocated(error)) call read_surroundings(origin%path, origin%row, origin%around, error)
      if (.not. (allocated(error) .or. origin%is_frame)) call find_removed_rows(origin%path, origin%removed, error)
      if (allocated(error)) call blame(settings, error)
   end subroutine find_origin

   !> Whether a text is a whole number, with or without a minus
   pure logical function is_number(text)
      character(len=*), intent(in) :: text
      integer :: first

      first = 1 + merge(1, 0, index(text, '-') == 1)
      is_number = len(text) >= first .and. verify(text(first:), '0123456789') == 0
   end function is_number

   !> Let a message name the entry.
   pure subroutine blame(settings, error)
      type(settings_t), intent(in) :: settings
      type(error_t), intent(inout) :: error

      error%message = place_of(settings, 'scene', 'start_from')//": 'start_from' in &scene: "//error%message
   end subroutine blame

   !> Find the newest checkpoint of a result. One that is damaged is an error, since the state would be an earlier one.
   subroutine find_checkpoint(folder, origin, error)
      character(len=*), intent(in) :: folder
      type(origin_t), intent(inout) :: origin
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(attempts_t) :: attempts
      integer(lp) :: step, newest
      integer(ip) :: k

      newest = -1_lp
      do k = 1_ip, n_checkpoints
         if (.not. exists(checkpoint_path(folder, k), error)) cycle
         call file%open(checkpoint_path(folder, k), error)
         if (allocated(error)) return
         call serialize_progress(file, step, attempts)
         call file%close(error)
         if (allocated(error)) return
         if (step <= newest) cycle
         newest = step
         origin%path = checkpoint_path(folder, k)
         origin%note = 'start      from '//origin%path//', step '//to_text(step)//', with contact history'
      end do
      if (newest >= 0_lp .or. allocated(error)) return
      if (.not. exists(segment_path(folder, 1_ip), error)) call raise(error, input_error, folder//' holds neither '// &
         'checkpoint nor frame: it is no result folder, or its run has just begun')
      call raise(error, input_error, folder//' holds no checkpoint. Let its run end with '// &
         'checkpoint.at_end = .true., or start from a frame, such as '//quoted(folder//':0'))
   end subroutine find_checkpoint

   !> Read the bodies from which a run starts: all fixed ones, at rest, and a share of the free ones; and find the walls
   !> that the namelist names. Collective; all ranks get the same error.
   subroutine read_start(settings, comm, bodies, named, error)
      type(settings_t), intent(in) :: settings
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(inout) :: bodies
      !> Walls of the groups &wall
      type(wall_t), allocatable, intent(out) :: named(:)
      !> Names the entry and what is wrong with the result
      type(error_t), allocatable, intent(inout) :: error
      type(origin_t) :: origin
      type(checkpoint_file_t) :: file
      type(body_list_t) :: list
      character(len=:), allocatable :: materials
      integer(ip) :: s

      allocate (named(0))
      call find_origin(settings, origin, error)
      if (.not. allocated(error)) call find_material_names(origin%path, materials, error)
      call comm%all_reduce_error(error)
      if (allocated(error)) return
      if (materials /= '') allocate (bodies%material(0))
      if (origin%is_frame) then
         list%rank = comm%rank
         list%n_ranks = comm%size
         list%has_materials = materials /= ''
         call list_frame(origin%path, origin%row, list, error)
         if (.not. allocated(error)) call new_bodies(list, bodies, error)
      else
         bodies%pieces%most = origin%around%most_pieces
         ! Paths through the copies of a cell go on.
         bodies%cell%is_periodic = origin%around%has_images .and. settings%cell%periodic /= 'none'
         bodies%cell%is_sheared = origin%around%has_slides .and. bodies%cell%is_periodic
         call file%open(origin%path, error, comm)
         if (allocated(error)) return
         call file%match('/run/precision', [int(storage_size(1.0_wp), lp)], 'bit', 'working precision')
         call read_bodies(file, comm, bodies, origin%removed)
         call file%close(error)
         if (.not. allocated(error)) call turn_bodies(bodies, [(s, s=1_ip, bodies%n)])
      end if
      if (.not. allocated(error)) then
         call translate_materials(settings, materials, bodies, error)
         if (allocated(error)) call blame(settings, error)
      end if
      if (.not. allocated(error)) call name_walls(settings, origin%path, named, error)
      if (.not. allocated(error)) call check_cell_size(settings, origin, error)
      call comm%all_reduce_error(error)
      if (allocated(error)) return
      bodies%cell%first_shift = origin%around%shift
      bodies%cell%jump = origin%around%jump
      do s = 1_ip, bodies%n
         if (bodies%fixed(s)) call rest(bodies, s)
      end do
   end subroutine read_start

   !> Check that the cell of the namelist is that of a result whose cell was stress-controlled.
   subroutine check_cell_size(settings, origin, error)
      type(settings_t), intent(in) :: settings
      type(origin_t), intent(in) :: origin
      type(error_t), allocatable, intent(inout) :: error

      associate (size => origin%around%size)
         if (.not. all(size > 0.0_wp)) return
         if (all(abs(settings%cell%size - size) <= 16.0_wp*epsilon(size)*size)) return
         call raise(error, input_error, place_of(settings, 'cell', 'size')//': ''size'' in &cell: the cell of '// &
                    origin%path//' has got another size there; write periodic = ''xy'' and size = '// &
                    to_text(size(1), 17)//', '//to_text(size(2), 17))
      end associate
   end subroutine check_cell_size

   !> Let a body rest.
   pure subroutine rest(bodies, s)
      type(bodies_t), intent(inout) :: bodies
      integer(ip), intent(in) :: s

      bodies%velocity(:, s) = 0.0_wp
      bodies%angular_velocity(s) = 0.0_wp
      bodies%acceleration(:, s) = 0.0_wp
      bodies%angular_acceleration(s) = 0.0_wp
   end subroutine rest

   !> Find the bodies of the walls of the namelist: by their identifiers, or by the names that the result has.
   subroutine name_walls(settings, path, named, error)
      type(settings_t), intent(in) :: settings
      !> File of the result
      character(len=*), intent(in) :: path
      type(wall_t), allocatable, intent(inout) :: named(:)
      type(error_t), allocatable, intent(inout) :: error
      type(wall_t), allocatable :: former(:)
      character(len=:), allocatable :: names(:)
      integer :: j, k, place

      call find_wall_names(path, former, error)
      if (allocated(error)) return
      place = 0
      do j = 1, size(former)
         place = max(place, len(former(j)%name))
      end do
      allocate (character(len=place) :: names(size(former)))
      do j = 1, size(former)
         names(j) = former(j)%name
      end do
      deallocate (named)
      allocate (named(size(settings%wall)))
      do k = 1, size(settings%wall)
         associate (wall => settings%wall(k))
            named(k)%name = wall%name
            named(k)%id = wall%bodies
            if (wall%outline /= 'result') cycle
            place = 0
            do j = 1, size(former)
               if (names(j) == wall%name) place = j
            end do
            if (place > 0) then
               named(k)%id = former(place)%id
            else
               call raise(error, input_error, place_of(settings, 'wall.'//wall%name, 'outline')//': '//path// &
                          ' has no wall '//quoted(wall%name)//suggestion(wall%name, names)// &
                          '. Name its bodies: outline = ''bodies'' bodies = ...')
               return
            end if
         end associate
      end do
   end subroutine name_walls

   !> Let a simulation receive the contact history of the checkpoint from which it starts, before its forces are
   !> computed. Collective; all ranks get the same error.
   subroutine recall_history(simulation, error)
      !> The simulation after `place_bodies`
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(origin_t) :: origin
      type(checkpoint_file_t) :: file

      call open_start(simulation, file, origin, error)
      if (allocated(error) .or. origin%is_frame) return
      ! Here the state of the integrator is only tried.
      call file%choose_rows('/bodies/', rows_of(simulation%bodies%global_index, origin%removed))
      call simulation%motion%integrator%serialize(file)
      if (simulation%settings%integrate%scheme /= 'velocity_verlet') &
         call file%match('/run/time_step', simulation%dt, 's', 'time step, which this scheme keeps')
      call read_pairs(file, simulation, origin%around%most_pieces)
      call file%close(error)
      if (.not. allocated(error)) return
      error%message = error%message//'. The run of the result had other forces or another scheme; start from a '// &
         'frame of it (FOLDER:FRAME), which needs none of this'
      call blame(simulation%settings, error)
   end subroutine recall_history

   !> Open the checkpoint from which a simulation starts, unless it starts from a frame.
   subroutine open_start(simulation, file, origin, error)
      type(simulation_t), intent(inout) :: simulation
      type(checkpoint_file_t), intent(inout) :: file
      type(origin_t), intent(out) :: origin
      type(error_t), allocatable, intent(inout) :: error

      call find_origin(simulation%settings, origin, error)
      call simulation%comm%all_reduce_error(error)
      if (.not. (allocated(error) .or. origin%is_frame)) call file%open(origin%path, error, simulation%comm)
   end subroutine open_start

   !> Return to the state of the checkpoint from which a simulation starts, after its forces at time 0 were computed and
   !> used. Bodies enter the cell as they did then. Collective; all ranks get the same error.
   subroutine return_to_state(simulation, error)
      !> The simulation before its first step
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      type(origin_t) :: origin
      type(checkpoint_file_t) :: file
      type(bodies_t) :: before
      integer(ip) :: s

      if (simulation%settings%scene%name /= 'result') return
      call open_start(simulation, file, origin, error)
      if (allocated(error) .or. origin%is_frame) return
      associate (bodies => simulation%bodies)
         before = bodies
         call file%choose_rows('/bodies/', rows_of(bodies%global_index, origin%removed))
         ! The result may have had no cell, or one without shear.
         if (.not. origin%around%has_images .and. allocated(bodies%image)) deallocate (bodies%image)
         if (.not. origin%around%has_slides .and. allocated(bodies%slid)) deallocate (bodies%slid)
         call serialize_bodies(file, bodies)
         call set_cell(bodies, before%cell)
         if (bodies%cell%is_periodic) call join_copies(simulation%settings%cell, bodies%free, bodies)
         call simulation%motion%integrator%serialize(file)
         call read_pairs(file, simulation, origin%around%most_pieces)
         do s = 1_ip, bodies%n
            if (.not. bodies%fixed(s)) cycle
            bodies%position(:, s) = before%position(:, s)
            if (allocated(bodies%image)) bodies%image(s, :) = before%image(s, :)
            bodies%angle(s) = before%angle(s)
            bodies%velocity(:, s) = before%velocity(:, s)
            bodies%angular_velocity(s) = before%angular_velocity(s)
            bodies%acceleration(:, s) = before%acceleration(:, s)
            bodies%angular_acceleration(s) = before%angular_acceleration(s)
         end do
         call change_accelerations(simulation%energy_balance, before, bodies)
      end associate
      call file%close(error)
      if (allocated(error)) return
      ! The forces at time 0 end here: the balance must know what leaves before the first step.
      call find_release(simulation)
      call find_leaving(simulation)
      simulation%loop%step = -1_lp
      call rebuild_bodies(simulation, error)
   end subroutine return_to_state

end module polydem_start_from
