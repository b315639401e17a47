!> One segment of a trajectory: a self-describing HDF5 file.
!>
!>     /bodies      id, fixed, mass, inertia, vertex_start, vertex: the bodies of all frames, in ascending order of
!>                  identifiers (`polydem_segment_bodies`); material (if there are any); piece (if bodies may have
!>                  several pieces): number of the piece of each vertex within its body, from 0
!>     /cell        low, size: periodic cell (in a periodic cell)
!>     /frames      start: rows start[k] to start[k + 1] - 1 belong to frame k; position, angle, velocity,
!>                  angular_velocity, image (in a periodic cell) and shear_offset (in a sheared one): one row per body
!>                  of each frame, in the order of /bodies; id (if bodies enter or leave): which bodies these are;
!>                  step, time, shift and jump (in a sheared cell), cell_low and cell_size (if the size of the cell is
!>                  stress-controlled): one row per frame
!>     /walls       id; force and torque on the fixed bodies, and present if walls vanish: one row per frame
!>     /contacts    start: rows start[k] to start[k + 1] - 1 belong to frame k; first, second and the columns of
!>                  `polydem_contact_columns`: one row per contact (optional)
!>     /energy_balance      energy balance: one data set per entry, one row per frame (optional)
!>     /series      step, time and named values: one data set per column, one row per step of the series up to the last
!>                  frame of the segment (optional)
!>     /departures  step, time, sink, id, mass, velocity_x, velocity_y, x, y: one row per body that has left (optional)
!>     /provenance  origin of the file
!>
!> Indices count from 0. Length times normal of a contact is the integral of the outward normal over the part of the
!> outline of the first body that is inside the second body. Force and couple of a contact act on the first body, the
!> force at the point (`polydem_contact_resultant`).
!>
!> All ranks write a segment collectively. Each rank writes a block of rows in ascending order of identifiers. All
!> procedures are collective.
module polydem_trajectory_segment
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_contact_columns, only: contact_columns, values_of
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_frame_poses, only: write_poses
   use polydem_row_distribution, only: component, row_distribution_t, vector
   use polydem_hdf5_file, only: hdf5_file_t, many_rows, one_row, part_t
   use polydem_kinds, only: bp, dp, ip, lp
   use polydem_named_values, only: named_values_t
   use polydem_ownership, only: order_bodies, order_pairs
   use polydem_series, only: series_t
   implicit none
   private
   public :: write_surroundings, add_frame, add_walls, add_contacts, add_balance, add_series

