!> The bodies of a run that starts from a result. A checkpoint has the whole state, a frame poses and velocities only.
!> Bodies of walls that were removed are left out.
module polydem_start_bodies
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_checkpoint_bodies, only: read_bodies
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_frame_reader, only: list_frame
   use polydem_kinds, only: ip, lp, wp
   use polydem_settings, only: settings_t
   use polydem_source_locations, only: place_of
   use polydem_start_materials, only: translate_materials
   use polydem_start_origin, only: blame, find_origin, origin_t
   use polydem_strings, only: quoted, suggestion, to_text
   use polydem_wall, only: wall_t
   use polydem_wall_names, only: find_material_names, find_wall_names
   implicit none
   private
   public :: read_start_bodies

contains

   !> Read the bodies from which a run starts: all fixed ones, at rest, and a share of the free ones; and find the walls
   !> that the namelist names. Collective; all ranks get the same error.
   subroutine read_start_bodies(settings, comm, bodies, named, error)
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
         bodies%cell%is_sheared = origin%around%has_shear_offset .and. bodies%cell%is_periodic
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
   end subroutine read_start_bodies

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

end module polydem_start_bodies
