!> The trajectory of a run as a sequence of segments. The segments stay readable after a crash.
!>
!> The open segment is trajectory_NNNN.h5.open and is flushed after each frame. A full segment is closed, flushed to
!> disk and renamed to trajectory_NNNN.h5; it is never written again. A killed program can damage only the open
!> segment, and only during a flush.
!>
!> All ranks of a run write each segment collectively, and all procedures are collective unless stated otherwise. An
!> error on entry must be allocated on all ranks or on none.
module polydem_trajectory_writer
   use polydem_atomic_file, only: give_final_name, reserve_on_all_ranks, open_on_all_ranks
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: choose_communicator, communicator_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_file_system, only: make_folder, sync_file
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_manifest, only: manifest_t
   use polydem_named_values, only: named_values_t
   use polydem_provenance, only: provenance_t, write_provenance
   use polydem_result_files, only: open_suffix, segment_path
   use polydem_segment_bodies, only: segment_bodies_t
   use polydem_series, only: series_t
   use polydem_time_limit, only: time_limit_t
   use polydem_trajectory_segment, only: add_contacts, add_frame, add_balance, add_series, add_walls, write_surroundings
   implicit none
   private
   public :: trajectory_writer_t

   !> A trajectory, open for writing
   type :: trajectory_writer_t
      private
      !> Folder of the result
      character(len=:), allocatable :: folder
      !> Communicator of the ranks that write it
      class(communicator_t), allocatable :: comm
      !> Origin of the result, written to each segment
      type(provenance_t) :: provenance
      !> The open segment
      type(hdf5_file_t) :: file
      !> Whether there is an open segment
      logical :: is_open = .false.
      !> Number of the last segment
      integer(ip), public :: number = 0_ip
      !> Maximum number of frames per segment
      integer(ip) :: capacity = 1_ip
      !> Number of frames in the open segment
      integer(ip) :: n_frames = 0_ip
      !> Steps of the first and the last frame in the open segment
      integer(lp) :: steps(2) = 0_lp
      !> Bodies of the open segment, and whether bodies enter or leave
      type(segment_bodies_t) :: bodies
      !> Number of bodies in all its frames together
      integer(lp) :: n_rows = 0_lp
      !> Number of contacts in the open segment
      integer(lp) :: n_contacts = 0_lp
   contains
      procedure :: open => open_trajectory
      procedure :: write_frame
      procedure :: flush_to_disk
      procedure :: close => close_trajectory
   end type trajectory_writer_t

