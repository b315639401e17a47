!> One segment of a trajectory: a self-describing HDF5 file.
!>
!>     /bodies      id, fixed, mass, inertia, vertex_start, vertex: the bodies, in ascending order of identifiers
!>                  piece (if bodies have several pieces): number of the piece of each vertex within its body, from 0
!>     /cell        low, size: periodic cell (in a periodic cell)
!>     /frames      step, time, position, angle, velocity, angular_velocity: one row per frame;
!>                  image (in a periodic cell), shear_offset, shift and jump (in a sheared cell), cell_low and
!>                  cell_size (if the size of the cell is stress-controlled)
!>     /walls       id; force and torque on the fixed bodies, and present if walls vanish: one row per frame
!>     /contacts    start: rows start[k] to start[k + 1] - 1 belong to frame k; first, second and the columns of
!>                  `polydem_contact_columns`: one row per contact (optional)
!>     /energy_balance      energy balance: one data set per entry, one row per frame (optional)
!>     /series      step, time and named values: one data set per column, one row per step of the series up to the last
!>                  frame of the segment (optional)
!>     /provenance  origin of the file
!>
!> If bodies enter or leave, /bodies and /frames have another form (`polydem_ragged_segment`).
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
   use polydem_ownership, only: order_bodies, order_pairs, order_vertices
   use polydem_series, only: series_t
   implicit none
   private
   public :: write_bodies, write_surroundings, add_frame, add_walls, add_contacts, add_balance, add_series

   !> Number of vertices that one rank writes at once, so that it needs little memory
   integer(ip), parameter :: vertices_at_once = 100000_ip

