!> Poses and velocities of the bodies of a frame.
module polydem_frame_poses
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t, many_rows, one_row, part_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_row_distribution, only: component, row_distribution_t, vector
   implicit none
   private
   public :: write_poses

contains

   !> Add the poses and velocities of all bodies to /frames, and what a periodic cell adds. Collective.
   subroutine write_poses(file, comm, bodies, blocks, error)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Order of the bodies in the file
      type(row_distribution_t), intent(in) :: blocks
      type(error_t), allocatable, intent(inout) :: error
      type(part_t) :: part
      real(dp), allocatable :: state(:, :), block(:, :)
      integer(lp), allocatable :: images(:, :)
      integer(ip) :: s

      allocate (state(6, bodies%n))
      do s = 1_ip, bodies%n
         state(1:2, s) = real(bodies%position(:, s), dp)
         state(3, s) = real(bodies%angle(s), dp)
         state(4:5, s) = real(bodies%velocity(:, s), dp)
         state(6, s) = real(bodies%angular_velocity(s), dp)
      end do
      call blocks%to_blocks(comm, state, block)
      deallocate (state)
      part = part_t(blocks%first, blocks%total)
      call file%write('/frames/position', vector(block, 1), error, 'm', 'centres of mass', part, rows=many_rows)
      call file%write('/frames/angle', component(block, 3), error, 'rad', 'angles since the start, anticlockwise', &
                      part, rows=many_rows)
      call file%write('/frames/velocity', vector(block, 4), error, 'm/s', 'velocities of the centres of mass', part, &
                      rows=many_rows)
      call file%write('/frames/angular_velocity', component(block, 6), error, 'rad/s', &
                      'angular velocities, anticlockwise', part, rows=many_rows)
      if (allocated(bodies%work)) then
         call blocks%to_blocks(comm, real(bodies%work, dp), block)
         call file%write('/frames/damping_work', component(block, 1), error, 'J/m', &
                         'works of the normal damping on each body so far', part, rows=many_rows)
         call file%write('/frames/friction_work', component(block, 2), error, 'J/m', &
                         'works of the tangential forces on each body so far', part, rows=many_rows)
      end if
      if (.not. allocated(bodies%image)) return
      call blocks%to_blocks(comm, transpose(int(bodies%image, lp)), images)
      call file%write('/frames/image', int(images, ip), error, '1', &
                      'cells crossed: position + image*size is the path without the cell', part, rows=many_rows)
      if (allocated(bodies%cell%load)) then
         call file%write('/frames/cell_low', real(bodies%cell%low, dp), error, 'm', &
                         'lower left corner of the periodic cell', rows=one_row)
         call file%write('/frames/cell_size', real(bodies%cell%size, dp), error, 'm', &
                         'its width and height', rows=one_row)
      end if
      if (.not. allocated(bodies%shear_offset)) return
      call blocks%to_blocks(comm, reshape(real(bodies%shear_offset, dp), [1_ip, bodies%n]), block)
      call file%write('/frames/shear_offset', component(block, 1), error, 'm', &
                      'shifts of the crossed borders, to be added to this path along x', part, rows=many_rows)
      call file%write('/frames/shift', real(bodies%cell%shift, dp), error, 'm', &
                      'displacement of the copy of the cell above along x', rows=one_row)
      call file%write('/frames/jump', real(bodies%cell%jump, dp), error, 'm/s', 'its velocity', rows=one_row)
   end subroutine write_poses

end module polydem_frame_poses
