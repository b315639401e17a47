!> Atomic files: a file is either complete or absent. It is written under a temporary name (NAME.unfinished), flushed to
!> disk and renamed. A checksum may be appended.
!>
!> The root rank creates a file of several ranks and writes its text; then the other ranks open it. All ranks close the
!> file. The root rank then appends the checksum, flushes and renames.
module polydem_atomic_file
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_file_checksum, only: append_checksum, checksum_length
   use polydem_file_system, only: exists, folder_of, remove_file, release_space, rename_file, reserve_space, sync_file
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: ip, lp
   use polydem_result_files, only: unfinished
   implicit none
   private
   public :: begin_file, open_on_all_ranks, reserve_on_all_ranks, complete_file, discard_file, give_final_name

contains

   !> Create the file under its temporary name.
   subroutine begin_file(file, path, error, compressed, with_checksum)
      !> File to create
      type(hdf5_file_t), intent(inout) :: file
      !> Final path of the file
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      !> Whether growing data sets are compressed; default: false
      logical, intent(in), optional :: compressed
      !> Whether space is reserved for a checksum; default: false
      logical, intent(in), optional :: with_checksum
      integer(ip) :: room

      room = 0_ip
      if (present(with_checksum)) room = merge(checksum_length, 0_ip, with_checksum)
      call file%create(path//unfinished, error, compressed, room)
   end subroutine begin_file

   !> Open on all ranks a file that the root rank has created; collective.
   subroutine open_on_all_ranks(comm, file, path, room, error)
      !> Communicator; with a single rank the call is a no-op
      class(communicator_t), intent(inout) :: comm
      !> The file, open on the root rank
      type(hdf5_file_t), intent(inout) :: file
      !> Current path of the file
      character(len=*), intent(in) :: path
      !> Disk space to reserve for the data of all ranks; see `reserve_on_all_ranks` [B]
      integer(lp), intent(in) :: room
      !> Reason why the file cannot be written; on return the same on all ranks
      type(error_t), allocatable, intent(inout) :: error

      if (comm%size == 1_ip) return
      if (comm%is_root() .and. .not. allocated(error)) call file%close(error)
      call reserve_on_all_ranks(comm, path, room, error)
      if (.not. allocated(error)) call file%join(path, error)
   end subroutine open_on_all_ranks

   !> Reserve disk space for the next collective write; collective. A full disk is then detected before the write, and
   !> the run ends in an orderly way. A rank that meets a full disk during a collective write can only abort all ranks.
   subroutine reserve_on_all_ranks(comm, path, bytes, error)
      !> Communicator; with a single rank the call is a no-op
      class(communicator_t), intent(inout) :: comm
      !> Current path of the file
      character(len=*), intent(in) :: path
      !> Upper bound of the growth of the file [B]
      integer(lp), intent(in) :: bytes
      !> Reason why the file cannot be written; on return the same on all ranks
      type(error_t), allocatable, intent(inout) :: error

      if (comm%size == 1_ip) return
      if (comm%is_root() .and. .not. allocated(error)) call reserve_space(path, bytes, error)
      call comm%all_reduce_error(error)
   end subroutine reserve_on_all_ranks

   !> Close the file and rename it to its final path; after a failure remove it instead.
   subroutine complete_file(file, path, error, with_checksum, comm)
      !> File of `begin_file`
      type(hdf5_file_t), intent(inout) :: file
      !> Final path of the file
      character(len=*), intent(in) :: path
      !> On entry an earlier write error, if any; on return the reason why there is no complete file
      type(error_t), allocatable, intent(inout) :: error
      !> Whether a checksum is appended; same value as for `begin_file`; default: false
      logical, intent(in), optional :: with_checksum
      !> Communicator of the ranks that wrote the file; all of them must call. Absent: this rank wrote it alone
      class(communicator_t), intent(inout), optional :: comm
      logical :: is_root

      is_root = .true.
      if (present(comm)) is_root = comm%is_root()
      if (allocated(error)) call file%abandon(error)
      call file%close(error)
      if (is_root) call name_file(path, error, with_checksum)
      if (present(comm)) call comm%all_reduce_error(error)
   end subroutine complete_file

   !> Rename a closed file to its final path, or remove it after a failure.
   subroutine name_file(path, error, with_checksum)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in), optional :: with_checksum
      type(error_t), allocatable :: ignored

      if (present(with_checksum) .and. .not. allocated(error)) then
         if (with_checksum) call append_checksum(path//unfinished, error)
      end if
      call give_final_name(path//unfinished, path, error)
      if (exists(path//unfinished)) call remove_file(path//unfinished, ignored)
   end subroutine name_file

   !> Flush a closed file to disk and rename it. Its length must be that which HDF5 recorded, so that a truncated file
   !> never replaces a complete one. Nothing happens after a failure.
   subroutine give_final_name(from, to, error)
      !> Current path of the file
      character(len=*), intent(in) :: from
      !> Final path in the same folder
      character(len=*), intent(in) :: to
      !> Allocated if the file is truncated, or cannot be flushed or renamed
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      if (.not. allocated(error)) call release_space(from, error)
      if (.not. allocated(error)) call sync_file(from, error)
      if (.not. allocated(error)) call file%open(from, error)
      call file%close(error)
      if (.not. allocated(error)) call rename_file(from, to, error)
      if (.not. allocated(error)) call sync_file(folder_of(to), error)
   end subroutine give_final_name

   !> Close the file and remove it.
   subroutine discard_file(file, path, error)
      !> File of `begin_file`
      type(hdf5_file_t), intent(inout) :: file
      !> Final path that the file would have had
      character(len=*), intent(in) :: path
      !> Allocated if the file cannot be removed
      type(error_t), allocatable, intent(inout) :: error

      call file%close(error)
      if (exists(path//unfinished)) call remove_file(path//unfinished, error)
   end subroutine discard_file

end module polydem_atomic_file
