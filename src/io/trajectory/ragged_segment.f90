!> Bodies and frames of a segment of a run in which bodies enter or leave.
!>
!>     /bodies      as in any segment, with one row per body that a frame of the segment has; rows are appended.
!>                  piece is there if any body of the run may have several pieces
!>     /frames      step, time: one row per frame; start: rows start[k] to start[k + 1] - 1 belong to frame k;
!>                  id, position, angle, velocity, angular_velocity: one row per body of each frame;
!>                  image (in a periodic cell), shear_offset, shift and jump (in a sheared cell)
!>     /departures  step, time, sink, id, mass, velocity_x, velocity_y, x, y: one row per body that has left
!>
!> Identifiers ascend in /bodies and in each frame.
module polydem_ragged_segment
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_frame_poses, only: write_poses
   use polydem_hdf5_file, only: hdf5_file_t, many_rows, one_row, part_t
   use polydem_kinds, only: bp, dp, ip, lp
   use polydem_ownership, only: order_bodies, order_vertices
   use polydem_row_distribution, only: component, row_distribution_t
   implicit none
   private
   public :: ragged_rows_t, append_bodies, add_ragged_frame

   !> What a segment has so far
   type :: ragged_rows_t
      !> Greatest identifier in /bodies
      integer(ip) :: last_id = -huge(1_ip)
      !> Number of vertices
      integer(ip) :: n_vertices = 0_ip
      !> Number of rows of all frames
      integer(lp) :: n_rows = 0_lp
   end type ragged_rows_t

