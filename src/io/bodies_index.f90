!> What must be known of all bodies of a bodies file at once: data sets and their shapes, vertices per body, which
!> bodies are fixed, identifiers.
module polydem_bodies_index
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_hdf5_members, only: count_names, is_dataset, read_name
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_sort, only: ascending_order
   use polydem_strings, only: to_text, quoted, split_words, suggestion, text_t
   implicit none
   private
   public :: bodies_index_t, known_materials_t, read_index, read_materials, entry_text

   !> Data sets that a bodies file may have
   character(len=*), parameter :: known_names(12) = [character(len=16) :: 'vertex', 'vertex_start', 'fixed', &
      'velocity', 'angular_velocity', 'density', 'mass', 'inertia', 'id', 'material', 'material_names', 'piece']
   !> Those that may be absent and have a number per body, or two
   character(len=*), parameter :: optional_columns(5) = known_names(4:8)

   !> Greatest number of vertices of all bodies, of which half the range of integers can count
   integer(lp), parameter :: most_vertices = 2_lp**30

   !> What is known of all bodies of the file, checked
   type :: bodies_index_t
      !> Number of bodies
      integer(ip) :: n = 0_ip
      !> First vertex of each body, counted from 0, and the number of vertices, (n + 1)
      integer(ip), allocatable :: vertex_start(:)
      !> 1: fixed body, 0: free body, (body)
      integer(ip), allocatable :: fixed(:)
      !> Identifiers, (body)
      integer(ip), allocatable :: id(:)
      !> Number of the piece of each vertex within its body, from 0; not allocated if every body has one piece, (vertex)
      integer(ip), allocatable :: piece(:)
      !> Numbers of the materials of the run, (body)
      integer(ip), allocatable :: material(:)
   end type bodies_index_t

   !> Materials of the run for which bodies are read
   type :: known_materials_t
      !> Their names
      type(text_t), allocatable :: names(:)
      !> Their densities [kg/m3]
      real(wp), allocatable :: density(:)
      !> Number of the material of free and of fixed bodies without a material of their own
      integer(ip) :: of_free = 0_ip, of_fixed = 0_ip
   end type known_materials_t

