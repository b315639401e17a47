!> The trajectory of a run as a sequence of segments, readable whatever happens to the program.
!>
!> The segment being written is trajectory_NNNN.h5.open and is flushed after each frame. When it is full it
!> is closed, brought to disk and renamed to trajectory_NNNN.h5, and never written again. A program that is
!> killed spoils at most the open segment, and that only if it dies during a flush.
!>
!> All processes of a run write each segment together, and all procedures are collective. Of errors that were there
!> before, all must know.
module polydem_trajectory
   use polydem_bodies, only: bodies_t
   use polydem_complete_file, only: check_whole, keep_room, share_file
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ledger_row, only: ledger_row_t
   use polydem_lone_team, only: lone_team_t
   use polydem_manifest, only: manifest_t
   use polydem_paths, only: make_folder, rename_file, sync_file
   use polydem_provenance, only: provenance_t
   use polydem_result_folder, only: open_suffix, segment_path
   use polydem_segment, only: add_contacts, add_frame, add_ledger, add_walls, start_segment, write_bodies
   use polydem_team, only: team_t
   use polydem_time_limit, only: time_limit_t
   implicit none
   private
   public :: trajectory_t

   !> A trajectory that is being written
   type :: trajectory_t
      private
      !> Folder of the result
      character(len=:), allocatable :: folder
      !> Processes that write it
      class(team_t), allocatable :: team
      !> Where the result comes from, for each segment
      type(provenance_t) :: provenance
      !> The open segment
      type(hdf5_file_t) :: file
      !> Whether there is an open segment
      logical :: is_open = .false.
      !> Number of the last segment
      integer(ip), public :: number = 0_ip
      !> Frames per segment
      integer(ip) :: capacity = 1_ip
      !> Frames in the open segment
      integer(ip) :: n_frames = 0_ip
      !> Steps of the first and the last of them
      integer(lp) :: steps(2) = 0_lp
      !> Contacts in the open segment
      integer(lp) :: n_contacts = 0_lp
   contains
      procedure :: open => open_trajectory
      procedure :: write_frame
      procedure :: bring_to_disk
      procedure :: close => close_trajectory
   end type trajectory_t