contains

   !> Prepare for writing. The folder is created if necessary. It must not contain a result other than the segments of
   !> previous starts of the same run.
   subroutine open_trajectory(self, folder, frames_per_segment, provenance, error, last_number, comm, bodies_change)
      class(trajectory_writer_t), intent(inout) :: self
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Maximum number of frames per segment, at least 1
      integer(ip), intent(in) :: frames_per_segment
      type(provenance_t), intent(in) :: provenance
      type(error_t), allocatable, intent(inout) :: error
      !> Number of the last existing segment; default: 0
      integer(ip), intent(in), optional :: last_number
      !> Communicator of the run; absent: this rank writes alone
      class(communicator_t), intent(in), optional :: comm
      !> Whether bodies enter or leave; default: no
      logical, intent(in), optional :: bodies_change

      if (present(bodies_change)) self%bodies%change = bodies_change
      call choose_communicator(self%comm, comm)
      self%folder = folder
      self%capacity = max(1_ip, frames_per_segment)
      self%provenance = provenance
      self%number = 0_ip
      if (present(last_number)) self%number = last_number
      self%is_open = .false.
      if (self%comm%is_root()) call make_folder(folder, error)
      call self%comm%all_reduce_error(error)
   end subroutine open_trajectory

   !> Write a frame and flush it. After a failure the segment keeps its temporary name. Either all frames have
   !> `contacts` or none; likewise for `row`.
   subroutine write_frame(self, step, time, bodies, error, contacts, row, manifest, series, departures)
      class(trajectory_writer_t), intent(inout) :: self
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Simulated time [s]
      real(wp), intent(in) :: time
      !> Bodies with their forces; on the root rank with the total forces on the fixed bodies
      type(bodies_t), intent(in) :: bodies
      type(error_t), allocatable, intent(inout) :: error
      !> Contacts with their forces
      type(contacts_t), intent(in), optional :: contacts
      !> Entries of the energy balance
      type(named_values_t), intent(in), optional :: row
      !> Manifest of the result, to which segments are added; only that of the root rank is used
      type(manifest_t), intent(inout), optional :: manifest
      !> Rows of the series since the last frame, which are written before this frame and dropped
      type(series_t), intent(inout), optional :: series
      !> Departures since the last frame, likewise
      type(series_t), intent(inout), optional :: departures
      type(time_limit_t) :: limit
      integer(ip) :: number
      integer(lp) :: room

      number = merge(self%number, self%number + 1_ip, self%is_open)
      room = room_for(bodies)
      if (present(series)) room = room + room_for_series(series)
      if (present(departures)) room = room + room_for_series(departures)
      if (self%comm%size > 1_ip) call limit%set(segment_path(self%folder, number)//open_suffix, self%comm%rank, room)
      if (self%is_open) then
         call reserve_on_all_ranks(self%comm, segment_path(self%folder, self%number)//open_suffix, room, error)
      else
         call open_segment(self, bodies, room, error, manifest)
      end if
      if (.not. allocated(error) .and. present(series)) call write_series(self, '/series', series, error)
      if (.not. allocated(error) .and. present(departures)) call write_series(self, '/departures', departures, error)
      if (.not. allocated(error)) call fill_frame(self, step, time, bodies, error, contacts, row)
      if (allocated(error)) then
         call self%file%abandon(error)
         self%is_open = .false.
      else
         if (present(series)) call series%drop_rows(step)
         if (present(departures)) call departures%drop_rows(step)
         if (self%n_frames == 0_ip) self%steps(1) = step
         self%steps(2) = step
         self%n_frames = self%n_frames + 1_ip
         if (self%n_frames == self%capacity) call close_segment(self, error, manifest)
      end if
      call limit%lift()
   end subroutine write_frame

   !> Write the data of a frame and flush the file.
   subroutine fill_frame(self, step, time, bodies, error, contacts, row)
      type(trajectory_writer_t), intent(inout) :: self
      integer(lp), intent(in) :: step
      real(wp), intent(in) :: time
      type(bodies_t), intent(in) :: bodies
      type(error_t), allocatable, intent(inout) :: error
      type(contacts_t), intent(in), optional :: contacts
      type(named_values_t), intent(in), optional :: row

      call expect_some(self, bodies)
      if (self%bodies%change .or. self%n_frames == 0_ip) call self%bodies%append(self%file, self%comm, bodies, error)
      if (.not. self%bodies%change) call expect_frames(self, bodies)
      call add_frame(self%file, self%comm, self%n_rows, step, real(time, dp), bodies, self%bodies%change, error)
      call expect_some(self, bodies)
      call add_walls(self%file, bodies, error)
      if (present(contacts)) call add_contacts(self%file, self%comm, self%n_contacts, bodies, contacts, error)
      if (present(row)) call add_balance(self%file, row, error)
      if (.not. allocated(error)) call self%file%flush(error)
   end subroutine fill_frame

   !> Flush the open segment to disk, if there is one. Called by the root rank only.
   subroutine flush_to_disk(self, error)
      class(trajectory_writer_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      if (self%is_open) call sync_file(segment_path(self%folder, self%number)//open_suffix, error)
   end subroutine flush_to_disk

   !> Close the open segment, if there is one, even if it is not full.
   subroutine close_trajectory(self, error, manifest)
      class(trajectory_writer_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      !> Manifest of the result, as for `write_frame`
      type(manifest_t), intent(inout), optional :: manifest
      type(time_limit_t) :: limit

      if (.not. self%is_open) return
      if (self%comm%size > 1_ip) call limit%set(segment_path(self%folder, self%number)//open_suffix, self%comm%rank, &
                                                0_lp)
      call close_segment(self, error, manifest)
      call limit%lift()
   end subroutine close_trajectory

   !> Create the next segment.
   subroutine open_segment(self, bodies, room, error, manifest)
      type(trajectory_writer_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies
      !> Upper bound of the disk space of its first frame [B]
      integer(lp), intent(in) :: room
      type(error_t), allocatable, intent(inout) :: error
      type(manifest_t), intent(inout), optional :: manifest
      character(len=:), allocatable :: path

      self%number = self%number + 1_ip
      path = segment_path(self%folder, self%number)//open_suffix
      self%n_frames = 0_ip
      self%n_contacts = 0_lp
      if (self%comm%is_root()) then
         if (present(manifest)) call manifest%add_file(segment_path(self%folder, self%number), error)
         if (.not. allocated(error)) call self%file%create(path, error)
         call write_provenance(self%file, 'segment of a trajectory by polydem', self%provenance, error)
      end if
      call open_on_all_ranks(self%comm, self%file, path, room, error)
      if (allocated(error)) return
      self%is_open = .true.
      self%bodies = segment_bodies_t(change=self%bodies%change)
      self%n_rows = 0_lp
      call write_surroundings(self%file, bodies, error)
   end subroutine open_segment

   !> Expect as many rows of all frames together as all frames have bodies. Chunks hold whole frames, so that reading a
   !> frame reads no other.
   subroutine expect_frames(self, bodies)
      type(trajectory_writer_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies

      call self%file%expect_rows(int(self%capacity, lp), int(self%capacity, lp)*int(bodies%n_all, lp), &
                                 int(bodies%n_all, lp))
   end subroutine expect_frames

   !> Choose the size of chunks such that it is small enough for the contacts of loose grains, and large enough for
   !> those of dense packings; likewise for few bodies that enter, and for many.
   subroutine expect_some(self, bodies)
      type(trajectory_writer_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies

      call self%file%expect_rows(int(self%capacity, lp), int(self%capacity, lp)*int(bodies%n_all, lp)/8_lp)
   end subroutine expect_some

   !> Write the rows of a series, in chunks of the size that the segment will probably need.
   subroutine write_series(self, group, series, error)
      type(trajectory_writer_t), intent(inout) :: self
      !> Name of its group
      character(len=*), intent(in) :: group
      type(series_t), intent(in) :: series
      type(error_t), allocatable, intent(inout) :: error

      call self%file%expect_rows(int(self%capacity, lp), int(self%capacity, lp)*int(series%n, lp))
      call add_series(self%file, group, series, error)
   end subroutine write_series

   !> Upper bound of the disk space of one frame, including the shapes written before the first frame [B]. A body has
   !> about ten vertices of 16 bytes, 80 bytes per frame, and two or three contacts of 72 bytes. A new chunk of each
   !> data set is added.
   pure integer(lp) function room_for(bodies)
      type(bodies_t), intent(in) :: bodies

      room_for = 2000000_lp + 1000_lp*int(bodies%n_all, lp)
   end function room_for

   !> Upper bound of the disk space of the rows of a series, with a new chunk of each column [B]
   pure integer(lp) function room_for_series(series) result(room)
      type(series_t), intent(in) :: series

      room = 0_lp
      if (series%n > 0) room = (8_lp*int(series%n, lp) + 20000_lp)*int(size(series%value, 1) + 2, lp)
   end function room_for_series

   !> Close the open segment, flush it to disk, rename it and mark it as closed in the manifest.
   subroutine close_segment(self, error, manifest)
      type(trajectory_writer_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      type(manifest_t), intent(inout), optional :: manifest
      character(len=:), allocatable :: path

      path = segment_path(self%folder, self%number)
      self%is_open = .false.
      call self%file%close(error)
      if (self%comm%is_root()) then
         call give_final_name(path//open_suffix, path, error)
         if (present(manifest)) call manifest%close_file(path, error, [int(self%n_frames, lp), self%steps])
      end if
      call self%comm%all_reduce_error(error)
   end subroutine close_segment

end module polydem_trajectory_writer
