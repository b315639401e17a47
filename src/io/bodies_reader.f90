!> Reads bodies from an HDF5 file. Packings of other programs can thus serve as scenes.
!>
!> Data sets for n bodies with nv vertices in total; shapes as h5py shows them:
!>
!>     vertex            (nv, 2)  vertices in world coordinates, body after body [m]
!>     vertex_start      (n + 1)  first vertex of each body, counted from 0; the last entry is nv
!>     fixed             (n)      1 for a fixed body, 0 for a free one
!>     velocity          (n, 2)   optional, of the centre of mass [m/s]
!>     angular_velocity  (n)      optional [rad/s]
!>     density           (n)      optional, default: density of the namelist [kg/m3]
!>     mass, inertia     (n)      optional [kg/m, kg m]; 0 or absent: computed from the polygon for a
!>                                free body, infinite for a fixed body
!>     id                (n)      optional, default: 1 to n
!>
!> Any other data set at the top level is an error, because it may be a misspelt name. Groups are ignored.
module polydem_bodies_reader
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_hdf5_members, only: count_names, is_dataset, read_name
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_sort, only: sort_keys
   use polydem_strings, only: to_text, quoted, suggestion
   implicit none
   private
   public :: read_bodies_file

   !> Data sets that a bodies file may have
   character(len=*), parameter :: known_names(9) = [character(len=16) :: 'vertex', 'vertex_start', 'fixed', &
      'velocity', 'angular_velocity', 'density', 'mass', 'inertia', 'id']

   !> Contents of the file, with defaults filled in and checked
   type :: table_t
      !> Number of bodies
      integer(ip) :: n = 0_ip
      !> Vertices of all bodies in world coordinates, (2, vertex) [m]
      real(dp), allocatable :: vertex(:, :)
      !> First vertex of each body, counted from 0, and the number of vertices, (n + 1)
      integer(ip), allocatable :: vertex_start(:)
      !> 1: fixed body, 0: free body, (body)
      integer(ip), allocatable :: fixed(:)
      !> Velocities, (2, body) [m/s]
      real(dp), allocatable :: velocity(:, :)
      !> Angular velocities, (body) [rad/s]
      real(dp), allocatable :: angular_velocity(:)
      !> Densities, (body) [kg/m3]
      real(dp), allocatable :: density(:)
      !> Masses, (body) [kg/m]
      real(dp), allocatable :: mass(:)
      !> Moments of inertia, (body) [kg m]
      real(dp), allocatable :: inertia(:)
      !> Identifiers, (body)
      integer(ip), allocatable :: id(:)
   end type table_t

