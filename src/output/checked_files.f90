!> Files of a result compared with its manifest: whether they are there, are whole and belong together, and whether
!> files of somebody else are in the way.
module polydem_checked_files
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_folders, only: is_there, list_names
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: ip, lp
   use polydem_manifest, only: manifest_t
   use polydem_manifest_lines, only: entry_t
   use polydem_name_forms, only: complete_name, in_the_way, manifest_name
   use polydem_result_folder, only: segment_number, segment_path
   use polydem_sealed_file, only: hash_file
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_free, check_manifest, check_closed, find_segments, find_problem, read_frames

contains

   !> Refuse a manifest that cannot be relied on; none at all is as good as a good one.
   subroutine check_manifest(manifest, error)
      !> Manifest that was read
      type(manifest_t), intent(in) :: manifest
      !> Says what is wrong with it
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(manifest%problem)) return
      if (manifest%is_foreign) then
         call raise(error, input_error, manifest%problem//', and is in the way. Move it away, or choose another '// &
                    'folder with --set output.folder=NAME')
      else
         call raise(error, io_error, manifest%problem//'. What belongs to the result is not known for sure. Bring '// &
                    'the file back from a copy, or choose another folder with --set output.folder=NAME')
      end if
   end subroutine check_manifest

   !> Refuse to write into a folder with files of somebody else that have names of a result.
   subroutine check_free(manifest, folder, names, error)
      !> Manifest of the folder, if it has one
      type(manifest_t), intent(in) :: manifest
      !> The folder
      character(len=*), intent(in) :: folder
      !> Names that are wanted, blank-padded; those of all segments are, too
      character(len=*), intent(in) :: names(:)
      !> Says what is in the way
      type(error_t), allocatable, intent(inout) :: error
      character(len=255), allocatable :: found(:)
      character(len=:), allocatable :: name
      integer :: k

      call list_names(folder, found, error)
      do k = 1, size(found)
         if (allocated(error)) return
         name = complete_name(trim(found(k)))
         if (.not. any(names == name) .and. segment_number(name) == 0_ip) cycle
         if (.not. manifest%owns(name)) call raise(error, input_error, in_the_way(folder//'/'//trim(found(k))))
      end do
   end subroutine check_free

   !> See to it that all closed files are as they were written, and that segments follow each other.
   subroutine check_closed(manifest, folder, error, only)
      !> Good manifest
      type(manifest_t), intent(in) :: manifest
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Names the first file that is not, and says what to do
      type(error_t), allocatable, intent(inout) :: error
      !> Name of a file that alone is looked at; all are if absent
      character(len=*), intent(in), optional :: only
      character(len=:), allocatable :: problem
      integer, allocatable :: places(:)
      integer :: k

      call find_segments(manifest, folder, places, problem)
      do k = 1, manifest%n
         if (allocated(problem)) exit
         if (.not. manifest%entry(k)%is_closed) cycle
         if (present(only)) then
            if (manifest%entry(k)%name /= only) cycle
         end if
         call find_problem(folder, manifest%entry(k), problem)
         if (allocated(problem)) problem = folder//'/'//trim(manifest%entry(k)%name)//' '//problem
      end do
      if (allocated(problem)) call raise(error, io_error, problem//'. Bring it back from a copy, or begin again '// &
         'with the first step, giving --force instead of --continue')
   end subroutine check_closed

   !> Find the closed segments in their order.
   subroutine find_segments(manifest, folder, places, problem)
      !> Manifest
      type(manifest_t), intent(in) :: manifest
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Their places in the manifest, as far as they follow each other
      integer, allocatable, intent(out) :: places(:)
      !> Which one does not follow the one before, or is missing; not allocated if all is well
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
               trim(entry%name)//' does not follow the segment before, which ends with step '//to_text(former%frames(3))
         end associate
      end do
   end subroutine find_segments

   !> Compare a closed file with what the manifest says of it.
   subroutine find_problem(folder, entry, problem)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> The file
      type(entry_t), intent(in) :: entry
      !> What is wrong with it, as the end of a sentence; not allocated if every bit is as it was written
      character(len=:), allocatable, intent(out) :: problem
      integer(lp) :: bytes, hash, frames(3)
      type(error_t), allocatable :: error

      if (.not. is_there(folder//'/'//trim(entry%name))) then
         problem = 'is missing'
         return
      end if
      call hash_file(folder//'/'//trim(entry%name), bytes, hash, problem)
      if (allocated(problem)) then
         problem = 'is damaged: '//problem
      else if (bytes /= entry%bytes) then
         problem = 'is damaged: it has '//to_text(bytes)//' bytes, but '//to_text(entry%bytes)//' were written'
      else if (hash /= entry%hash) then
         problem = 'is damaged: its bytes are not those that were written'
      end if
      if (allocated(problem) .or. segment_number(entry%name) == 0_ip) return
      call read_frames(folder//'/'//trim(entry%name), frames, error)
      if (allocated(error)) then
         problem = 'cannot be looked into: '//error%message
      else if (any(frames /= entry%frames)) then
         problem = 'is not the file that '//manifest_name//' lists: its frames are others'
      end if
   end subroutine find_problem

   !> Read how many frames a segment has, and the steps of the first and the last one.
   subroutine read_frames(path, frames, error)
      !> Path of the segment
      character(len=*), intent(in) :: path
      !> Number, first step, last step
      integer(lp), intent(out) :: frames(3)
      !> Why it cannot be read, or that steps do not ascend
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      type(error_t), allocatable :: ignored
      integer(lp), allocatable :: steps(:)

      frames = 0_lp
      call file%open(path, error)
      if (allocated(error)) return
      call file%read('/frames/step', steps, error)
      call file%close(ignored)
      if (allocated(error)) return
      if (size(steps) == 0) then
         call raise(error, io_error, path//': holds no frame')
      else if (any(steps(2:) <= steps(:size(steps) - 1))) then
         call raise(error, io_error, path//': its steps do not ascend')
      else
         frames = [size(steps, kind=lp), steps(1), steps(size(steps))]
      end if
   end subroutine read_frames

end module polydem_checked_files