contains

   !> Read and check what is needed of all bodies at once, and the shapes of all data sets.
   subroutine read_index(file, table, error)
      type(hdf5_file_t), intent(in) :: file
      !> What is known of all bodies
      type(bodies_index_t), intent(out) :: table
      !> Names the file, the data set and the entry
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: n_vertices
      integer :: k

      call check_names(file, error)
      call count_points(file, 'vertex', n_vertices, error)
      call check_number(file, n_vertices, error)
      call file%read('vertex_start', table%vertex_start, error)
      if (allocated(error)) return
      table%n = size(table%vertex_start, kind=ip) - 1_ip
      call check_starts(file, table, n_vertices, error)
      call read_pieces(file, table, error)
      call read_flags(file, table, error)
      call read_identifiers(file, table, error)
      do k = 1, size(optional_columns)
         call check_rows(file, trim(optional_columns(k)), table%n, error)
      end do
   end subroutine read_index

   !> Reject data sets with unknown names, and groups or links with the name of a data set.
   subroutine check_names(file, error)
      type(hdf5_file_t), intent(in) :: file
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      logical :: holds_values
      integer :: k, n

      call count_names(file%location_of('/'), n, error)
      do k = 1, n
         call read_name(file%location_of('/'), k, name, error)
         if (allocated(error)) return
         holds_values = is_dataset(file%location_of(name), error)
         if (allocated(error)) return
         if (any(known_names == name) .eqv. holds_values) cycle
         if (any(known_names == name)) then
            call file%reject(name//' must be a data set, but is a group or a link', error)
         else
            call file%reject('unknown data set '//quoted(name)//suggestion(name, known_names), error)
         end if
         return
      end do
   end subroutine check_names

   !> Count the rows of a data set with the columns x and y.
   subroutine count_points(file, name, n_rows, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name
      integer(lp), intent(out) :: n_rows
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: extent(:)
      real(dp), allocatable :: unread(:, :)

      n_rows = 0_lp
      call file%shape_of(name, extent, error)
      if (allocated(error)) return
      if (size(extent) /= 2) then
         ! The reader refuses another number of dimensions before it reads anything.
         call file%read(name, unread, error)
      else if (extent(2) /= 2_lp) then
         call file%reject(name//' must have two columns, x and y (shape in h5py: (n, 2))', error)
      else
         n_rows = extent(1)
      end if
   end subroutine count_points

   !> Check the number of bodies before their data are read: each has a vertex. A compressed file may claim many.
   subroutine check_number(file, n_vertices, error)
      type(hdf5_file_t), intent(in) :: file
      integer(lp), intent(in) :: n_vertices
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: extent(:)

      call file%shape_of('vertex_start', extent, error)
      if (allocated(error)) return
      ! The reader refuses another number of dimensions before it reads anything.
      if (size(extent) /= 1) return
      if (extent(1) < 2_lp) then
         call file%reject('vertex_start must have n + 1 entries for n bodies, with n at least 1', error)
      else if (extent(1) - 1_lp > n_vertices) then
         call file%reject('vertex_start defines '//to_text(extent(1) - 1_lp)//' bodies, but vertex has '// &
                          to_text(n_vertices)//' rows', error)
      end if
      call check_rows(file, 'fixed', int(min(extent(1) - 1_lp, int(huge(1_ip), lp)), ip), error)
      call check_rows(file, 'id', int(min(extent(1) - 1_lp, int(huge(1_ip), lp)), ip), error)
      call check_rows(file, 'material', int(min(extent(1) - 1_lp, int(huge(1_ip), lp)), ip), error)
   end subroutine check_number

   !> Check the distribution of the vertices over bodies: every body has at least one.
   pure subroutine check_starts(file, table, n_vertices, error)
      type(hdf5_file_t), intent(in) :: file
      type(bodies_index_t), intent(in) :: table
      integer(lp), intent(in) :: n_vertices
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k

      if (allocated(error)) return
      if (table%vertex_start(1) /= 0_ip) then
         call file%reject(entry_text('vertex_start', 1_ip)//' is '//to_text(table%vertex_start(1))// &
                          ', but must be 0', error)
      else if (table%vertex_start(table%n + 1_ip) /= n_vertices) then
         call file%reject(entry_text('vertex_start', table%n + 1_ip)//' is '// &
                          to_text(table%vertex_start(table%n + 1_ip))//', but vertex has '//to_text(n_vertices)// &
                          ' rows', error)
      else if (n_vertices > most_vertices) then
         call file%reject('vertex has '//to_text(n_vertices)//' rows, but at most 2^30 are allowed', error)
      end if
      do k = 1_ip, table%n
         if (allocated(error)) return
         if (table%vertex_start(k + 1_ip) <= table%vertex_start(k)) then
            call file%reject(entry_text('vertex_start', k + 1_ip)//' must be greater than the entry before it', error)
         end if
      end do
   end subroutine check_starts

   !> Check that a data set, if it is there, has one row per body.
   subroutine check_rows(file, name, n, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name
      integer(ip), intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: extent(:)
      integer(lp) :: n_rows

      if (allocated(error)) return
      if (.not. file%has(name, error)) return
      if (name == 'velocity') then
         call count_points(file, name, n_rows, error)
      else
         call file%shape_of(name, extent, error)
         if (allocated(error)) return
         if (size(extent) /= 1) return
         n_rows = extent(1)
      end if
      if (.not. allocated(error)) call check_length(file, name, n_rows, n, error)
   end subroutine check_rows

   !> Read the numbers of pieces. Within each body they begin with 0 and ascend by steps of 1.
   subroutine read_pieces(file, table, error)
      type(hdf5_file_t), intent(in) :: file
      type(bodies_index_t), intent(inout) :: table
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, v, before

      if (allocated(error)) return
      if (.not. file%has('piece', error)) return
      call file%read('piece', table%piece, error)
      if (allocated(error)) return
      associate (n => table%vertex_start(table%n + 1_ip))
         if (size(table%piece) /= n) then
            call file%reject('piece has '//to_text(size(table%piece))//' rows, but vertex has '//to_text(n), error)
            return
         end if
      end associate
      do k = 1_ip, table%n
         before = 0_ip
         do v = table%vertex_start(k) + 1_ip, table%vertex_start(k + 1_ip)
            if (v == table%vertex_start(k) + 1_ip .and. table%piece(v) == 0_ip) cycle
            if (v > table%vertex_start(k) + 1_ip .and. any(table%piece(v) == [before, before + 1_ip])) then
               before = table%piece(v)
               cycle
            end if
            call file%reject(entry_text('piece', v)//' of body '//to_text(k - 1_ip)//', counted from 0, is '// &
                             to_text(table%piece(v))//'; the pieces of each body are counted from 0 by steps of 1', &
                             error)
            return
         end do
      end do
   end subroutine read_pieces

   !> Read the flags of fixed bodies.
   subroutine read_flags(file, table, error)
      type(hdf5_file_t), intent(in) :: file
      type(bodies_index_t), intent(inout) :: table
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k

      call file%read('fixed', table%fixed, error)
      if (allocated(error)) return
      call check_length(file, 'fixed', size(table%fixed, kind=lp), table%n, error)
      do k = 1_ip, size(table%fixed, kind=ip)
         if (allocated(error)) return
         if (any(table%fixed(k) == [0_ip, 1_ip])) cycle
         call file%reject(entry_text('fixed', k)//' is '//to_text(table%fixed(k))//', but must be 0 or 1', error)
      end do
   end subroutine read_flags

   !> Read the identifiers; number the bodies from 1 if the data set is absent.
   subroutine read_identifiers(file, table, error)
      type(hdf5_file_t), intent(in) :: file
      type(bodies_index_t), intent(inout) :: table
      type(error_t), allocatable, intent(inout) :: error
      integer(ip), allocatable :: order(:)
      integer(ip) :: k

      if (.not. file%has('id', error)) then
         table%id = [(k, k=1_ip, table%n)]
         return
      end if
      call file%read('id', table%id, error)
      if (allocated(error)) return
      call check_length(file, 'id', size(table%id, kind=lp), table%n, error)
      if (allocated(error)) return
      if (table%id(1) >= 0_ip .and. all(table%id(2:) > table%id(:table%n - 1_ip))) return
      order = ascending_order(int(table%id, lp))
      do k = 1_ip, table%n
         if (allocated(error)) return
         associate (id => table%id(order(k)), former => table%id(order(max(k - 1_ip, 1_ip))))
            if (id < 0_ip) then
               call file%reject(entry_text('id', order(k))//' is '//to_text(id)//', but must not be negative', error)
            else if (id == former .and. k > 1_ip) then
               call file%reject(entry_text('id', order(k))//' is '//to_text(id)//', the same as '// &
                                entry_text('id', order(k - 1_ip))//'; identifiers must be unique', error)
            end if
         end associate
      end do
   end subroutine read_identifiers

   !> Read the materials. A number of the file is a position in its list of names, and 0 is none; a number of the run is
   !> a position among its materials.
   subroutine read_materials(file, materials, table, error)
      type(hdf5_file_t), intent(in) :: file
      type(known_materials_t), intent(in) :: materials
      !> Bodies with their flags; the materials are set
      type(bodies_index_t), intent(inout) :: table
      !> Names the body, or a material that the run does not have
      type(error_t), allocatable, intent(inout) :: error
      integer(ip), allocatable :: numbers(:), run_number(:)
      integer(ip) :: k

      table%material = merge(materials%of_fixed, materials%of_free, table%fixed == 1_ip)
      if (.not. file%has('material', error)) return
      call file%read('material', numbers, error)
      if (allocated(error)) return
      call check_length(file, 'material', size(numbers, kind=lp), table%n, error)
      call match_names(file, materials, run_number, error)
      do k = 1_ip, table%n
         if (allocated(error)) return
         if (numbers(k) < 0_ip .or. numbers(k) > size(run_number)) then
            call file%reject(entry_text('material', k)//' is '//to_text(numbers(k))//', but must be between 0 and '// &
                             to_text(size(run_number))//', the number of names in material_names', error)
         else if (numbers(k) > 0_ip) then
            table%material(k) = run_number(numbers(k))
         end if
      end do
   end subroutine read_materials

   !> Find the numbers in the run of the materials that a file names.
   subroutine match_names(file, materials, run_number, error)
      type(hdf5_file_t), intent(in) :: file
      type(known_materials_t), intent(in) :: materials
      !> Number in the run of each name of the file
      integer(ip), allocatable, intent(out) :: run_number(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text, names(:)
      integer :: k, m

      allocate (run_number(0))
      if (.not. file%has('material_names', error)) return
      call file%read('material_names', text, error)
      if (allocated(error)) return
      names = split_words(text)
      do k = 1, size(names)
         do m = size(materials%names), 1, -1
            if (materials%names(m)%text == names(k)) exit
         end do
         run_number = [run_number, int(m, ip)]
         if (m == 0) call file%reject('material_names has '//quoted(trim(names(k)))//', but the namelist has no '// &
                                      '&material of this name', error)
      end do
   end subroutine match_names

   !> Check that a data set has one row per body.
   pure subroutine check_length(file, name, length, n, error)
      type(hdf5_file_t), intent(in) :: file
      character(len=*), intent(in) :: name
      integer(lp), intent(in) :: length
      integer(ip), intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error

      if (length == n) return
      call file%reject(name//' has '//to_text(length)//' rows, but vertex_start defines '//to_text(n)//' bodies', error)
   end subroutine check_length

   !> Name of an entry in Python notation, counted from 0
   pure function entry_text(name, k) result(text)
      !> Name of the data set
      character(len=*), intent(in) :: name
      !> Number of the entry, counted from 1
      integer(ip), intent(in) :: k
      character(len=:), allocatable :: text

      text = name//'['//to_text(k - 1_ip)//']'
   end function entry_text

end module polydem_bodies_index
