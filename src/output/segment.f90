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
module polydem_segment
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: bp, dp, ip, lp
   use polydem_ledger_row, only: ledger_row_t
   use polydem_provenance, only: provenance_t, write_provenance
   implicit none
   private
   public :: schema_version, start_segment, add_frame, add_walls, add_contacts, add_ledger

   !> Version of the layout; to be raised when a reader of the former one would fail
   integer(ip), parameter :: schema_version = 1_ip

contains

   !> Write what does not change: layout, bodies, provenance.
   subroutine start_segment(file, bodies, provenance, error)
      !> New file
      type(hdf5_file_t), intent(inout) :: file
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Where the result comes from
      type(provenance_t), intent(in) :: provenance
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      call file%write_attribute('/', 'content', 'segment of a trajectory by polydem', error)
      call file%write_attribute('/', 'schema_version', schema_version, error)
      associate (n => bodies%n)
         call file%write('/bodies/id', bodies%id(:n), error, '1', 'identifier of each body, ascending')
         call file%write('/bodies/fixed', merge(1_bp, 0_bp, bodies%fixed(:n)), error, '1', &
                         '1: moves by prescription or not at all, 0: free')
         call file%write('/bodies/mass', real(bodies%mass(:n), dp), error, 'kg/m', &
                         'mass; 0 stands for infinite')
         call file%write('/bodies/inertia', real(bodies%inertia(:n), dp), error, 'kg m', &
                         'moment of inertia about the centre of mass; 0 stands for infinite')
         call file%write('/bodies/vertex_start', bodies%vertex_start(:n + 1) - 1_ip, error, '1', &
                         'body k owns the rows vertex_start[k] to vertex_start[k + 1] - 1 of vertex')
         call file%write('/bodies/vertex', &
                         real(bodies%shape(:, :bodies%vertex_start(n + 1) - 1), dp), error, 'm', &
                         'vertices relative to the centre of mass at angle 0, anticlockwise')
         if (any(bodies%fixed(:n))) then
            call file%write('/walls/id', pack(bodies%id(:n), bodies%fixed(:n)), error, '1', &
                            'identifier of each fixed body, ascending')
         end if
      end associate
      call write_provenance(provenance, file, error)
   end subroutine start_segment

   !> Add the poses and velocities of all bodies.
   subroutine add_frame(file, step, time, bodies, error)
      !> Segment
      type(hdf5_file_t), intent(inout) :: file
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Simulated time [s]
      real(dp), intent(in) :: time
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      associate (n => bodies%n)
         call file%append('/frames/step', step, error, '1', 'number of the time step')
         call file%append('/frames/time', time, error, 's', 'simulated time')
         call file%append('/frames/position', real(bodies%position(:, :n), dp), error, 'm', 'centres of mass')
         call file%append('/frames/angle', real(bodies%angle(:n), dp), error, 'rad', &
                          'angles since the start, anticlockwise')
         call file%append('/frames/velocity', real(bodies%velocity(:, :n), dp), error, 'm/s', &
                          'velocities of the centres of mass')
         call file%append('/frames/angular_velocity', real(bodies%angular_velocity(:n), dp), error, 'rad/s', &
                          'angular velocities, anticlockwise')
      end associate
   end subroutine add_frame

   !> Add the forces and torques on the fixed bodies, if there are any.
   subroutine add_walls(file, bodies, error)
      !> Segment
      type(hdf5_file_t), intent(inout) :: file
      !> Bodies with their forces
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
   subroutine add_contacts(file, n_before, bodies, contacts, error)
      !> Segment
      type(hdf5_file_t), intent(inout) :: file
      !> Contacts in the former frames of this segment
      integer(lp), intent(in) :: n_before
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: point(:, :)
      integer(ip), allocatable :: first(:), second(:)
      integer(ip) :: c

      associate (n => contacts%n)
         allocate (point(2, n), first(n), second(n))
         do c = 1_ip, n
            first(c) = bodies%id(contacts%first(c))
            second(c) = bodies%id(contacts%second(c))
            point(:, c) = real(bodies%position(:, contacts%first(c)) + contacts%arm_first(:, c), dp)
         end do
         if (.not. file%has('/contacts/start')) then
            call file%append('/contacts/start', 0_lp, error, '1', &
                             'frame k owns the rows start[k] to start[k + 1] - 1')
         end if
         call file%append('/contacts/start', n_before + int(n, lp), error)
         call file%append_rows('/contacts/first', first, error, '1', &
                               'identifier of the first body, the lower one')
         call file%append_rows('/contacts/second', second, error, '1', &
                               'identifier of the second body')
         call file%append_rows('/contacts/area', real(contacts%area(:n), dp), error, 'm2', &
                               'area of the overlap; with the conservative law its effective area')
         call file%append_rows('/contacts/point', point, error, 'm', 'centroid of the overlap in the world')
         call file%append_rows('/contacts/normal', real(contacts%normal(:, :n), dp), error, 'm', &
                               'integral of the outward normal over the outline of first inside second, '// &
                               'the gradient of that area')
         call file%append_rows('/contacts/force', real(contacts%force(:, :n), dp), error, 'N/m', &
                               'force on the first body; the second feels the opposite')
      end associate
   end subroutine add_contacts

   !> Add a row of the ledger.
   subroutine add_ledger(file, row, error)
      !> Segment
      type(hdf5_file_t), intent(inout) :: file
      !> Entries of this frame
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
