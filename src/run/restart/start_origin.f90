!> Where a run starts that starts from a result: at its last checkpoint, or at one of its frames.
module polydem_start_origin
   use polydem_checkpoint_fields, only: restarts_t, serialize_progress
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: exists, is_folder
   use polydem_frame_reader, only: find_frame, read_surroundings, surroundings_t
   use polydem_removed_bodies, only: find_removed_rows
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_result_files, only: checkpoint_path, n_checkpoints, segment_path
   use polydem_settings, only: settings_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: quoted, to_text
   implicit none
   private
   public :: origin_t, find_origin, blame

   !> Where a run starts
   type :: origin_t
      !> Path of the checkpoint, or of the segment that has the frame
      character(len=:), allocatable :: path
      !> Whether it is a frame
      logical :: is_frame = .false.
      !> Number of frames before it in its segment
      integer(lp) :: row = 0_lp
      !> What the log says of it
      character(len=:), allocatable :: note
      !> What it says of its periodic cell and of pieces
      type(surroundings_t) :: around
      !> Rows of the bodies of a checkpoint that belong to walls that were removed, ascending
      integer(ip), allocatable :: removed(:)
   end type origin_t

contains

   !> Find the last checkpoint of the result from which a run starts, or its frame.
   subroutine find_origin(settings, origin, error)
      !> Settings with `start_from` in the group &scene
      type(settings_t), intent(in) :: settings
      type(origin_t), intent(out) :: origin
      !> Names the entry and what is wrong with the result
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: folder, frame, which
      real(dp) :: time
      integer(ip) :: number
      integer :: colon, status

      folder = settings%scene%start_from
      frame = ''
      colon = index(folder, ':', back=.true.)
      if (colon > 0) frame = folder(colon + 1:)
      if (is_number(frame)) then
         folder = folder(:colon - 1)
         origin%is_frame = .true.
      end if
      if (.not. is_folder(folder, error)) then
         call raise(error, input_error, quoted(folder)//' is no folder; give the folder of a result, such as '// &
                    'results/NAME, relative to the folder in which polydem is started')
      else if (origin%is_frame) then
         read (frame, *, iostat=status) number
         if (status /= 0) then
            call raise(error, input_error, folder//' has no frame '//frame//': the number is too large')
         else if (number < -1_ip) then
            call raise(error, input_error, 'there is no frame '//frame//'; frames count from 0, and -1 is the last one')
         else
            call find_frame(folder, number, origin%path, origin%row, time, error)
         end if
         which = 'frame '//frame
         if (frame == '-1') which = 'the last frame'
         if (.not. allocated(error)) origin%note = 'start      from '//which//' of '//folder//', at '// &
            to_text(real(time, wp))//' s; contact history and accelerations begin anew'
      else
         call find_checkpoint(folder, origin, error)
      end if
      if (.not. allocated(error)) call read_surroundings(origin%path, origin%row, origin%around, error)
      if (.not. (allocated(error) .or. origin%is_frame)) call find_removed_rows(origin%path, origin%removed, error)
      if (allocated(error)) call blame(settings, error)
   end subroutine find_origin

   !> Whether a text is a whole number, with or without a minus
   pure logical function is_number(text)
      character(len=*), intent(in) :: text
      integer :: first

      first = 1 + merge(1, 0, index(text, '-') == 1)
      is_number = len(text) >= first .and. verify(text(first:), '0123456789') == 0
   end function is_number

   !> Let a message name the entry.
   pure subroutine blame(settings, error)
      type(settings_t), intent(in) :: settings
      type(error_t), intent(inout) :: error

      error%message = place_of(settings, 'scene', 'start_from')//": 'start_from' in &scene: "//error%message
   end subroutine blame

   !> Find the newest checkpoint of a result. One that is damaged is an error, since the state would be an earlier one.
   subroutine find_checkpoint(folder, origin, error)
      character(len=*), intent(in) :: folder
      type(origin_t), intent(inout) :: origin
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(restarts_t) :: restarts
      integer(lp) :: step, newest
      integer(ip) :: k

      newest = -1_lp
      do k = 1_ip, n_checkpoints
         if (.not. exists(checkpoint_path(folder, k), error)) cycle
         call file%open(checkpoint_path(folder, k), error)
         if (allocated(error)) return
         call serialize_progress(file, step, restarts)
         call file%close(error)
         if (allocated(error)) return
         if (step <= newest) cycle
         newest = step
         origin%path = checkpoint_path(folder, k)
         origin%note = 'start      from '//origin%path//', step '//to_text(step)//', with contact history'
      end do
      if (newest >= 0_lp .or. allocated(error)) return
      if (.not. exists(segment_path(folder, 1_ip), error)) call raise(error, input_error, folder//' holds neither '// &
         'checkpoint nor frame: it is no result folder, or its run has just begun')
      call raise(error, input_error, folder//' holds no checkpoint. Let its run end with '// &
         'checkpoint.at_end = .true., or start from a frame, such as '//quoted(folder//':0'))
   end subroutine find_checkpoint

end module polydem_start_origin
