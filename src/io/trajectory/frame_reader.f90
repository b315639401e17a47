!> Reads the bodies of a frame of a result.
module polydem_frame_reader
   use polydem_body_list, only: body_list_t
   use polydem_elementary, only: sine_and_cosine
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: exists
   use polydem_frame_columns, only: frame_columns_t, insist_on_layout, read_frame
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_result_files, only: segment_path
   use polydem_strings, only: to_text
   implicit none
   private
   public :: surroundings_t, find_frame, list_frame, read_surroundings

   !> What a checkpoint or a frame says of the periodic cell and of pieces
   type :: surroundings_t
      !> Width and height of a stress-controlled cell; 0 if the size of the cell is constant, or there is none [m]
      real(wp) :: size(2) = 0.0_wp
      !> Displacement [m] and velocity [m/s] of the copy above
      real(wp) :: shift = 0.0_wp, jump = 0.0_wp
      !> Whether a checkpoint has the cells that bodies have crossed, and the shifts of the borders that they crossed
      logical :: has_images = .false., has_shear_offset = .false.
      !> Greatest number of pieces of a body, in a checkpoint
      integer(ip) :: most_pieces = 1_ip
   end type surroundings_t

contains

   !> Find the closed segment of a result that has a frame.
   subroutine find_frame(folder, number, path, row, time, error)
      !> Result folder
      character(len=*), intent(in) :: folder
      !> Number of the frame in the result, from 0; -1: its last frame
      integer(ip), intent(in) :: number
      !> Path of the segment
      character(len=:), allocatable, intent(out) :: path
      !> Number of frames before it in the segment
      integer(lp), intent(out) :: row
      !> Simulated time of the frame [s]
      real(dp), intent(out) :: time
      !> Allocated if there is no such frame
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      real(dp), allocatable :: times(:)
      character(len=:), allocatable :: last
      integer(lp) :: n, passed
      integer(ip) :: k

      row = int(number, lp)
      if (number < 0_ip) row = huge(row)
      n = 0_lp
      passed = 0_lp
      time = 0.0_dp
      k = 1_ip
      do while (exists(segment_path(folder, k), error))
         path = segment_path(folder, k)
         call file%open(path, error)
         if (allocated(error)) return
         call file%read('/frames/time', times, error)
         call file%close(error)
         if (allocated(error)) return
         if (row < size(times, kind=lp)) then
            time = times(row + 1_lp)
            return
         end if
         row = row - size(times, kind=lp)
         passed = passed + size(times, kind=lp)
         k = k + 1_ip
         if (size(times) == 0) cycle
         last = path
         n = size(times, kind=lp)
         time = times(n)
      end do
      if (number < 0_ip .and. n > 0_lp) then
         path = last
         row = n - 1_lp
         return
      end if
      call raise(error, input_error, folder//' has no frame '//to_text(number)//' in closed segments, only '// &
                 to_text(passed)//' frames, counted from 0')
   end subroutine find_frame

   !> Whether the shapes of the bodies of a segment are consistent
   pure logical function fit(start, shape, piece, n)
      !> Data sets /bodies/vertex_start, vertex and piece
      integer(ip), intent(in) :: start(:), piece(:)
      real(dp), intent(in) :: shape(:, :)
      !> Number of bodies
      integer, intent(in) :: n
      integer :: k

      fit = size(start) == n + 1 .and. size(shape, 1) == 2 .and. size(piece) == size(shape, 2)
      if (fit) fit = start(1) == 0_ip .and. start(n + 1) == size(shape, 2) .and. all(start(2:) >= start(:n))
      do k = 1, n
         if (.not. fit .or. start(k + 1) == start(k)) cycle
         associate (number => piece(start(k) + 1:start(k + 1)))
            fit = number(1) == 0_ip .and. all(number(2:) == number(:size(number) - 1) &
                                              .or. number(2:) == number(:size(number) - 1) + 1_ip)
         end associate
      end do
   end function fit

   !> Append the bodies of a frame to a list, with their identifiers, masses and velocities.
   subroutine list_frame(path, row, list, error)
      !> Path of the segment
      character(len=*), intent(in) :: path
      !> Number of frames before this one in the segment
      integer(lp), intent(in) :: row
      type(body_list_t), intent(inout) :: list
      !> Names the file and what is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      integer(ip), allocatable :: id(:), fixed(:), start(:), material(:), piece(:)
      real(dp), allocatable :: shape(:, :), mass(:), inertia(:)
      real(wp), allocatable :: corners(:, :)
      type(frame_columns_t) :: frame
      logical, allocatable :: is_removed(:)
      real(wp) :: c, s
      integer(ip) :: j, k, v

      call file%open(path, error)
      if (allocated(error)) return
      call file%read('/bodies/id', id, error)
      call file%read('/bodies/fixed', fixed, error)
      call file%read('/bodies/vertex_start', start, error)
      call file%read('/bodies/vertex', shape, error)
      if (file%has('/bodies/piece', error)) call file%read('/bodies/piece', piece, error)
      call file%read('/bodies/mass', mass, error)
      call file%read('/bodies/inertia', inertia, error)
      if (list%has_materials) call file%read('/bodies/material', material, error)
      if (.not. allocated(error)) then
         if (.not. allocated(material)) material = spread(0_ip, 1, size(id))
         if (.not. allocated(piece)) piece = spread(0_ip, 1, size(shape, 2))
         if (row < 0_lp .or. any([size(fixed), size(material), size(mass), size(inertia)] /= size(id)) &
             .or. .not. fit(start, shape, piece, size(id))) call raise(error, input_error, path// &
            ': the data sets of its segment of a trajectory are inconsistent')
      end if
      call insist_on_layout(file, path, error)
      if (.not. allocated(error)) call read_frame(file, row, id, frame, error)
      if (.not. allocated(error)) call find_removed(file, row, fixed == 1_ip, is_removed, error)
      call file%close(error)
      if (allocated(error)) return
      do j = 1_ip, size(frame%body, kind=ip)
         k = frame%body(j)
         if (is_removed(k)) cycle
         call sine_and_cosine(real(frame%angle(j), wp), s, c)
         corners = real(shape(:, start(k) + 1_ip:start(k + 1_ip)), wp)
         do v = 1_ip, size(corners, 2, kind=ip)
            corners(:, v) = [c*corners(1, v) - s*corners(2, v), s*corners(1, v) + c*corners(2, v)] &
                            + real(frame%position(:, j), wp)
         end do
         if (fixed(k) == 1_ip) then
            call list%append(corners, fixed=.true., id=id(k), masses=real([mass(k), inertia(k)], wp), &
                             material=material(k), piece=piece(start(k) + 1_ip:start(k + 1_ip)))
         else
            call list%append(corners, velocity=real(frame%velocity(:, j), wp), &
                             angular_velocity=real(frame%spin(j), wp), id=id(k), &
                             masses=real([mass(k), inertia(k)], wp), material=material(k), &
                             piece=piece(start(k) + 1_ip:start(k + 1_ip)))
         end if
      end do
   end subroutine list_frame

   !> Find out which bodies belong to walls that were removed at a frame.
   subroutine find_removed(file, row, is_fixed, is_removed, error)
      type(hdf5_file_t), intent(in) :: file
      !> Number of frames before this one in the segment
      integer(lp), intent(in) :: row
      !> Whether each body of the segment is fixed, (body)
      logical, intent(in) :: is_fixed(:)
      !> Whether its wall was removed, (body)
      logical, allocatable, intent(out) :: is_removed(:)
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: present_walls(:, :)

      is_removed = spread(.false., 1, size(is_fixed))
      if (.not. file%has('/walls/present', error)) return
      call file%read('/walls/present', present_walls, error, rows=[row, 1_lp])
      if (allocated(error)) return
      if (size(present_walls) /= count(is_fixed)) then
         call raise(error, input_error, '/walls/present has another number of bodies than there are fixed ones')
      else
         is_removed = unpack(present_walls(:, 1) < 0.5_dp, is_fixed, .false.)
      end if
   end subroutine find_removed

   !> Read what a checkpoint or a frame of a segment says of the periodic cell and of pieces.
   subroutine read_surroundings(path, row, found, error)
      !> Path of the checkpoint or segment
      character(len=*), intent(in) :: path
      !> Number of frames before this one in the segment
      integer(lp), intent(in) :: row
      !> What is there
      type(surroundings_t), intent(out) :: found
      !> Names the file and what is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      integer(ip), allocatable :: most(:)
      real(dp), allocatable :: values(:), rows(:, :), shift(:), jump(:)

      call file%open(path, error)
      if (allocated(error)) return
      found%has_images = file%has('/bodies/image_x', error)
      found%has_shear_offset = file%has('/bodies/shear_offset', error)
      if (file%has('/run/cell', error)) then
         call file%read('/run/cell', values, error)
      else if (file%has('/frames/cell_size', error)) then
         call file%read('/frames/cell_size', rows, error, rows=[row, 1_lp])
         if (.not. allocated(error)) values = rows(:, 1)
      end if
      if (file%has('/run/shift', error)) then
         call file%read('/run/shift', shift, error)
         call file%read('/run/jump', jump, error)
      else if (file%has('/frames/shift', error)) then
         call file%read('/frames/shift', shift, error, rows=[row, 1_lp])
         call file%read('/frames/jump', jump, error, rows=[row, 1_lp])
      end if
      if (file%has('/vertices/piece', error)) call file%read('/run/most_pieces', most, error)
      call file%close(error)
      if (allocated(error)) return
      if (allocated(values)) then
         if (size(values) >= 2) found%size = real(values(1:2), wp)
      end if
      if (allocated(shift)) then
         if (size(shift) == 1) found%shift = real(shift(1), wp)
         if (size(jump) == 1) found%jump = real(jump(1), wp)
      end if
      if (.not. allocated(most)) return
      if (size(most) == 1 .and. all(most >= 1_ip)) found%most_pieces = most(1)
      if (size(most) /= 1 .or. any(most < 1_ip)) call raise(error, input_error, path// &
         ': /run/most_pieces is no number of pieces')
   end subroutine read_surroundings

end module polydem_frame_reader
