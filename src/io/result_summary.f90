!> Summary of a result folder in a few lines: scene, frames, time span, size, and how the run ended.
module polydem_result_summary
   use polydem_errors, only: error_t, raise_unread
   use polydem_file_system, only: exists, last_failure
   use polydem_folder_lock, only: lock_path
   use polydem_frame_columns, only: insist_on_layout
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_log, only: log_t
   use polydem_profile_file, only: read_final_status
   use polydem_result_files, only: actions_name, checkpoint_path, log_name, manifest_name, n_checkpoints, open_suffix, &
      overlaps_name, profile_name, segment_path, series_name, steps_name, trace_name
   use polydem_strings, only: printable, to_text
   implicit none
   private
   public :: write_summary

   !> Frames of the closed segments of a result
   type :: frames_t
      !> Number of segments and of frames
      integer(lp) :: n_segments = 0_lp, n = 0_lp
      !> Number of bodies
      integer(lp) :: bodies = 0_lp
      !> Times of the first and the last frame [s]
      real(dp) :: first = 0.0_dp, last = 0.0_dp
      !> Name of the scene; empty: unknown
      character(len=:), allocatable :: scene
   end type frames_t

contains

   !> Write the summary of a result folder. Files that are missing are left out.
   subroutine write_summary(folder, log, error)
      !> Result folder
      character(len=*), intent(in) :: folder
      type(log_t), intent(inout) :: log
      !> Allocated if a file cannot be read
      type(error_t), allocatable, intent(inout) :: error
      type(frames_t) :: frames
      character(len=:), allocatable :: state
      integer(lp) :: size_of_all

      call read_frames(folder, frames, error)
      if (.not. allocated(error)) call read_state(folder, state, error)
      if (.not. allocated(error)) call count_bytes(folder, size_of_all, error)
      if (allocated(error)) return
      call log%write_line(folder)
      if (frames%scene /= '') call log%write_line('   scene           '//printable(frames%scene))
      if (frames%n > 0_lp) then
         call log%write_line('   bodies          '//to_text(frames%bodies))
         call log%write_line('   frames          '//to_text(frames%n)//' in '//to_text(frames%n_segments)// &
                             trim(merge(' closed segments', ' closed segment ', frames%n_segments /= 1_lp)))
         call log%write_line('   time span       '//to_text(real(frames%first, wp))//' s to '// &
                             to_text(real(frames%last, wp))//' s')
      end if
      call log%write_line('   size            '//to_text(size_of_all/1024_lp + 1_lp)//' KiB')
      call log%write_line('   state           '//printable(state))
   end subroutine write_summary

   !> Read the frames of all closed segments.
   subroutine read_frames(folder, frames, error)
      character(len=*), intent(in) :: folder
      type(frames_t), intent(out) :: frames
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      character(len=:), allocatable :: text
      integer(lp), allocatable :: start(:)
      real(dp), allocatable :: times(:)
      integer(ip) :: number

      frames%scene = ''
      number = 1_ip
      do while (exists(segment_path(folder, number), error))
         call file%open(segment_path(folder, number), error)
         call file%read('/frames/time', times, error)
         call insist_on_layout(file, segment_path(folder, number), error)
         call file%read('/frames/start', start, error)
         if (.not. allocated(error) .and. number == 1_ip) then
            if (file%has('/provenance/resolved_input', error)) call file%read('/provenance/resolved_input', text, error)
            if (allocated(text)) frames%scene = scene_of(text)
         end if
         call file%close(error)
         if (allocated(error)) return
         if (size(times) > 0 .and. size(start) > 1) then
            if (frames%n == 0_lp) frames%first = times(1)
            frames%last = times(size(times))
            frames%bodies = start(size(start)) - start(size(start) - 1)
         end if
         frames%n = frames%n + size(times, kind=lp)
         frames%n_segments = frames%n_segments + 1_lp
         number = number + 1_ip
      end do
   end subroutine read_frames

   !> How the run ended, or that it has not ended
   subroutine read_state(folder, state, error)
      character(len=*), intent(in) :: folder
      character(len=:), allocatable, intent(out) :: state
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: hash
      integer(ip) :: k

      if (exists(lock_path(folder), error)) then
         state = 'running, or killed: running.lock exists'
      else if (exists(folder//'/'//profile_name, error)) then
         call read_final_status(folder//'/'//profile_name, state, hash, error)
         return
      else
         state = 'not finished'
      end if
      do k = 1_ip, n_checkpoints
         if (.not. exists(checkpoint_path(folder, k), error)) cycle
         state = state//'; a run with --continue resumes from the last checkpoint'
         return
      end do
   end subroutine read_state

   !> Name of the scene in a namelist that the program has written; empty if it has none
   pure function scene_of(text) result(name)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: name
      character(len=*), parameter :: before = "name = '"
      integer :: first, length

      name = ''
      first = index(text, '&scene')
      if (first == 0) return
      if (index(text(first:), before) == 0) return
      first = first + index(text(first:), before) + len(before) - 1
      length = index(text(first:), "'") - 1
      if (length > 0) name = text(first:first + length - 1)
   end function scene_of

   !> Size of all files of a result [B]
   subroutine count_bytes(folder, bytes, error)
      character(len=*), intent(in) :: folder
      integer(lp), intent(out) :: bytes
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: names(*) = [character(len=12) :: manifest_name, log_name, profile_name, &
                                                 trace_name, steps_name, overlaps_name, series_name, &
                                                 actions_name]
      integer(ip) :: k

      bytes = 0_lp
      do k = 1_ip, size(names, kind=ip)
         bytes = bytes + bytes_of(folder//'/'//trim(names(k)), error)
      end do
      do k = 1_ip, n_checkpoints
         bytes = bytes + bytes_of(checkpoint_path(folder, k), error)
      end do
      k = 1_ip
      do while (exists(segment_path(folder, k), error))
         bytes = bytes + bytes_of(segment_path(folder, k), error)
         k = k + 1_ip
      end do
      bytes = bytes + bytes_of(segment_path(folder, k)//open_suffix, error)
   end subroutine count_bytes

   !> Size of a file [B]; 0 if it does not exist
   integer(lp) function bytes_of(path, error)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error

      bytes_of = 0_lp
      if (.not. exists(path, error)) return
      inquire (file=path, size=bytes_of)
      if (bytes_of < 0_lp) call raise_unread(error, path, last_failure())
   end function bytes_of

end module polydem_result_summary
