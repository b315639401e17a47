!> Bodies of a checkpoint that belong to walls that were removed. A run that starts from it is without them: its bodies
!> are numbered without gaps, and have other rows in the file.
module polydem_removed_bodies
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: ip, lp
   use polydem_sort, only: place_in
   use polydem_wall, only: wall_t
   use polydem_wall_names, only: find_wall_names
   implicit none
   private
   public :: find_removed_rows, rows_of

contains

   !> Find the rows of the bodies of walls that were removed.
   subroutine find_removed_rows(path, rows, error)
      !> Path of the checkpoint
      character(len=*), intent(in) :: path
      !> Rows of /bodies, ascending; none if no wall was removed
      integer(ip), allocatable, intent(out) :: rows(:)
      !> Names the file and what is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      type(wall_t), allocatable :: walls(:)
      integer(ip), allocatable :: flags(:), id(:)
      logical, allocatable :: is_removed(:)
      integer(ip) :: j, k, row

      allocate (rows(0))
      call file%open(path, error)
      if (allocated(error)) return
      if (file%has('/run/gone', error)) call file%read('/run/gone', flags, error)
      if (.not. allocated(flags)) allocate (flags(0))
      if (any(flags == 1_ip)) call file%read('/bodies/id', id, error)
      call file%close(error)
      if (allocated(error) .or. all(flags /= 1_ip)) return
      call find_wall_names(path, walls, error)
      if (size(walls) /= size(flags)) call raise(error, input_error, path// &
         ': /run/gone and /provenance/walls have different numbers of walls')
      if (allocated(error)) return
      is_removed = spread(.false., 1, size(id))
      do k = 1_ip, size(walls, kind=ip)
         if (flags(k) /= 1_ip) cycle
         do j = 1_ip, size(walls(k)%id, kind=ip)
            row = place_in(id, walls(k)%id(j))
            if (row > size(id)) cycle
            is_removed(row) = is_removed(row) .or. id(row) == walls(k)%id(j)
         end do
      end do
      rows = pack([(row, row=1_ip, size(id, kind=ip))], is_removed)
   end subroutine find_removed_rows

   !> Rows of bodies in a checkpoint, (body)
   pure function rows_of(global_index, removed) result(rows)
      !> Indices of the bodies among all that were not removed
      integer(ip), intent(in) :: global_index(:)
      !> Rows of those that have, ascending
      integer(ip), intent(in) :: removed(:)
      integer(lp) :: rows(size(global_index))
      integer(ip) :: before(size(removed)), k

      ! Number of bodies that are there before each of those that are not
      before = [(removed(k) - k, k=1_ip, size(removed, kind=ip))]
      do k = 1_ip, size(global_index, kind=ip)
         rows(k) = int(global_index(k) + place_in(before, global_index(k)) - 1_ip, lp)
      end do
   end function rows_of

end module polydem_removed_bodies