contains

   !> Append the bodies that a segment does not have yet: identifier, fixed flag, mass, inertia, shape and material.
   subroutine append_bodies(file, comm, bodies, rows, error)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> What the segment has; changes
      type(ragged_rows_t), intent(inout) :: rows
      type(error_t), allocatable, intent(inout) :: error
      type(row_distribution_t) :: blocks
      type(part_t) :: part
      integer(ip), allocatable :: slots(:)
      integer(lp), allocatable :: numbers(:, :), block(:, :)
      real(dp), allocatable :: masses(:, :), mass_block(:, :)
      integer(ip) :: s
      integer(lp) :: last(1)

      slots = pack([(s, s=1_ip, bodies%n)], bodies%id > rows%last_id)
      call order_bodies(comm, bodies, blocks, slots)
      if (blocks%total == 0_lp) return
      part = part_t(blocks%first, blocks%total)
      allocate (numbers(4, bodies%n), source=0_lp)
      allocate (masses(2, bodies%n))
      do s = 1_ip, bodies%n
         numbers(1, s) = int(bodies%id(s), lp)
         numbers(2, s) = merge(1_lp, 0_lp, bodies%fixed(s))
         numbers(3, s) = int(bodies%pieces%vertex_start(s + 1_ip) - bodies%pieces%vertex_start(s), lp)
         if (allocated(bodies%material)) numbers(4, s) = int(bodies%material(s), lp)
         masses(:, s) = [real(bodies%mass(s), dp), real(bodies%inertia(s), dp)]
      end do
      call blocks%to_blocks(comm, numbers, block)
      call blocks%to_blocks(comm, masses, mass_block)
      call file%write('/bodies/id', int(block(1, :), ip), error, '1', 'identifier of each body, ascending', part, &
                      rows=many_rows)
      call file%write('/bodies/fixed', int(block(2, :), bp), error, '1', &
                      '1: fixed or with prescribed motion, 0: free', part, rows=many_rows)
      call file%write('/bodies/mass', component(mass_block, 1), error, 'kg/m', 'mass; 0: infinite', part, &
                      rows=many_rows)
      call file%write('/bodies/inertia', component(mass_block, 2), error, 'kg m', &
                      'moment of inertia about the centre of mass; 0: infinite', part, rows=many_rows)
      if (allocated(bodies%material)) call file%write('/bodies/material', int(block(4, :), ip), error, '1', &
         'material: position among the groups &material of the namelist, 0: none of them', part, rows=many_rows)
      call append_vertices(file, comm, bodies, slots, int(block(3, :), ip), part, rows, error)
      last = -huge(1_lp)
      if (size(slots) > 0) last = int(maxval(bodies%id(slots)), lp)
      call comm%all_reduce_max(last)
      rows%last_id = int(last(1), ip)
   end subroutine append_bodies

   !> Append the vertices of bodies.
   subroutine append_vertices(file, comm, bodies, slots, corners, part, rows, error)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies of this rank, and number of vertices of each body in its block
      integer(ip), intent(in) :: slots(:), corners(:)
      !> Block of bodies of this rank
      type(part_t), intent(in) :: part
      type(ragged_rows_t), intent(inout) :: rows
      type(error_t), allocatable, intent(inout) :: error
      type(row_distribution_t) :: blocks
      integer(ip), allocatable :: behind(:)
      integer(lp), allocatable :: pieces(:, :)
      real(dp), allocatable :: vertices(:, :)
      integer(ip) :: k, n
      character(len=*), parameter :: about_start = &
         'body k owns the rows vertex_start[k] to vertex_start[k + 1] - 1 of vertex'

      call order_vertices(comm, bodies, blocks, slots)
      n = bodies%pieces%vertex_start(bodies%n + 1_ip) - 1_ip
      call blocks%to_blocks(comm, real(bodies%pieces%vertex(:, :n), dp), vertices)
      if (bodies%pieces%most > 1_ip) then
         call blocks%to_blocks(comm, reshape(int(bodies%pieces%number, lp), [1_ip, n]), pieces)
         call file%write('/bodies/piece', int(pieces(1, :), ip), error, '1', &
                         'number of the piece of each vertex within its body, from 0', &
                         part_t(blocks%first, blocks%total), rows=many_rows)
      end if
      allocate (behind(size(corners)))
      n = rows%n_vertices + int(blocks%first, ip)
      do k = 1_ip, size(corners, kind=ip)
         n = n + corners(k)
         behind(k) = n
      end do
      if (rows%n_vertices == 0_ip) call file%write('/bodies/vertex_start', [0_ip], error, '1', about_start, &
                                                   rows=many_rows)
      call file%write('/bodies/vertex_start', behind, error, '1', about_start, part, rows=many_rows)
      call file%write('/bodies/vertex', vertices, error, 'm', &
                      'vertices relative to the centre of mass at angle 0, anticlockwise', &
                      part_t(blocks%first, blocks%total), rows=many_rows)
      rows%n_vertices = rows%n_vertices + int(blocks%total, ip)
   end subroutine append_vertices

   !> Add the poses and velocities of all bodies of a frame.
   subroutine add_ragged_frame(file, comm, step, time, bodies, rows, error)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Simulated time [s]
      real(dp), intent(in) :: time
      type(bodies_t), intent(in) :: bodies
      !> What the segment has; changes
      type(ragged_rows_t), intent(inout) :: rows
      type(error_t), allocatable, intent(inout) :: error
      type(row_distribution_t) :: blocks
      type(part_t) :: part
      integer(lp), allocatable :: ids(:, :)

      call order_bodies(comm, bodies, blocks)
      part = part_t(blocks%first, blocks%total)
      call blocks%to_blocks(comm, reshape(int(bodies%id, lp), [1_ip, bodies%n]), ids)
      if (rows%n_rows == 0_lp) call file%write('/frames/start', 0_lp, error, '1', &
         'frame k owns the rows start[k] to start[k + 1] - 1', rows=one_row)
      rows%n_rows = rows%n_rows + blocks%total
      call file%write('/frames/start', rows%n_rows, error, rows=one_row)
      call file%write('/frames/step', step, error, '1', 'number of the time step', rows=one_row)
      call file%write('/frames/time', time, error, 's', 'simulated time', rows=one_row)
      call file%write('/frames/id', int(ids(1, :), ip), error, '1', 'identifiers of the bodies', part, rows=many_rows)
      call write_poses(file, comm, bodies, blocks, many_rows, error)
   end subroutine add_ragged_frame

end module polydem_ragged_segment
