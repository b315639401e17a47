!> The trajectory of a run as a sequence of segments, readable whatever happens to the program.
!>
!> The segment being written is trajectory_NNNN.h5.open and is flushed after each frame. When it is full it
!> is closed, brought to disk and renamed to trajectory_NNNN.h5, and never written again. A program that is
!> killed spoils at most the open segment, and that only if it dies during a flush.
module polydem_trajectory
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ledger_row, only: ledger_row_t
   use polydem_paths, only: make_folder, rename_file, sync_file
   use polydem_provenance, only: provenance_t
   use polydem_result_folder, only: open_suffix, segment_path
   use polydem_segment, only: add_contacts, add_frame, add_ledger, add_walls, start_segment
   implicit none
   private
   public :: trajectory_t

   !> A trajectory that is being written
   type :: trajectory_t
      private
      !> Folder of the result
      character(len=:), allocatable :: folder
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
      !> Contacts in the open segment
      integer(lp) :: n_contacts = 0_lp
   contains
      procedure :: open => open_trajectory
      procedure :: write_frame
      procedure :: close => close_trajectory
   end type trajectory_t

contains

   !> Prepare to write; the folder is made if it is not there and should hold no result but the segments to go on from.
   subroutine open_trajectory(self, folder, frames_per_segment, provenance, error, last_number)
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

      self%folder = folder
      self%capacity = max(1_ip, frames_per_segment)
      self%provenance = provenance
      self%number = 0_ip
      if (present(last_number)) self%number = last_number
      self%is_open = .false.
      call make_folder(folder, error)
   end subroutine open_trajectory

   !> Write a frame and flush it; after a failure its segment stays open as it is. Give `contacts` in all frames or
   !> in none, and so `row`.
   subroutine write_frame(self, step, time, bodies, error, contacts, row)
      class(trajectory_t), intent(inout) :: self
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Simulated time [s]
      real(wp), intent(in) :: time
      !> Bodies with their forces
      type(bodies_t), intent(in) :: bodies
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      !> Contacts with their forces
      type(contacts_t), intent(in), optional :: contacts
      !> Entries of the ledger
      type(ledger_row_t), intent(in), optional :: row

      if (.not. self%is_open) call open_segment(self, bodies, error)
      if (allocated(error) .and. .not. self%is_open) return
      call add_frame(self%file, step, real(time, dp), bodies, error)
      call add_walls(self%file, bodies, error)
      if (present(contacts)) then
         call add_contacts(self%file, self%n_contacts, bodies, contacts, error)
         self%n_contacts = self%n_contacts + int(contacts%n, lp)
      end if
      if (present(row)) call add_ledger(self%file, row, error)
      if (.not. allocated(error)) call self%file%flush(error)
      if (allocated(error)) then
         call self%file%abandon(error)
         self%is_open = .false.
         return
      end if
      self%n_frames = self%n_frames + 1_ip
      if (self%n_frames == self%capacity) call close_segment(self, error)
   end subroutine write_frame

   !> Close the open segment, if there is one, however few frames it has.
   subroutine close_trajectory(self, error)
      class(trajectory_t), intent(inout) :: self
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      if (self%is_open) call close_segment(self, error)
   end subroutine close_trajectory

   subroutine open_segment(self, bodies, error)
      type(trajectory_t), intent(inout) :: self
      type(bodies_t), intent(in) :: bodies
      type(error_t), allocatable, intent(inout) :: error

      self%number = self%number + 1_ip
      call self%file%create(segment_path(self%folder, self%number)//open_suffix, error)
      if (allocated(error)) return
      self%is_open = .true.
      self%n_frames = 0_ip
      self%n_contacts = 0_lp
      call start_segment(self%file, bodies, self%provenance, error)
   end subroutine open_segment

   subroutine close_segment(self, error)
      type(trajectory_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path

      path = segment_path(self%folder, self%number)
      self%is_open = .false.
      call self%file%close(error)
      if (.not. allocated(error)) call sync_file(path//open_suffix, error)
      if (.not. allocated(error)) call rename_file(path//open_suffix, path, error)
      if (.not. allocated(error)) call sync_file(self%folder, error)
   end subroutine close_segment

end module polydem_trajectory