contains

   !> Append the bodies of a file to a list.
   subroutine read_bodies_file(path, density, list, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Density of the bodies if the file has no data set `density` [kg/m3]
      real(wp), intent(in) :: density
      type(body_list_t), intent(inout) :: list
      !> Names the file, the data set and the body
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      type(table_t) :: table
      integer :: bytes
      logical :: is_present

      ! Opening a pipe would block until another process writes to it.
      inquire (file=path, exist=is_present, size=bytes)
      if (is_present .and. bytes == 0) then
         call raise(error, input_error, path//' is not a bodies file: it is empty, or not a regular file (a pipe, '// &
                    'a device)')
         return
      end if
      call file%open(path, error)
      if (allocated(error)) return
      call check_names(file, path, error)
      if (.not. allocated(error)) call read_table(file, path, real(density, dp), table, error)
      call file%close(error)
      if (allocated(error)) return
      call list_table(table, list)
   end subroutine read_bodies_file

   !> Reject data sets with unknown names, and groups or links with the name of a data set.
   subroutine check_names(file, path, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: k, n

      call count_names(file%location_of('/'), n, error)
      do k = 1, n
         call read_name(file%location_of('/'), k, name, error)
         if (allocated(error)) return
         if (any(known_names == name) .eqv. is_dataset(file%location_of(name))) cycle
         if (any(known_names == name)) then
            call raise(error, input_error, path//': '//name//' must be a data set, but is a group or a link')
         else
            call raise(error, input_error, path//': unknown data set '//quoted(name)//suggestion(name, known_names))
         end if
         return
      end do
   end subroutine check_names

   !> Append the bodies of the table to a list.
   subroutine list_table(table, list)
      type(table_t), intent(in) :: table
      type(body_list_t), intent(inout) :: list
      integer(ip) :: k, first, last

      do k = 1_ip, table%n
         first = table%vertex_start(k) + 1_ip
         last = table%vertex_start(k + 1_ip)
         call list%append(real(table%vertex(:, first:last), wp), &
                          fixed=table%fixed(k) == 1_ip, &
                          density=real(table%density(k), wp), &
                          velocity=real(table%velocity(:, k), wp), &
                          angular_velocity=real(table%angular_velocity(k), wp), &
                          id=table%id(k), &
                          mass=real(table%mass(k), wp), &
                          inertia=real(table%inertia(k), wp))
      end do
   end subroutine list_table

   !> Read and check all data sets; absent ones get their defaults.
   subroutine read_table(file, path, density, table, error)
      type(hdf5_file_t), intent(inout) :: file
      character(len=*), intent(in) :: path
      real(dp), intent(in) :: density
      type(table_t), intent(out) :: table
      type(error_t), allocatable, intent(inout) :: error

      call read_polygons(file, path, table, error)
      call read_flags(file, path, table, error)
      call read_identifiers(file, path, table, error)
      call read_velocity(file, path, table, error)
      call read_column(file, path, 'angular_velocity', table, 0.0_dp, -huge(1.0_dp), &
                       table%angular_velocity, error)
      call read_column(file, path, 'density', table, density, tiny(1.0_dp), table%density, error)
      call read_column(file, path, 'mass', table, 0.0_dp, 0.0_dp, table%mass, error)
      call read_column(file, path, 'inertia', table, 0.0_dp, 0.0_dp, table%inertia, error)
   end subroutine read_table

   !> Read the vertices and their distribution over bodies. Check that every body has at least one.
   subroutine read_polygons(file, path, table, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: path
      type(table_t), intent(inout) :: table
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, n_vertices

      call file%read('vertex_start', table%vertex_start, error)
      if (allocated(error)) return
      table%n = size(table%vertex_start, kind=ip) - 1_ip
      if (table%n < 1_ip) then
         call raise(error, input_error, path//': vertex_start must have n + 1 entries for n bodies, with n '// &
                    'at least 1')
         return
      end if
      call file%read('vertex', table%vertex, error)
      if (allocated(error)) return
      n_vertices = size(table%vertex, 2, kind=ip)
      if (size(table%vertex, 1) /= 2) then
         call raise(error, input_error, path//': vertex must have two columns, x and y (shape in h5py: (n, 2))')
      else if (table%vertex_start(1) /= 0_ip) then
         call raise(error, input_error, path//': '//entry_text('vertex_start', 1_ip)//' is ' &
                    //to_text(table%vertex_start(1))//', but must be 0')
      else if (table%vertex_start(table%n + 1_ip) /= n_vertices) then
         call raise(error, input_error, path//': '//entry_text('vertex_start', table%n + 1_ip)//' is ' &
                    //to_text(table%vertex_start(table%n + 1_ip))//', but vertex has ' &
                    //to_text(n_vertices)//' rows')
      end if
      do k = 1_ip, table%n
         if (allocated(error)) return
         if (table%vertex_start(k + 1_ip) <= table%vertex_start(k)) then
            call raise(error, input_error, path//': '//entry_text('vertex_start', k + 1_ip)// &
                       ' must be greater than the entry before it')
         end if
      end do
   end subroutine read_polygons

   !> Read the flags of fixed bodies.
   subroutine read_flags(file, path, table, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: path
      type(table_t), intent(inout) :: table
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k

      if (allocated(error)) return
      call file%read('fixed', table%fixed, error)
      if (allocated(error)) return
      call check_length(path, 'fixed', size(table%fixed, kind=ip), table%n, error)
      do k = 1_ip, size(table%fixed, kind=ip)
         if (allocated(error)) return
         if (any(table%fixed(k) == [0_ip, 1_ip])) cycle
         call raise(error, input_error, path//': '//entry_text('fixed', k)//' is ' &
                    //to_text(table%fixed(k))//', but must be 0 or 1')
      end do
   end subroutine read_flags

   !> Read the identifiers; number the bodies from 1 if the data set is absent.
   subroutine read_identifiers(file, path, table, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: path
      type(table_t), intent(inout) :: table
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: key(:), spare_key(:)
      integer(ip), allocatable :: order(:), spare(:)
      integer(ip) :: k

      if (allocated(error)) return
      allocate (order(table%n))
      do k = 1_ip, table%n
         order(k) = k
      end do
      if (.not. file%has('id')) then
         table%id = order
         return
      end if
      call file%read('id', table%id, error)
      if (allocated(error)) return
      call check_length(path, 'id', size(table%id, kind=ip), table%n, error)
      if (allocated(error)) return
      key = int(table%id, lp)
      allocate (spare_key(table%n), spare(table%n))
      call sort_keys(table%n, key, order, spare_key, spare)
      do k = 1_ip, table%n
         if (allocated(error)) return
         if (key(k) < 0_lp) then
            call raise(error, input_error, path//': '//entry_text('id', order(k))//' is '//to_text(key(k))// &
                       ', but must not be negative')
         else if (key(k) == key(max(k - 1_ip, 1_ip)) .and. k > 1_ip) then
            call raise(error, input_error, path//': '//entry_text('id', order(k))//' is '//to_text(key(k))// &
                       ', the same as '//entry_text('id', order(k - 1_ip))//'; identifiers must be unique')
         end if
      end do
   end subroutine read_identifiers

   !> Read the velocities; default: zero.
   subroutine read_velocity(file, path, table, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: path
      type(table_t), intent(inout) :: table
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k

      if (allocated(error)) return
      if (.not. file%has('velocity')) then
         allocate (table%velocity(2, table%n), source=0.0_dp)
         return
      end if
      call file%read('velocity', table%velocity, error)
      if (allocated(error)) return
      if (size(table%velocity, 1) /= 2) then
         call raise(error, input_error, path//': velocity must have two columns, x and y (shape in h5py: (n, 2))')
      end if
      call check_length(path, 'velocity', size(table%velocity, 2, kind=ip), table%n, error)
      do k = 1_ip, size(table%velocity, 2, kind=ip)
         if (allocated(error)) return
         if (all(ieee_is_finite(table%velocity(:, k)))) cycle
         call raise(error, input_error, path//': '//entry_text('velocity', k)//' is not finite')
      end do
   end subroutine read_velocity

   !> Read one finite number per body, not below a lower bound. An absent data set yields the default.
   subroutine read_column(file, path, name, table, default, least, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: path, name
      type(table_t), intent(in) :: table
      real(dp), intent(in) :: default, least
      real(dp), allocatable, intent(out) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k

      if (allocated(error)) return
      if (.not. file%has(name)) then
         allocate (values(table%n), source=default)
         return
      end if
      call file%read(name, values, error)
      if (allocated(error)) return
      call check_length(path, name, size(values, kind=ip), table%n, error)
      do k = 1_ip, size(values, kind=ip)
         if (allocated(error)) return
         if (.not. ieee_is_finite(values(k))) then
            call raise(error, input_error, path//': '//entry_text(name, k)//' is not finite')
         else if (values(k) < least) then
            call raise(error, input_error, path//': '//entry_text(name, k)//' is '// &
                       to_text(real(values(k), wp))//', but must '//bound_text(least))
         else if (least >= 0.0_dp .and. values(k) > 0.0_dp .and. real(values(k), wp) < tiny(1.0_wp)) then
            call raise(error, input_error, path//': '//entry_text(name, k)//' of body '//to_text(table%id(k))// &
                       ' is positive, but below the smallest normal number of the working precision')
         end if
      end do
   end subroutine read_column

   !> Check that a data set has one row per body.
   pure subroutine check_length(path, name, length, n, error)
      character(len=*), intent(in) :: path, name
      integer(ip), intent(in) :: length, n
      type(error_t), allocatable, intent(inout) :: error

      if (length == n) return
      call raise(error, input_error, path//': '//name//' has '//to_text(length)//' rows, but '// &
                 'vertex_start defines '//to_text(n)//' bodies')
   end subroutine check_length

   !> Name of an entry in Python notation, counted from 0
   pure function entry_text(name, k) result(text)
      character(len=*), intent(in) :: name
      integer(ip), intent(in) :: k
      character(len=:), allocatable :: text

      text = name//'['//to_text(k - 1_ip)//']'
   end function entry_text

   !> Text of a lower bound for an error message
   pure function bound_text(least) result(text)
      real(dp), intent(in) :: least
      character(len=:), allocatable :: text

      text = 'not be negative'
      if (least > 0.0_dp) text = 'be positive'
   end function bound_text

end module polydem_bodies_reader
