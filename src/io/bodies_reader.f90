!> Reads bodies from an HDF5 file. Packings of other programs can thus serve as scenes.
!>
!> Data sets for n bodies with nv vertices in total; shapes as h5py shows them:
!>
!>     vertex            (nv, 2)  vertices in world coordinates, body after body [m]
!>     vertex_start      (n + 1)  first vertex of each body, counted from 0; the last entry is nv
!>     piece             (nv)     optional: number of the piece of each vertex within its body, from 0; the vertices of
!>                                a body of several convex pieces are those of its pieces, one after the other
!>     fixed             (n)      1 for a fixed body, 0 for a free one
!>     velocity          (n, 2)   optional, of the centre of mass [m/s]
!>     angular_velocity  (n)      optional [rad/s]
!>     density           (n)      optional, default: density of the namelist [kg/m3]
!>     mass, inertia     (n)      optional [kg/m, kg m]; 0 or absent: computed from the polygon for a
!>                                free body, infinite for a fixed body
!>     id                (n)      optional, default: 1 to n
!>     material          (n)      optional, position in material_names, from 1; 0: none
!>     material_names    ()       names of groups &material, separated by blanks; needed if material has not only 0
!>
!> Any other data set at the top level is an error, because it may be a misspelt name. Groups are ignored. The
!> attributes origin_x and origin_y of the file, if there are any, are where the origin of its coordinates lies in
!> those of the program that made the polygons [m]; a run does not use them, but copies them to its result.
module polydem_bodies_reader
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use polydem_bodies_index, only: bodies_index_t, entry_text, known_materials_t, read_index, read_materials
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_strings, only: to_text
   implicit none
   private
   public :: known_materials_t, read_bodies_file, read_origin

   !> Number of bodies that are read together
   integer(ip), parameter :: block_size = 16384_ip

   !> A block of consecutive bodies, with defaults filled in and checked
   type :: block_t
      !> First and last body
      integer(ip) :: first, last
      !> Vertices in world coordinates, (2, vertex) [m]
      real(dp), allocatable :: vertex(:, :)
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
   end type block_t

