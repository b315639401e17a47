!> One segment of a trajectory: an HDF5 file that explains itself.
!>
!>     /bodies      id, fixed, mass, inertia, vertex_start, vertex: the bodies, in order of identifiers
!>     /frames      step, time, position, angle, velocity, angular_velocity: one row per frame
!>     /walls       id; force and torque per frame: what acts on the fixed bodies
!>     /contacts    start: rows start[k] to start[k + 1] - 1 belong to frame k; first, second, area, point,
!>                  normal, force: one row per contact (if asked for)
!>     /ledger      one data set per entry, one row per frame (if given)
!>     /provenance  where it comes from
!>
!> Indices count from 0. A contact's normal is the integral of the outward normal over the outline of the
!> first body inside the second; its force is that on the first body.
!>
!> Several processes write one segment together, each its block of rows in ascending order of identifiers. All
!> procedures but `start_segment` are collective.
module polydem_segment
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t, part_t
   use polydem_kinds, only: bp, dp, ip, lp
   use polydem_ledger_row, only: ledger_row_t
   use polydem_own_rows, only: lay_out_bodies, lay_out_pairs, lay_out_parts
   use polydem_provenance, only: provenance_t, write_provenance
   use polydem_row_blocks, only: component, row_blocks_t, vector
   use polydem_team, only: team_t
   implicit none
   private
   public :: schema_version, start_segment, write_bodies, add_frame, add_walls, add_contacts, add_ledger

   !> Version of the layout; to be raised when a reader of the former one would fail
   integer(ip), parameter :: schema_version = 1_ip