contains

   !> Prepare to write; the folder is made if it is not there and should hold no result but the segments to go on from.
   subroutine open_trajectory(self, folder, frames_per_segment, provenance, error, last_number, team)
      class(trajectory_t), intent(inout) :: self
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Frames per segment, at least 1
      integer(ip), intent(in) :: frames_per_segment
      !> Where the result comes from
      type(provenance_t), intent(in) :: provenance
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      !> Number of the last segment that is there; 0 if absent
      integer(ip), intent(in), optional :: last_number
      !> Processes of the run; this one alone if absent
      class(team_t), intent(in), optional :: team

      if (allocated(self%team)) deallocate (self%team)
      if (present(team)) then
         allocate (self%team, source=team)
      else
         allocate (lone_team_t :: self%team)
      end if
      self%folder = folder
      self%capacity = max(1_ip, frames_per_segment)
      self%provenance = provenance
      self%number = 0_ip
      if (present(last_number)) self%number = last_number
      self%is_open = .false.
      if (self%team%leads()) call make_folder(folder, error)
      call self%team%agree(error)
   end subroutine open_trajectory

   !> Write a frame and flush it; after a failure its segment stays open as it is. Give `contacts` in all frames or
   !> in none, and so `row`.
   subroutine write_frame(self, step, time, bodies, error, contacts, row, manifest)
      class(trajectory_t), intent(inout) :: self
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Simulated time [s]
      real(wp), intent(in) :: time
      !> Bodies with their forces; at the leader with the whole forces on the fixed ones
      type(bodies_t), intent(in) :: bodies
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      !> Contacts with their forces
      type(contacts_t), intent(in), optional :: contacts
      !> Entries of the ledger
      type(ledger_row_t), intent(in), optional :: row
      !> List of the files of the result, to which segments are added; that of the leader counts
      type(manifest_t), intent(inout), optional :: manifest
      type(time_limit_t) :: limit
      integer(ip) :: number

      number = merge(self%number, self%number + 1_ip, self%is_open)
      if (self%team%size > 1_ip) call limit%set(segment_path(self%folder, number)//open_suffix, self%team%rank, &
                                                room_for(bodies))
      if (self%is_open) then
         call keep_room(self%team, segment_path(self%folder, self%number)//open_suffix, room_for(bodies), error)
      else
         call open_segment(self, bodies, error, manifest)
      end if
      if (.not. allocated(error)) call fill_frame(self, step, time, bodies, error, contacts, row)
      if (allocated(error)) then
         call self%file%abandon(error)
         self%is_open = .false.
      else
         if (self%n_frames == 0_ip) self%steps(1) = step
         self%steps(2) = step
         self%n_frames = self%n_frames + 1_ip
         if (self%n_frames == self%capacity) call close_segment(self, error, manifest)
      end if
      call limit%lift()
   end subroutine write_frame

   subroutine fill_frame(self, step, time, bodies, error, contacts, row)
      type(trajectory_t), intent(inout) :: self
      integer(lp), intent(in) :: step
      real(wp), intent(in) :: time
      type(bodies_t), intent(in) :: bodies
      type(error_t), allocatable, intent(inout) :: error
      type(contacts_t), intent(in), optional :: contacts
      type(ledger_row_t), intent(in), optional :: row

      call add_frame(self%file, self%team, step, real(time, dp), bodies, error)
      call add_walls(self%file, bodies, error)
      if (present(contacts)) call add_contacts(self%file, self%team, self%n_contacts, bodies, contacts, error)
      if (present(row)) call add_ledger(self%file, row, error)
      if (.not. allocated(error)) call self%file%flush(error)
   end subroutine fill_frame

   !> Wait until the frames of the open segment, if there is one, are on the disk; called by the leader alone.
   subroutine bring_to_disk(self, error)
      class(trajectory_t), intent(in) :: self
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      if (self%is_open) call sync_file(segment_path(self%folder, self%number)//open_suffix, error)
   end subroutine bring_to_disk

   !> Close the open segment, if there is one, however few frames it has.
   subroutine close_trajectory(self, error, manifest)
      class(trajectory_t), intent(inout) :: self
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      !> List of the files of the result, as for `write_frame`
      type(manifest_t), intent(inout), optional :: manifest
      type(time_limit_t) :: limit

      if (.not. self%is_open) return
      if (self%team%size > 1_ip) call limit%set(segment_path(self%folder, self%number)//open_suffix, self%team%rank, &
                                                0_lp)
      call close_segment(self, error, manifest)
      call limit%lift()
   end subroutine close_trajectory

   subroutine open_segment(self, bodies, error, manifest)
      type(trajectory_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies
      type(error_t), allocatable, intent(inout) :: error
      type(manifest_t), intent(inout), optional :: manifest
      character(len=:), allocatable :: path

      self%number = self%number + 1_ip
      path = segment_path(self%folder, self%number)//open_suffix
      self%n_frames = 0_ip
      self%n_contacts = 0_lp
      if (self%team%leads()) then
         if (present(manifest)) call manifest%own(segment_path(self%folder, self%number), error)
         if (.not. allocated(error)) call self%file%create(path, error)
         if (.not. allocated(error)) call start_segment(self%file, self%provenance, error)
      end if
      call share_file(self%team, self%file, path, room_for(bodies), error)
      if (allocated(error)) return
      self%is_open = .true.
      call write_bodies(self%file, self%team, bodies, error)
   end subroutine open_segment

   !> Room that a frame needs at most, and shapes before the first one [B]. A grain has some ten corners of 16 bytes, 80
   !> bytes in a frame, and two or three contacts of 72; a new chunk of each of the data sets comes on top.
   pure integer(lp) function room_for(bodies)
      type(bodies_t), intent(in) :: bodies

      room_for = 2000000_lp + 1000_lp*int(bodies%n_all, lp)
   end function room_for

   subroutine close_segment(self, error, manifest)
      type(trajectory_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      type(manifest_t), intent(inout), optional :: manifest
      character(len=:), allocatable :: path

      path = segment_path(self%folder, self%number)
      self%is_open = .false.
      call self%file%close(error)
      if (self%team%leads()) then
         if (.not. allocated(error)) call sync_file(path//open_suffix, error)
         if (.not. allocated(error)) call check_whole(path//open_suffix, error)
         if (.not. allocated(error)) call rename_file(path//open_suffix, path, error)
         if (.not. allocated(error)) call sync_file(self%folder, error)
         if (present(manifest)) call manifest%close_file(path, error, [int(self%n_frames, lp), self%steps])
      end if
      call self%team%agree(error)
   end subroutine close_segment

end module polydem_trajectory