contains

   !> Write the constant properties of the bodies: identifier, fixed flag, mass, inertia, shape and material.
   subroutine write_bodies(file, comm, bodies, error)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      type(error_t), allocatable, intent(inout) :: error
      type(row_distribution_t) :: blocks
      type(part_t) :: part
      integer(lp), allocatable :: numbers(:, :), block(:, :)
      integer(ip) :: s

      call order_bodies(comm, bodies, blocks)
      part = part_t(blocks%first, blocks%total)
      call write_masses(file, comm, bodies, blocks, error)
      allocate (numbers(3, bodies%n))
      do s = 1_ip, bodies%n
         numbers(1, s) = int(bodies%id(s), lp)
         numbers(2, s) = merge(1_lp, 0_lp, bodies%fixed(s))
         numbers(3, s) = int(bodies%pieces%vertex_start(s + 1_ip) - bodies%pieces%vertex_start(s), lp)
      end do
      call blocks%to_blocks(comm, numbers, block)
      deallocate (numbers)
      call file%write('/bodies/id', int(block(1, :), ip), error, '1', 'identifier of each body, ascending', part)
      call file%write('/bodies/fixed', int(block(2, :), bp), error, '1', &
                      '1: fixed or with prescribed motion, 0: free', part)
      call write_vertices(file, comm, bodies, int(block(3, :), ip), part, error)
      if (allocated(bodies%material)) then
         call blocks%to_blocks(comm, reshape(int(bodies%material, lp), [1, size(bodies%material)]), block)
         call file%write('/bodies/material', int(block(1, :), ip), error, '1', &
                         'material: position among the groups &material of the namelist, 0: none of them', part)
      end if
      call write_surroundings(file, bodies, error)
   end subroutine write_bodies

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

   !> Write the masses and moments of inertia of all bodies.
   subroutine write_masses(file, comm, bodies, blocks, error)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      type(row_distribution_t), intent(in) :: blocks
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: masses(:, :), block(:, :)
      type(part_t) :: part
      integer(ip) :: s

      allocate (masses(2, bodies%n))
      do s = 1_ip, bodies%n
         masses(:, s) = [real(bodies%mass(s), dp), real(bodies%inertia(s), dp)]
      end do
      call blocks%to_blocks(comm, masses, block)
      part = part_t(blocks%first, blocks%total)
      call file%write('/bodies/mass', component(block, 1), error, 'kg/m', 'mass; 0: infinite', part)
      call file%write('/bodies/inertia', component(block, 2), error, 'kg m', &
                      'moment of inertia about the centre of mass; 0: infinite', part)
   end subroutine write_masses

   !> Write the vertices of all bodies and the first vertex of each body.
   subroutine write_vertices(file, comm, bodies, n_vertices, part, error)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Number of vertices of each body in the block of this rank
      integer(ip), intent(in) :: n_vertices(:)
      !> Block of bodies of this rank
      type(part_t), intent(in) :: part
      type(error_t), allocatable, intent(inout) :: error
      type(row_distribution_t) :: blocks
      integer(ip), allocatable :: start(:)
      integer(lp), allocatable :: pieces(:, :)
      real(dp), allocatable :: vertices(:, :)
      character(len=*), parameter :: about_start = &
         'body k owns the rows vertex_start[k] to vertex_start[k + 1] - 1 of vertex', &
         about_piece = 'number of the piece of each vertex within its body, from 0', &
         about_vertex = 'vertices relative to the centre of mass at angle 0, anticlockwise'
      integer(ip) :: k, n

      n = bodies%pieces%vertex_start(bodies%n + 1_ip) - 1_ip
      if (comm%size == 1_ip) then
         ! One rank has all rows in order. It needs no memory for a plan.
         call file%write('/bodies/vertex_start', bodies%pieces%vertex_start - 1_ip, error, '1', about_start)
         do k = 1_ip, max(n, 1_ip), vertices_at_once
            associate (last => min(n, k + (vertices_at_once - 1_ip)))
               call file%write('/bodies/vertex', real(bodies%pieces%vertex(:, k:last), dp), error, 'm', about_vertex, &
                               part_t(int(k, lp) - 1_lp, int(n, lp)))
            end associate
         end do
         if (bodies%pieces%most > 1_ip) call file%write('/bodies/piece', bodies%pieces%number, error, '1', about_piece)
         return
      end if
      allocate (start(size(n_vertices) + 1))
      call order_vertices(comm, bodies, blocks)
      call blocks%to_blocks(comm, real(bodies%pieces%vertex(:, :n), dp), vertices)
      if (bodies%pieces%most > 1_ip) then
         call blocks%to_blocks(comm, reshape(int(bodies%pieces%number, lp), [1_ip, n]), pieces)
         call file%write('/bodies/piece', int(pieces(1, :), ip), error, '1', about_piece, &
                         part_t(blocks%first, blocks%total))
      end if
      start(1) = int(blocks%first, ip)
      do k = 1_ip, size(n_vertices, kind=ip)
         start(k + 1) = start(k) + n_vertices(k)
      end do
      ! The last rank also writes the final entry, the number of all vertices.
      n = size(n_vertices, kind=ip)
      if (comm%rank == comm%size - 1_ip) n = n + 1_ip
      call file%write('/bodies/vertex_start', start(:n), error, '1', about_start, &
                      part_t(part%first, part%total + 1_lp))
      call file%write('/bodies/vertex', vertices, error, 'm', about_vertex, &
                      part_t(blocks%first, blocks%total))
   end subroutine write_vertices

   !> Add the poses and velocities of all bodies.
   subroutine add_frame(file, comm, step, time, bodies, error)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Simulated time [s]
      real(dp), intent(in) :: time
      type(bodies_t), intent(in) :: bodies
      type(error_t), allocatable, intent(inout) :: error
      type(row_distribution_t) :: blocks

      call order_bodies(comm, bodies, blocks)
      call file%write('/frames/step', step, error, '1', 'number of the time step', rows=one_row)
      call file%write('/frames/time', time, error, 's', 'simulated time', rows=one_row)
      call write_poses(file, comm, bodies, blocks, one_row, error)
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
   subroutine add_series(file, series, error)
      type(hdf5_file_t), intent(inout) :: file
      !> Rows, the same on all ranks
      type(series_t), intent(in) :: series
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: group
      integer :: k

      if (series%n == 0) return
      group = '/'//trim(series%name)//'/'
      call file%write(group//'step', series%step(:series%n), error, '1', 'number of the time step', rows=many_rows)
      call file%write(group//'time', series%time(:series%n), error, 's', 'simulated time', rows=many_rows)
      do k = 1, size(series%row%label)
         associate (label => series%row%label(k))
            call file%write(group//trim(label%name), series%value(k, :series%n), error, trim(label%unit), &
                            trim(label%meaning), rows=many_rows)
         end associate
      end do
   end subroutine add_series

end module polydem_trajectory_segment