contains

   !> Write what a segment is, and where it comes from; the leader does it alone.
   subroutine start_segment(file, provenance, error)
      !> New file
      type(hdf5_file_t), intent(inout) :: file
      !> Where the result comes from
      type(provenance_t), intent(in) :: provenance
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      call file%write_attribute('/', 'content', 'segment of a trajectory by polydem', error)
      call file%write_attribute('/', 'schema_version', schema_version, error)
      call write_provenance(provenance, file, error)
   end subroutine start_segment

   !> Write what does not change about bodies.
   subroutine write_bodies(file, team, bodies, error)
      !> Segment
      type(hdf5_file_t), intent(inout) :: file
      !> Processes
      class(team_t), intent(inout) :: team
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      type(row_blocks_t) :: blocks
      type(part_t) :: part
      integer(lp), allocatable :: numbers(:, :)
      real(dp), allocatable :: masses(:, :)
      integer(ip) :: s

      call lay_out_bodies(team, bodies, blocks)
      part = part_t(blocks%first, blocks%total)
      associate (n => bodies%n)
         call blocks%bring(team, reshape([(int(bodies%id(s), lp), merge(1_lp, 0_lp, bodies%fixed(s)), &
            int(bodies%vertex_start(s + 1_ip) - bodies%vertex_start(s), lp), s=1_ip, n)], [3_ip, n]), numbers)
         call blocks%bring(team, reshape([(real(bodies%mass(s), dp), real(bodies%inertia(s), dp), s=1_ip, n)], &
                                         [2_ip, n]), masses)
      end associate
      call file%write('/bodies/id', int(numbers(1, :), ip), error, '1', 'identifier of each body, ascending', part)
      call file%write('/bodies/fixed', int(numbers(2, :), bp), error, '1', &
                      '1: moves by prescription or not at all, 0: free', part)
      call file%write('/bodies/mass', component(masses, 1), error, 'kg/m', 'mass; 0 stands for infinite', part)
      call file%write('/bodies/inertia', component(masses, 2), error, 'kg m', &
                      'moment of inertia about the centre of mass; 0 stands for infinite', part)
      call write_vertices(file, team, bodies, numbers(3, :), part, error)
      if (.not. any(bodies%fixed(:bodies%n))) return
      call file%write('/walls/id', pack(bodies%id(:bodies%n), bodies%fixed(:bodies%n)), error, '1', &
                      'identifier of each fixed body, ascending')
   end subroutine write_bodies

   !> Write the vertices of all bodies, and which are whose.
   subroutine write_vertices(file, team, bodies, n_vertices, part, error)
      type(hdf5_file_t), intent(inout) :: file
      class(team_t), intent(inout) :: team
      type(bodies_t), intent(in) :: bodies
      !> Vertices of the bodies in the block of this process, and its part of the bodies
      integer(lp), intent(in) :: n_vertices(:)
      type(part_t), intent(in) :: part
      type(error_t), allocatable, intent(inout) :: error
      type(row_blocks_t) :: blocks
      integer(ip), allocatable :: body(:), start(:)
      real(dp), allocatable :: vertices(:, :)
      integer(ip) :: k, n, s

      n = bodies%vertex_start(bodies%n + 1_ip) - 1_ip
      allocate (body(n), start(size(n_vertices) + 1))
      do s = 1_ip, bodies%n
         body(bodies%vertex_start(s):bodies%vertex_start(s + 1_ip) - 1_ip) = s
      end do
      call lay_out_parts(team, bodies, body, blocks)
      call blocks%bring(team, real(bodies%shape(:, :n), dp), vertices)
      start(1) = int(blocks%first, ip)
      do k = 1_ip, size(n_vertices, kind=ip)
         start(k + 1) = start(k) + int(n_vertices(k), ip)
      end do
      ! The end of the last body is written by the last process.
      n = size(n_vertices, kind=ip)
      if (team%rank == team%size - 1_ip) n = n + 1_ip
      call file%write('/bodies/vertex_start', start(:n), error, '1', &
                      'body k owns the rows vertex_start[k] to vertex_start[k + 1] - 1 of vertex', &
                      part_t(part%first, part%total + 1_lp))
      call file%write('/bodies/vertex', vertices, error, 'm', &
                      'vertices relative to the centre of mass at angle 0, anticlockwise', &
                      part_t(blocks%first, blocks%total))
   end subroutine write_vertices

   !> Add the poses and velocities of all bodies.
   subroutine add_frame(file, team, step, time, bodies, error)
      !> Segment
      type(hdf5_file_t), intent(inout) :: file
      !> Processes
      class(team_t), intent(inout) :: team
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Simulated time [s]
      real(dp), intent(in) :: time
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      type(row_blocks_t) :: blocks
      type(part_t) :: part
      real(dp), allocatable :: state(:, :), block(:, :)
      integer(ip) :: s

      allocate (state(6, bodies%n))
      do s = 1_ip, bodies%n
         state(1:2, s) = real(bodies%position(:, s), dp)
         state(3, s) = real(bodies%angle(s), dp)
         state(4:5, s) = real(bodies%velocity(:, s), dp)
         state(6, s) = real(bodies%angular_velocity(s), dp)
      end do
      call lay_out_bodies(team, bodies, blocks)
      call blocks%bring(team, state, block)
      part = part_t(blocks%first, blocks%total)
      call file%append('/frames/step', step, error, '1', 'number of the time step')
      call file%append('/frames/time', time, error, 's', 'simulated time')
      call file%append('/frames/position', vector(block, 1), error, 'm', 'centres of mass', part)
      call file%append('/frames/angle', component(block, 3), error, 'rad', 'angles since the start, anticlockwise', &
                       part)
      call file%append('/frames/velocity', vector(block, 4), error, 'm/s', 'velocities of the centres of mass', part)
      call file%append('/frames/angular_velocity', component(block, 6), error, 'rad/s', &
                       'angular velocities, anticlockwise', part)
   end subroutine add_frame

   !> Add the forces and torques on the fixed bodies, if there are any.
   subroutine add_walls(file, bodies, error)
      !> Segment
      type(hdf5_file_t), intent(inout) :: file
      !> Bodies; at the leader with the whole forces on the fixed ones
      type(bodies_t), intent(in) :: bodies
      !> Allocated on failure
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
      call file%append('/walls/force', force, error, 'N/m', 'forces of the other bodies on each fixed body')
      call file%append('/walls/torque', torque, error, 'N', 'torques about its centre of mass')
   end subroutine add_walls

   !> Add the contacts of a frame.
   subroutine add_contacts(file, team, n_before, bodies, contacts, error)
      !> Segment
      type(hdf5_file_t), intent(inout) :: file
      !> Processes
      class(team_t), intent(inout) :: team
      !> Contacts in the former frames of this segment, and afterwards with those of this one
      integer(lp), intent(inout) :: n_before
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      type(row_blocks_t) :: blocks
      type(part_t) :: part
      integer(lp), allocatable :: ids(:, :), pairs(:, :)
      real(dp), allocatable :: values(:, :), block(:, :)
      integer(ip) :: c

      associate (n => contacts%n)
         allocate (ids(2, n), values(7, n))
         do c = 1_ip, n
            ids(1, c) = int(bodies%id(contacts%first(c)), lp)
            ids(2, c) = int(bodies%id(contacts%second(c)), lp)
            values(1, c) = real(contacts%area(c), dp)
            values(2:3, c) = real(bodies%position(:, contacts%first(c)) + contacts%arm_first(:, c), dp)
            values(4:5, c) = real(contacts%normal(:, c), dp)
            values(6:7, c) = real(contacts%force(:, c), dp)
         end do
         call lay_out_pairs(team, bodies, contacts%first(:n), contacts%second(:n), blocks)
      end associate
      call blocks%bring(team, ids, pairs)
      call blocks%bring(team, values, block)
      part = part_t(blocks%first, blocks%total)
      if (.not. file%has('/contacts/start')) then
         call file%append('/contacts/start', 0_lp, error, '1', 'frame k owns the rows start[k] to start[k + 1] - 1')
      end if
      n_before = n_before + blocks%total
      call file%append('/contacts/start', n_before, error)
      call file%append_rows('/contacts/first', int(pairs(1, :), ip), error, '1', &
                            'identifier of the first body, the lower one', part)
      call file%append_rows('/contacts/second', int(pairs(2, :), ip), error, '1', 'identifier of the second body', part)
      call file%append_rows('/contacts/area', component(block, 1), error, 'm2', &
                            'area of the overlap; with the conservative law its effective area', part)
      call file%append_rows('/contacts/point', vector(block, 2), error, 'm', 'centroid of the overlap in the world', &
                            part)
      call file%append_rows('/contacts/normal', vector(block, 4), error, 'm', &
                            'integral of the outward normal over the outline of first inside second, '// &
                            'the gradient of that area', part)
      call file%append_rows('/contacts/force', vector(block, 6), error, 'N/m', &
                            'force on the first body; the second feels the opposite', part)
   end subroutine add_contacts

   !> Add a row of the ledger.
   subroutine add_ledger(file, row, error)
      !> Segment
      type(hdf5_file_t), intent(inout) :: file
      !> Entries of this frame, the same on all processes
      type(ledger_row_t), intent(in) :: row
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (.not. allocated(row%name)) return
      do k = 1, size(row%name)
         call file%append('/ledger/'//trim(row%name(k)), row%value(k), error, trim(row%unit(k)), &
                          trim(row%meaning(k)))
      end do
   end subroutine add_ledger

end module polydem_segment