contains

   !> Write the periodic cell and the identifiers of the fixed bodies, if there are any.
   subroutine write_surroundings(file, bodies, error)
      type(hdf5_file_t), intent(inout) :: file
      type(bodies_t), intent(in) :: bodies
      type(error_t), allocatable, intent(inout) :: error

      if (bodies%cell%is_periodic) then
         call file%write('/cell/low', real(bodies%cell%low, dp), error, 'm', 'lower left corner of the periodic cell')
         call file%write('/cell/size', real(bodies%cell%size, dp), error, 'm', &
                         'its width and height; 0 along an axis that is not periodic')
      end if
      if (.not. any(bodies%fixed(:bodies%n))) return
      call file%write('/walls/id', pack(bodies%id(:bodies%n), bodies%fixed(:bodies%n)), error, '1', &
                      'identifier of each fixed body, ascending')
   end subroutine write_surroundings

   !> Add the poses and velocities of all bodies.
   subroutine add_frame(file, comm, n_before, step, time, bodies, has_ids, error)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      !> On entry the number of bodies in all earlier frames of this segment together; on return including this frame
      integer(lp), intent(inout) :: n_before
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Simulated time [s]
      real(dp), intent(in) :: time
      type(bodies_t), intent(in) :: bodies
      !> Whether to say which bodies the frame has; otherwise it has those of the segment
      logical, intent(in) :: has_ids
      type(error_t), allocatable, intent(inout) :: error
      type(row_distribution_t) :: blocks
      integer(lp), allocatable :: ids(:, :)

      call order_bodies(comm, bodies, blocks)
      if (n_before == 0_lp) call file%write('/frames/start', 0_lp, error, '1', &
                                            'frame k owns the rows start[k] to start[k + 1] - 1', rows=one_row)
      n_before = n_before + blocks%total
      call file%write('/frames/start', n_before, error, rows=one_row)
      call file%write('/frames/step', step, error, '1', 'number of the time step', rows=one_row)
      call file%write('/frames/time', time, error, 's', 'simulated time', rows=one_row)
      if (has_ids) then
         call blocks%to_blocks(comm, reshape(int(bodies%id, lp), [1_ip, bodies%n]), ids)
         call file%write('/frames/id', int(ids(1, :), ip), error, '1', 'identifiers of the bodies, ascending', &
                         part_t(blocks%first, blocks%total), rows=many_rows)
      end if
      call write_poses(file, comm, bodies, blocks, error)
   end subroutine add_frame

   !> Add the forces and torques on the fixed bodies, if there are any.
   subroutine add_walls(file, bodies, error)
      type(hdf5_file_t), intent(inout) :: file
      !> Bodies; on the root rank with the total forces on the fixed bodies
      type(bodies_t), intent(in) :: bodies
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: force(:, :), torque(:)
      integer(ip) :: s, w

      w = int(count(bodies%fixed(:bodies%n)), ip)
      if (w == 0_ip) return
      allocate (force(2, w), torque(w))
      w = 0_ip
      do s = 1_ip, bodies%n
         if (.not. bodies%fixed(s)) cycle
         w = w + 1_ip
         force(:, w) = real(bodies%force(:, s), dp)
         torque(w) = real(bodies%torque(s), dp)
      end do
      call file%write('/walls/force', force, error, 'N/m', 'forces of the other bodies on each fixed body', &
                      rows=one_row)
      call file%write('/walls/torque', torque, error, 'N', 'torques about its centre of mass', rows=one_row)
      if (allocated(bodies%removed)) call file%write( &
         '/walls/present', int(pack(merge(0, 1, bodies%removed(:bodies%n)), bodies%fixed(:bodies%n)), bp), error, '1', &
         '1: present, 0: its wall has vanished', rows=one_row)
   end subroutine add_walls

   !> Add the contacts of a frame.
   subroutine add_contacts(file, comm, n_before, bodies, contacts, error)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      !> On entry the number of contacts in the earlier frames of this segment; on return including this frame
      integer(lp), intent(inout) :: n_before
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      type(error_t), allocatable, intent(inout) :: error
      type(row_distribution_t) :: blocks
      type(part_t) :: part
      integer(lp), allocatable :: ids(:, :), pairs(:, :)
      real(dp), allocatable :: values(:, :), block(:, :)
      integer(ip) :: c
      integer :: k, place

      associate (n => contacts%n)
         allocate (ids(2, n), values(sum(contact_columns%width), n))
         do c = 1_ip, n
            ids(1, c) = int(bodies%id(contacts%row(c)%first), lp)
            ids(2, c) = int(bodies%id(contacts%row(c)%second), lp)
            values(:, c) = values_of(bodies, contacts, c)
         end do
         call order_pairs(comm, bodies, contacts%row(:n)%first, contacts%row(:n)%second, blocks)
      end associate
      call blocks%to_blocks(comm, ids, pairs)
      call blocks%to_blocks(comm, values, block)
      part = part_t(blocks%first, blocks%total)
      if (.not. file%has('/contacts/start', error)) then
         call file%write('/contacts/start', 0_lp, error, '1', 'frame k owns the rows start[k] to start[k + 1] - 1', &
                         rows=one_row)
      end if
      n_before = n_before + blocks%total
      call file%write('/contacts/start', n_before, error, rows=one_row)
      call file%write('/contacts/first', int(pairs(1, :), ip), error, '1', &
                      'identifier of the first body, the lower one', part, rows=many_rows)
      call file%write('/contacts/second', int(pairs(2, :), ip), error, '1', 'identifier of the second body', part, &
                      rows=many_rows)
      place = 1
      do k = 1, size(contact_columns)
         associate (label => contact_columns(k)%label_t)
            if (contact_columns(k)%width == 1) then
               call file%write('/contacts/'//trim(label%name), component(block, place), error, trim(label%unit), &
                               trim(label%meaning), part, rows=many_rows)
            else
               call file%write('/contacts/'//trim(label%name), vector(block, place), error, trim(label%unit), &
                               trim(label%meaning), part, rows=many_rows)
            end if
         end associate
         place = place + contact_columns(k)%width
      end do
   end subroutine add_contacts

   !> Add a row of the energy balance.
   subroutine add_balance(file, row, error)
      type(hdf5_file_t), intent(inout) :: file
      !> Entries of the energy balance of this frame, the same on all ranks
      type(named_values_t), intent(in) :: row
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (.not. allocated(row%label)) return
      do k = 1, size(row%label)
         associate (label => row%label(k))
            call file%write('/energy_balance/'//trim(label%name), row%value(k), error, trim(label%unit), &
                            trim(label%meaning), rows=one_row)
         end associate
      end do
   end subroutine add_balance

   !> Add the rows of a series that are kept.
   subroutine add_series(file, group, series, error)
      type(hdf5_file_t), intent(inout) :: file
      !> Name of the group
      character(len=*), intent(in) :: group
      !> Rows, the same on all ranks
      type(series_t), intent(in) :: series
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (series%n == 0) return
      call file%write(group//'/step', series%step(:series%n), error, '1', 'number of the time step', rows=many_rows)
      call file%write(group//'/time', series%time(:series%n), error, 's', 'simulated time', rows=many_rows)
      do k = 1, size(series%row%label)
         associate (label => series%row%label(k))
            call file%write(group//'/'//trim(label%name), series%value(k, :series%n), error, trim(label%unit), &
                            trim(label%meaning), rows=many_rows)
         end associate
      end do
   end subroutine add_series

end module polydem_trajectory_segment
