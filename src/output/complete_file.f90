!> Files that are there whole or not at all: written under another name, brought to disk, renamed. They may be sealed.
!>
!> A file that several processes write is begun by the leader, who writes its texts; then the others join. All close it,
!> and the leader does the rest.
module polydem_complete_file
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: ip, lp
   use polydem_paths, only: exists, remove_file, rename_file, reserve_room, sync_file
   use polydem_result_folder, only: unfinished
   use polydem_sealed_file, only: seal_file, seal_length
   use polydem_team, only: team_t
   implicit none
   private
   public :: begin_file, share_file, keep_room, complete_file, discard_file, check_whole

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

   !> Let all processes write to a file that the leader has created; collective.
   subroutine share_file(team, file, path, room, error)
      !> Processes; if there is one only, nothing happens
      class(team_t), intent(inout) :: team
      !> The file, open at the leader
      type(hdf5_file_t), intent(inout) :: file
      !> Its present name
      character(len=*), intent(in) :: path
      !> Room to reserve for what they are going to write, as `keep_room` does [B]
      integer(lp), intent(in) :: room
      !> Why it cannot be written; afterwards the same on all processes
      type(error_t), allocatable, intent(inout) :: error

      if (team%size == 1_ip) return
      if (team%leads() .and. .not. allocated(error)) call file%close(error)
      call keep_room(team, path, room, error)
      if (.not. allocated(error)) call file%join(path, error)
   end subroutine share_file

   !> Reserve room for what processes are going to write together; collective. So a full disk is found before, and the
   !> run ends in order; a process that finds it full while all write can only end all at once.
   subroutine keep_room(team, path, bytes, error)
      !> Processes; if there is one only, nothing happens
      class(team_t), intent(inout) :: team
      !> Present name of the file
      character(len=*), intent(in) :: path
      !> By how much it may get longer [B]
      integer(lp), intent(in) :: bytes
      !> Why it cannot be written; afterwards the same on all processes
      type(error_t), allocatable, intent(inout) :: error

      if (team%size == 1_ip) return
      if (team%leads() .and. .not. allocated(error)) call reserve_room(path, bytes, error)
      call team%agree(error)
   end subroutine keep_room

   !> Close the file and give it its name; after a failure it is removed instead.
   subroutine complete_file(file, path, error, sealed, team)
      !> File of `begin_file`
      type(hdf5_file_t), intent(inout) :: file
      !> Its name once it is complete
      character(len=*), intent(in) :: path
      !> Why the file could not be written; or why it cannot be completed
      type(error_t), allocatable, intent(inout) :: error
      !> Whether it gets a seal, as told to `begin_file`; no if absent
      logical, intent(in), optional :: sealed
      !> Processes that wrote it together, all of which must call; if absent, this one did alone
      class(team_t), intent(inout), optional :: team
      logical :: leads

      leads = .true.
      if (present(team)) leads = team%leads()
      if (allocated(error)) call file%abandon(error)
      call file%close(error)
      if (leads) call name_file(path, error, sealed)
      if (present(team)) call team%agree(error)
   end subroutine complete_file

   !> Give a closed file its name, or remove it after a failure.
   subroutine name_file(path, error, sealed)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in), optional :: sealed
      type(error_t), allocatable :: ignored

      if (present(sealed) .and. .not. allocated(error)) then
         if (sealed) call seal_file(path//unfinished, error)
      end if
      if (.not. allocated(error)) call sync_file(path//unfinished, error)
      if (.not. allocated(error)) call check_whole(path//unfinished, error)
      if (.not. allocated(error)) call rename_file(path//unfinished, path, error)
      if (.not. allocated(error)) call sync_file(folder_of(path), error)
      if (exists(path//unfinished)) call remove_file(path//unfinished, ignored)
   end subroutine name_file

   !> See to it that a closed file is as long as HDF5 made it, before it replaces one that is.
   subroutine check_whole(path, error)
      !> Its present name
      character(len=*), intent(in) :: path
      !> Allocated if HDF5 cannot open it, as if it is shorter
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      call file%open(path, error)
      call file%close(error)
   end subroutine check_whole

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
