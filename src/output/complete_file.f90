!> Files that are there whole or not at all: written under another name, brought to disk, renamed. They may be sealed.
module polydem_complete_file
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: ip
   use polydem_paths, only: exists, remove_file, rename_file, sync_file
   use polydem_result_folder, only: unfinished
   use polydem_sealed_file, only: seal_file, seal_length
   implicit none
   private
   public :: begin_file, complete_file, discard_file

contains

   !> Create the file under its unfinished name.
   subroutine begin_file(file, path, error, compressed, sealed)
      !> File to create
      type(hdf5_file_t), intent(inout) :: file
      !> Its name once it is complete
      character(len=*), intent(in) :: path
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      !> Whether growing data sets are compressed; no if absent
      logical, intent(in), optional :: compressed
      !> Whether room is left for a seal; no if absent
      logical, intent(in), optional :: sealed
      integer(ip) :: room

      room = 0_ip
      if (present(sealed)) room = merge(seal_length, 0_ip, sealed)
      call file%create(path//unfinished, error, compressed, room)
   end subroutine begin_file

   !> Close the file and give it its name; after a failure it is removed instead.
   subroutine complete_file(file, path, error, sealed)
      !> File of `begin_file`
      type(hdf5_file_t), intent(inout) :: file
      !> Its name once it is complete
      character(len=*), intent(in) :: path
      !> Why the file could not be written; or why it cannot be completed
      type(error_t), allocatable, intent(inout) :: error
      !> Whether it gets a seal, as told to `begin_file`; no if absent
      logical, intent(in), optional :: sealed
      type(error_t), allocatable :: ignored

      if (allocated(error)) call file%abandon(error)
      call file%close(error)
      if (present(sealed) .and. .not. allocated(error)) then
         if (sealed) call seal_file(path//unfinished, error)
      end if
      if (.not. allocated(error)) call sync_file(path//unfinished, error)
      if (.not. allocated(error)) call rename_file(path//unfinished, path, error)
      if (.not. allocated(error)) call sync_file(folder_of(path), error)
      if (exists(path//unfinished)) call remove_file(path//unfinished, ignored)
   end subroutine complete_file

   !> Close the file and remove it.
   subroutine discard_file(file, path, error)
      !> File of `begin_file`
      type(hdf5_file_t), intent(inout) :: file
      !> The name it would have got
      character(len=*), intent(in) :: path
      !> Allocated if it cannot be removed
      type(error_t), allocatable, intent(inout) :: error

      call file%close(error)
      if (exists(path//unfinished)) call remove_file(path//unfinished, error)
   end subroutine discard_file

   pure function folder_of(path) result(folder)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: folder
      integer :: slash

      slash = index(path, '/', back=.true.)
      folder = '.'
      if (slash > 0) folder = path(:slash)
   end function folder_of

end module polydem_complete_file
