!> Descriptions for `polydem info`: of the program itself, and of a result.
module polydem_result_info
   use polydem_choose_instruction_set, only: choose_instruction_set
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_file_checksum, only: verify_checksum
   use polydem_file_system, only: exists, is_folder
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_log, only: log_t
   use polydem_log_tables, only: write_header
   use polydem_oversubscription, only: oversubscription_text
   use polydem_provenance, only: collect_provenance, provenance_t
   use polydem_result_summary, only: write_summary
   use polydem_result_files, only: open_suffix, profile_name, segment_path
   use polydem_strings, only: printable, to_text
   implicit none
   private
   public :: describe_program, describe_result

   !> Lock of a run that writes to a folder
   character(len=*), parameter :: lock_name = 'running.lock'

   !> Entries of the provenance that are printed for a profile; for other files only the first two
   character(len=*), parameter :: facts(*) = [character(len=16) :: 'version', 'revision', 'build_type', 'compiler', &
                                              'options', 'precision', 'host', 'processor', 'instruction_set', &
                                              'caches', 'input_file', 'started', 'written']

contains

   !> Print version, compiler, compiler options and machine.
   subroutine describe_program(error)
      type(error_t), allocatable, intent(inout) :: error
      type(provenance_t) :: provenance
      type(log_t) :: log
      character(len=:), allocatable :: warning
      integer :: isa

      call choose_instruction_set(isa, error)
      if (allocated(error)) return
      call collect_provenance(provenance, '-', '', '', 0_ip)
      call log%open('', error)
      call write_header(log, provenance, '-')
      warning = oversubscription_text(provenance%threads, provenance%processors)
      if (warning /= '') call log%write_line(warning)
      call log%close(error)
   end subroutine describe_program

   !> Print a summary of a result folder, or of one of its HDF5 files.
   subroutine describe_result(path, error)
      !> Folder of a result, or one of its HDF5 files
      character(len=*), intent(in) :: path
      !> Allocated if the path does not exist or is not a result
      type(error_t), allocatable, intent(inout) :: error
      type(log_t) :: log

      call log%open('', error)
      if (.not. exists(path, error)) call raise(error, input_error, path//': no such file or folder')
      if (is_folder(path, error)) then
         call describe_folder(path, log, error)
      else if (.not. allocated(error)) then
         call describe_file(path, log, error)
      end if
      call log%close(error)
   end subroutine describe_result

   !> Describe the profile and all segments of a result folder.
   subroutine describe_folder(path, log, error)
      character(len=*), intent(in) :: path
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: number
      logical :: is_empty, has_summary

      is_empty = .not. exists(path//'/'//profile_name, error)
      has_summary = exists(segment_path(path, 1_ip), error)
      if (allocated(error)) return
      if (has_summary .or. .not. is_empty) call write_summary(path, log, error)
      if (allocated(error)) return
      if (.not. is_empty) call describe_file(path//'/'//profile_name, log, error)
      number = 1_ip
      do
         if (.not. exists(segment_path(path, number), error)) exit
         call describe_file(segment_path(path, number), log, error)
         if (allocated(error)) return
         number = number + 1_ip
      end do
      if (exists(segment_path(path, number)//open_suffix, error)) then
         call describe_open_segment(path, segment_path(path, number)//open_suffix, log, error)
      else if (is_empty .and. number == 1_ip) then
         call raise(error, input_error, path//': this folder contains no result, neither profile.h5 nor a trajectory')
      end if
   end subroutine describe_folder

   !> Describe the segment that is not closed. While a run writes it, the system may keep other readers out.
   subroutine describe_open_segment(folder, path, log, error)
      character(len=*), intent(in) :: folder, path
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: unread
      type(hdf5_file_t) :: file

      call file%open(path, unread)
      if (.not. allocated(unread)) then
         call file%close(error)
         if (.not. allocated(error)) call describe_file(path, log, error)
      else if (unread%is_unread) then
         if (exists(path)) call move_alloc(unread, error)
      else if (exists(folder//'/'//lock_name, error)) then
         call log%write_line(path)
         call log%write_line('   is being written by a run')
      else if (.not. allocated(error)) then
         call move_alloc(unread, error)
      end if
   end subroutine describe_open_segment

   !> Describe one HDF5 file of a result.
   subroutine describe_file(path, log, error)
      character(len=*), intent(in) :: path
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      logical :: is_profile

      call file%open(path, error)
      if (allocated(error)) return
      call log%write_line(path)
      is_profile = file%has('/state_hash', error)
      if (.not. allocated(error)) call describe_origin(file, is_profile, log, error)
      if (.not. allocated(error)) call describe_frames(file, log, error)
      if (.not. allocated(error)) call describe_checkpoint(path, file, log, error)
      if (.not. allocated(error) .and. is_profile) call describe_end(file, log, error)
      call file%close(error)
   end subroutine describe_file

   !> Print the provenance.
   subroutine describe_origin(file, is_profile, log, error)
      type(hdf5_file_t), intent(inout) :: file
      logical, intent(in) :: is_profile
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text
      integer :: k

      do k = 1, size(facts)
         if (k > 2 .and. .not. is_profile) return
         if (.not. file%has('/provenance/'//trim(facts(k)), error)) cycle
         call file%read('/provenance/'//trim(facts(k)), text, error)
         if (allocated(error)) return
         call log%write_line('   '//facts(k)//printable(text))
      end do
   end subroutine describe_origin

   !> Print the number of frames and bodies and the time span of a segment.
   subroutine describe_frames(file, log, error)
      type(hdf5_file_t), intent(inout) :: file
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: times(:)
      integer(lp), allocatable :: start(:)
      character(len=:), allocatable :: bodies

      if (.not. file%has('/frames/start', error)) return
      call file%read('/frames/start', start, error)
      call file%read('/frames/time', times, error)
      if (allocated(error)) return
      if (size(times) == 0 .or. size(start) <= size(times)) return
      associate (n => start(2:) - start(:size(start) - 1))
         bodies = to_text(minval(n))
         if (maxval(n) > minval(n)) bodies = bodies//' to '//to_text(maxval(n))
      end associate
      call log%write_line('   frames          '//to_text(size(times, kind=ip))//' of '//bodies// &
                          ' bodies, from '//to_text(real(times(1), wp))//' s to '// &
                          to_text(real(times(size(times)), wp))//' s')
   end subroutine describe_frames

   !> Print the step of a checkpoint and verify its checksum.
   subroutine describe_checkpoint(path, file, log, error)
      character(len=*), intent(in) :: path
      type(hdf5_file_t), intent(inout) :: file
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      integer(lp), allocatable :: step(:)
      character(len=:), allocatable :: problem

      if (.not. file%has('/run/step', error)) return
      call file%read('/run/step', step, error)
      if (allocated(error)) return
      call log%write_line('   checkpoint      of step '//to_text(step(1)))
      call verify_checksum(path, problem, error)
      if (allocated(problem)) call raise(error, io_error, path//': is damaged: '//problem)
   end subroutine describe_checkpoint

   !> Print the final status and the state hash of a profile.
   subroutine describe_end(file, log, error)
      type(hdf5_file_t), intent(inout) :: file
      type(log_t), intent(inout) :: log
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text

      call file%read('/status', text, error)
      if (allocated(error)) return
      call log%write_line('   status          '//printable(text))
      call file%read('/state_hash', text, error)
      if (.not. allocated(error)) call log%write_line('   state hash      '//printable(text))
   end subroutine describe_end

end module polydem_result_info