contains

   !> Append the bodies of a file to a list. They are read block by block: beyond what the list keeps, this takes memory
   !> for a block and some 40 bytes per body of the file.
   subroutine read_bodies_file(path, density, list, error, materials)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Density of the bodies if the file has no data set `density` [kg/m3]
      real(wp), intent(in) :: density
      type(body_list_t), intent(inout) :: list
      !> Names the file, the data set and the body
      type(error_t), allocatable, intent(inout) :: error
      !> Materials of the run; if absent, those of the file are not read
      type(known_materials_t), intent(in), optional :: materials
      type(hdf5_file_t) :: file
      type(bodies_index_t) :: table
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
      call read_index(file, table, error)
      if (.not. allocated(error) .and. present(materials)) call read_materials(file, materials, table, error)
      if (.not. allocated(error)) call list_blocks(file, real(density, dp), table, list, error, materials)
      call file%close(error)
   end subroutine read_bodies_file

   !> Read where the origin of the coordinates of a bodies file lies in those of the program that made the polygons.
   subroutine read_origin(path, origin, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Place of the origin, 0 if the file does not have it, (2) [m]
      real(dp), intent(out) :: origin(2)
      !> Names the file and the attribute
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      origin = 0.0_dp
      if (allocated(error)) return
      call file%open(path, error)
      if (allocated(error)) return
      call file%read_real_attribute('/', 'origin_x', origin(1), error)
      call file%read_real_attribute('/', 'origin_y', origin(2), error)
      if (.not. all(ieee_is_finite(origin))) call file%reject('origin_x and origin_y must be finite', error)
      call file%close(error)
   end subroutine read_origin

   !> Append the bodies of the file to a list, block by block.
   subroutine list_blocks(file, density, table, list, error, materials)
      type(hdf5_file_t), intent(in) :: file
      real(dp), intent(in) :: density
      type(bodies_index_t), intent(in) :: table
      type(body_list_t), intent(inout) :: list
      type(error_t), allocatable, intent(inout) :: error
      type(known_materials_t), intent(in), optional :: materials
      type(block_t) :: block
      integer(lp) :: rows(2)
      integer(ip) :: k, v, w

      do k = 1_ip, table%n, block_size
         block%first = k
         block%last = min(k + block_size - 1_ip, table%n)
         rows = int([k - 1_ip, block%last - k + 1_ip], lp)
         v = table%vertex_start(block%first)
         w = table%vertex_start(block%last + 1_ip)
         call file%read('vertex', block%vertex, error, rows=int([v, w - v], lp))
         call read_velocity(file, rows, block%velocity, error)
         call read_column(file, 'angular_velocity', table, rows, 0.0_dp, -huge(1.0_dp), block%angular_velocity, &
                          error)
         call read_column(file, 'density', table, rows, density, tiny(1.0_dp), block%density, error)
         call read_column(file, 'mass', table, rows, 0.0_dp, 0.0_dp, block%mass, error)
         call read_column(file, 'inertia', table, rows, 0.0_dp, 0.0_dp, block%inertia, error)
         if (allocated(error)) return
         if (present(materials)) then
            if (.not. file%has('density', error)) call take_densities(materials, table, block)
         end if
         if (allocated(error)) return
         call list_block(table, block, list)
      end do
   end subroutine list_blocks

   !> Give the bodies of a block the densities of their materials.
   pure subroutine take_densities(materials, table, block)
      type(known_materials_t), intent(in) :: materials
      type(bodies_index_t), intent(in) :: table
      type(block_t), intent(inout) :: block
      integer(ip) :: k, m

      do k = 1_ip, size(block%density, kind=ip)
         m = table%material(block%first + k - 1_ip)
         if (m > 0_ip) block%density(k) = real(materials%density(m), dp)
      end do
   end subroutine take_densities

   !> Append the bodies of a block to a list.
   subroutine list_block(table, block, list)
      type(bodies_index_t), intent(in) :: table
      type(block_t), intent(in) :: block
      type(body_list_t), intent(inout) :: list
      integer(ip) :: k, material, s, first, last

      material = 0_ip
      do k = 1_ip, block%last - block%first + 1_ip
         s = block%first + k - 1_ip
         first = table%vertex_start(s) - table%vertex_start(block%first) + 1_ip
         last = table%vertex_start(s + 1_ip) - table%vertex_start(block%first)
         if (allocated(table%material)) material = table%material(s)
         call list%append(real(block%vertex(:, first:last), wp), &
                          fixed=table%fixed(s) == 1_ip, &
                          density=real(block%density(k), wp), &
                          velocity=real(block%velocity(:, k), wp), &
                          angular_velocity=real(block%angular_velocity(k), wp), &
                          id=table%id(s), &
                          masses=real([block%mass(k), block%inertia(k)], wp), &
                          material=material, &
                          piece=pieces_of(table, s))
      end do
   end subroutine list_block

   !> Numbers of the pieces of the vertices of a body
   pure function pieces_of(table, s) result(piece)
      type(bodies_index_t), intent(in) :: table
      !> Number of the body
      integer(ip), intent(in) :: s
      integer(ip) :: piece(table%vertex_start(s + 1_ip) - table%vertex_start(s))

      piece = 0_ip
      if (allocated(table%piece)) piece = table%piece(table%vertex_start(s) + 1_ip:table%vertex_start(s + 1_ip))
   end function pieces_of

   !> Read the velocities of a block; default: zero.
   subroutine read_velocity(file, rows, velocity, error)
      type(hdf5_file_t), intent(in) :: file
      !> Number of rows before the block, and number of its rows
      integer(lp), intent(in) :: rows(2)
      real(dp), allocatable, intent(inout) :: velocity(:, :)
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k

      if (allocated(error)) return
      if (.not. file%has('velocity', error)) then
         velocity = spread([0.0_dp, 0.0_dp], 2, int(rows(2)))
         return
      end if
      call file%read('velocity', velocity, error, rows=rows)
      if (allocated(error)) return
      do k = 1_ip, size(velocity, 2, kind=ip)
         if (allocated(error)) return
         if (all(ieee_is_finite(velocity(:, k)))) cycle
         call file%reject(entry_text('velocity', int(rows(1), ip) + k)//' is not finite', error)
      end do
   end subroutine read_velocity

   !> Read one finite number per body of a block, not below a lower bound. An absent data set yields the default.
   subroutine read_column(file, name, table, rows, default, least, values, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name
      type(bodies_index_t), intent(in) :: table
      integer(lp), intent(in) :: rows(2)
      real(dp), intent(in) :: default, least
      real(dp), allocatable, intent(inout) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, s

      if (allocated(error)) return
      if (.not. file%has(name, error)) then
         values = spread(default, 1, int(rows(2)))
         return
      end if
      call file%read(name, values, error, rows=rows)
      if (allocated(error)) return
      do k = 1_ip, size(values, kind=ip)
         if (allocated(error)) return
         s = int(rows(1), ip) + k
         if (.not. ieee_is_finite(values(k))) then
            call file%reject(entry_text(name, s)//' is not finite', error)
         else if (values(k) < least) then
            call file%reject(entry_text(name, s)//' is '//to_text(real(values(k), wp))//', but must '// &
                             bound_text(least), error)
         else if (least >= 0.0_dp .and. values(k) > 0.0_dp .and. real(values(k), wp) < tiny(1.0_wp)) then
            call file%reject(entry_text(name, s)//' of body '//to_text(table%id(s))// &
                             ' is positive, but below the smallest normal number of the working precision', error)
         end if
      end do
   end subroutine read_column

   !> Text of a lower bound for an error message
   pure function bound_text(least) result(text)
      real(dp), intent(in) :: least
      character(len=:), allocatable :: text

      text = 'not be negative'
      if (least > 0.0_dp) text = 'be positive'
   end function bound_text

end module polydem_bodies_reader
