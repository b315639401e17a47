!> Checks of the files of a result against its manifest: each file exists, is complete and belongs to the same result.
!> Also detects files in the folder that do not belong to the result but have names of its files.
module polydem_checked_files
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_file_checksum, only: sum_file
   use polydem_folders, only: link_exists, list_names
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: ip, lp
   use polydem_manifest, only: entry_t, manifest_t
   use polydem_result_files, only: complete_name, conflict_text, is_table, manifest_name, name_in, segment_number, &
      segment_path
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_free, check_manifest, check_closed, find_segments, find_problem, find_stranger, read_frames

contains

   !> Reject an invalid manifest. A missing manifest is accepted.
   subroutine check_manifest(manifest, error)
      !> Manifest after `read`
      type(manifest_t), intent(in) :: manifest
      !> Describes the defect
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(manifest%problem)) return
      if (manifest%is_unread) then
         call raise(error, io_error, manifest%problem)
         error%is_unread = .true.
      else if (manifest%is_foreign) then
         call raise(error, input_error, manifest%problem//', and blocks its name. Move the file away, or choose '// &
                    'another folder with --set output.folder=NAME')
      else
         call raise(error, io_error, manifest%problem//'. The files of the result cannot be identified. Restore '// &
                    'the manifest from a copy, or choose another folder with --set output.folder=NAME')
      end if
   end subroutine check_manifest

   !> Reject a folder with files that have names of a result but are not listed in its manifest.
   subroutine check_free(manifest, folder, names, error)
      !> Manifest of the folder; empty if there is none
      type(manifest_t), intent(in) :: manifest
      !> The folder
      character(len=*), intent(in) :: folder
      !> Names that the result needs, blank-padded; the names of all segments are included implicitly
      character(len=*), intent(in) :: names(:)
      !> Names the conflicting file
      type(error_t), allocatable, intent(inout) :: error
      character(len=255), allocatable :: found(:)
      character(len=:), allocatable :: name
      integer :: k

      call list_names(folder, found, error)
      do k = 1, size(found)
         if (allocated(error)) return
         name = complete_name(trim(found(k)))
         if (.not. any(names == name) .and. segment_number(name) == 0_ip) cycle
         if (.not. manifest%owns(name)) call raise(error, input_error, conflict_text(folder//'/'//trim(found(k))))
      end do
   end subroutine check_free

   !> Check that all closed files but tables, which are made again, are unchanged since they were closed, and that the
   !> segments are consecutive.
   subroutine check_closed(manifest, folder, error, only)
      !> Valid manifest
      type(manifest_t), intent(in) :: manifest
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Names the first file that is missing or changed, and a remedy
      type(error_t), allocatable, intent(inout) :: error
      !> Name of the only file to check; absent: all files are checked
      character(len=*), intent(in), optional :: only
      character(len=:), allocatable :: problem
      integer, allocatable :: places(:)
      integer :: k

      call find_segments(manifest, folder, places, problem)
      do k = 1, manifest%n
         if (allocated(problem)) exit
         if (.not. manifest%entry(k)%is_closed .or. is_table(manifest%entry(k)%name)) cycle
         if (present(only)) then
            if (manifest%entry(k)%name /= only) cycle
         end if
         call find_problem(folder, manifest%entry(k), problem, error)
         if (allocated(error)) return
         if (allocated(problem)) problem = folder//'/'//trim(manifest%entry(k)%name)//' '//problem
      end do
      if (allocated(problem)) call raise(error, io_error, problem//'. Restore the file from a copy, or start the '// &
         'run from the first step with --force instead of --continue')
   end subroutine check_closed

   !> List the closed segments in ascending order.
   subroutine find_segments(manifest, folder, places, problem)
      type(manifest_t), intent(in) :: manifest
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Indices of the consecutive segments in the list of entries of the manifest, (segment)
      integer, allocatable, intent(out) :: places(:)
      !> Names the first segment that is missing or out of order; unallocated if there is none
      character(len=:), allocatable, intent(out) :: problem
      integer :: k, n

      allocate (places(manifest%n))
      places = 0
      do k = 1, manifest%n
         n = segment_number(manifest%entry(k)%name)
         if (n > 0 .and. n <= manifest%n .and. manifest%entry(k)%is_closed) places(n) = k
      end do
      do n = 1, size(places)
         if (places(n) == 0) exit
      end do
      if (any(places(n:) > 0)) problem = segment_path(folder, int(n, ip))//' is missing in '//manifest_name// &
         ', which lists later segments'
      places = places(:n - 1)
      do n = 2, size(places)
         associate (former => manifest%entry(places(n - 1)), entry => manifest%entry(places(n)))
            if (entry%frames(2) <= former%frames(3) .and. .not. allocated(problem)) problem = folder//'/'// &
               trim(entry%name)//' does not follow the previous segment, which ends with step '// &
               to_text(former%frames(3))
         end associate
      end do
   end subroutine find_segments

   !> Compare a closed file with its entry in the manifest.
   subroutine find_problem(folder, entry, problem, error)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Entry of the file in the manifest
      type(entry_t), intent(in) :: entry
      !> Defect of the file, as the end of a sentence; unallocated if every bit of the file is unchanged
      character(len=:), allocatable, intent(out) :: problem
      !> Allocated if the file cannot be read, which is no defect
      type(error_t), allocatable, intent(inout) :: error
      character(len=8) :: checksum
      integer(lp) :: bytes

      if (.not. link_exists(folder//'/'//trim(entry%name), error)) then
         if (.not. allocated(error)) problem = 'is missing'
         return
      end if
      call sum_file(folder//'/'//trim(entry%name), bytes, checksum, error)
      if (allocated(error)) return
      if (bytes /= entry%bytes) then
         problem = 'is damaged: it has '//to_text(bytes)//' bytes, but '//to_text(entry%bytes)//' were written'
      else if (checksum /= entry%checksum) then
         problem = 'is damaged or exchanged: its checksum differs from that in '//manifest_name
      end if
   end subroutine find_problem

   !> Find out whether a file that is not closed was written by another run, or under another name.
   subroutine find_stranger(path, run, problem, error)
      !> Path of an HDF5 file of a result
      character(len=*), intent(in) :: path
      !> Identifier of the run, from the manifest
      character(len=*), intent(in) :: run
      !> What the file is, as the end of a sentence; unallocated if it belongs here
      character(len=:), allocatable, intent(out) :: problem
      !> Allocated if the file cannot be read
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      character(len=:), allocatable :: name, writer

      call file%open(path, error)
      call file%read('/provenance/run', writer, error)
      call file%read('/provenance/file', name, error)
      call file%close(error)
      if (allocated(error)) return
      if (writer /= run) then
         problem = 'was written by another run'
      else if (name /= name_in(path)) then
         problem = 'was written as '//name
      end if
   end subroutine find_stranger

   !> Read the number of frames of a segment and the steps of its first and last frame.
   subroutine read_frames(path, frames, error)
      !> Path of the segment
      character(len=*), intent(in) :: path
      !> Number of frames, first step, last step
      integer(lp), intent(out) :: frames(3)
      !> Allocated if the file cannot be read, has no frame, or its steps do not ascend
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      integer(lp), allocatable :: steps(:)

      frames = 0_lp
      call file%open(path, error)
      if (allocated(error)) return
      call file%read('/frames/step', steps, error)
      call file%close(error)
      if (allocated(error)) return
      if (size(steps) == 0) then
         call raise(error, io_error, path//': the segment contains no frame')
      else if (any(steps(2:) <= steps(:size(steps) - 1))) then
         call raise(error, io_error, path//': the steps of the frames do not ascend')
      else
         frames = [size(steps, kind=lp), steps(1), steps(size(steps))]
      end if
   end subroutine read_frames

end module polydem_checked_files
