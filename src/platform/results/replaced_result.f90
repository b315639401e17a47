!> Safe replacement of a result by `--force`. The old result moves to the subfolder `replaced` of the result folder and
!> stays there until the new run has written its first frame. A killed program leaves either the old or the new result
!> complete. The next run in the folder derives the state from the two manifests:
!>
!>     manifest.txt   replaced/              state, and action of `recover`
!>     owns replaced  no manifest            the old result was being moved: its files are moved back
!>     none           manifest.txt           the old result was moved, the new run had not started: likewise
!>     owns replaced  manifest.txt           the new run has no frame: its files are removed, the old files moved back
!>     owns replaced  obsolete.txt           the new run has a frame: the rest of the old result is removed
!>
!> Each transition from one row to the next is one atomic rename of a manifest. Only files that are listed in a manifest
!> are moved or removed.
module polydem_replaced_result
   use polydem_checked_files, only: check_manifest
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_file_system, only: make_folder, remove_file, rename_file, sync_file
   use polydem_folders, only: link_exists, remove_folder, canonical_path
   use polydem_manifest, only: manifest_t
   use polydem_manifest_lines, only: longest_name
   use polydem_result_files, only: forms_of, conflict_text, manifest_name, unfinished
   implicit none
   private
   public :: replaced_name, holds_result, move_to_replaced, drop_replaced, recover, check_inputs

   !> Name of the folder, and name of the manifest in it once the old result is obsolete
   character(len=*), parameter :: replaced_name = 'replaced', obsolete_name = 'obsolete.txt'
   !> Name of the lock file, which is not part of a result
   character(len=*), parameter :: lock_name = 'running.lock'

contains

   !> Whether a folder contains a result or a replaced result
   logical function holds_result(folder, error)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Allocated if the system does not tell
      type(error_t), allocatable, intent(inout) :: error

      holds_result = link_exists(folder//'/'//manifest_name, error)
      if (.not. holds_result) holds_result = link_exists(replaced_path(folder)//'/'//manifest_name, error)
   end function holds_result

   !> Reject the replacement of a result that contains an input file of the new run.
   subroutine check_inputs(manifest, folder, inputs, error)
      type(manifest_t), intent(in) :: manifest
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Paths of the input files of the run, blank-padded; empty and non-existent paths are ignored
      character(len=*), intent(in) :: inputs(:)
      !> Names the input
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: input
      character(len=longest_name + len(unfinished)) :: forms(3)
      logical :: is_own
      integer :: k, j, i

      do i = 1, size(inputs)
         if (inputs(i) == '') cycle
         input = canonical_path(trim(inputs(i)), error)
         if (input == '') cycle
         is_own = input == canonical_path(folder, error)
         do k = 1, manifest%n
            forms = forms_of(trim(manifest%entry(k)%name))
            do j = 1, size(forms)
               if (.not. is_own) is_own = input == canonical_path(folder//'/'//trim(forms(j)), error)
            end do
         end do
         if (is_own) call raise(error, input_error, '--force would replace '//trim(inputs(i))// &
            ', an input of this run. Choose another folder with --set output.folder=NAME, or copy the input first')
      end do
   end subroutine check_inputs

   !> Move the result to the subfolder `replaced`. Afterwards the result folder has no manifest. The caller must create
   !> a new one that owns `replaced`.
   subroutine move_to_replaced(manifest, folder, error)
      !> Manifest of the result, open for writing
      type(manifest_t), intent(inout) :: manifest
      !> Folder of the result, locked by this run
      character(len=*), intent(in) :: folder
      !> Allocated on failure; `recover` then moves the result back
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      call manifest%add_file(replaced_name, error)
      if (allocated(error)) return
      call make_folder(replaced_path(folder), error)
      do k = 1, manifest%n
         call move(trim(manifest%entry(k)%name), folder, replaced_path(folder), error)
      end do
      call move_manifest(folder//'/'//manifest_name, replaced_path(folder)//'/'//manifest_name, folder, error)
   end subroutine move_to_replaced

   !> Remove the old result. Call it when the new result has its first frame.
   subroutine drop_replaced(manifest, folder, error)
      !> Manifest of the new result, open for writing
      type(manifest_t), intent(inout) :: manifest
      !> Folder of the result
      character(len=*), intent(in) :: folder
      type(error_t), allocatable, intent(inout) :: error

      if (.not. manifest%owns(replaced_name)) return
      call move_manifest(replaced_path(folder)//'/'//manifest_name, replaced_path(folder)//'/'//obsolete_name, folder, &
                         error)
      if (.not. allocated(error)) call clear_obsolete(manifest, folder, error)
   end subroutine drop_replaced

   !> Complete or revert an interrupted replacement by `--force`. Afterwards the folder contains one result or none.
   subroutine recover(folder, note, error)
      !> Folder of the result, locked by this run
      character(len=*), intent(in) :: folder
      !> Sentence for the log if the old result was moved back; otherwise unallocated
      character(len=:), allocatable, intent(out) :: note
      type(error_t), allocatable, intent(inout) :: error
      type(manifest_t) :: manifest, former
      logical :: was_moved
      integer :: k

      call manifest%read(folder)
      if (manifest%is_unread) call check_manifest(manifest, error)
      if (allocated(manifest%problem)) return
      if (manifest%is_found .and. .not. manifest%owns(replaced_name)) return
      call manifest%continue_writing()
      if (link_exists(replaced_path(folder)//'/'//obsolete_name, error)) then
         if (manifest%is_found) call clear_obsolete(manifest, folder, error)
         return
      end if
      if (.not. allocated(error)) call former%read(replaced_path(folder))
      if (former%is_found) then
         if (.not. manifest%is_found .and. .not. former%owns(replaced_name)) return
         if (allocated(former%problem)) then
            if (former%is_unread) call check_manifest(former, error)
            call raise(error, io_error, former%problem//'. This folder contains the result that a run with --force '// &
                       'was about to replace. Restore the file from a copy, or move the folder away')
            return
         end if
         do k = 1, manifest%n
            if (is_excluded(manifest%entry(k)%name)) cycle
            call manifest%remove_file(trim(manifest%entry(k)%name), error)
         end do
         call move_manifest(replaced_path(folder)//'/'//manifest_name, folder//'/'//manifest_name, folder, error)
         if (allocated(error)) return
         call manifest%read(folder)
         if (manifest%is_unread) call check_manifest(manifest, error)
         call manifest%continue_writing()
      end if
      if (.not. manifest%is_found .or. allocated(error)) return
      call put_back(manifest, folder, was_moved, error)
      if (was_moved .and. .not. allocated(error)) note = 'restored the old result in '//folder//': the run with '// &
         '--force that was to replace it wrote no frame'
   end subroutine recover

   !> Move the files of a result from `replaced` back to the result folder.
   subroutine put_back(manifest, folder, was_moved, error)
      type(manifest_t), intent(inout) :: manifest
      character(len=*), intent(in) :: folder
      !> Whether any file was in `replaced`
      logical, intent(out) :: was_moved
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: k

      was_moved = .false.
      do k = 1, manifest%n
         name = trim(manifest%entry(k)%name)
         if (.not. was_moved) was_moved = link_exists(replaced_path(folder)//'/'//name, error)
         call move(name, replaced_path(folder), folder, error)
      end do
      if (.not. allocated(error)) call sync_file(folder, error)
      if (allocated(error)) return
      call remove_folder(replaced_path(folder))
      call manifest%remove_entry(replaced_name, error)
   end subroutine put_back

   !> Remove the files of an obsolete result, and finally their manifest.
   subroutine clear_obsolete(manifest, folder, error)
      type(manifest_t), intent(inout) :: manifest
      character(len=*), intent(in) :: folder
      type(error_t), allocatable, intent(inout) :: error
      type(manifest_t) :: former
      character(len=longest_name + len(unfinished)) :: forms(3)
      character(len=:), allocatable :: path
      integer :: k, j

      call former%read(replaced_path(folder), obsolete_name)
      if (former%is_unread) call check_manifest(former, error)
      if (allocated(former%problem)) call raise(error, io_error, former%problem//'. This folder contains the rest '// &
         'of a result that --force has replaced. Remove the folder if it is not needed')
      if (allocated(error)) return
      do k = 1, former%n
         if (is_excluded(former%entry(k)%name)) cycle
         forms = forms_of(trim(former%entry(k)%name))
         do j = 1, size(forms)
            path = replaced_path(folder)//'/'//trim(forms(j))
            if (allocated(error)) return
            if (link_exists(path, error)) call remove_file(path, error)
         end do
      end do
      if (allocated(error)) return
      call remove_file(replaced_path(folder)//'/'//obsolete_name, error)
      call remove_folder(replaced_path(folder))
      call manifest%remove_entry(replaced_name, error)
   end subroutine clear_obsolete

   !> Move a file, in any of its forms, to another folder. The target must not exist.
   subroutine move(name, from, to, error)
      character(len=*), intent(in) :: name, from, to
      type(error_t), allocatable, intent(inout) :: error
      character(len=len(name) + len(unfinished)) :: forms(3)
      integer :: k

      if (is_excluded(name)) return
      forms = forms_of(name)
      do k = 1, size(forms)
         if (allocated(error)) return
         if (.not. link_exists(from//'/'//trim(forms(k)), error)) cycle
         if (link_exists(to//'/'//trim(forms(k)), error)) then
            call raise(error, input_error, conflict_text(to//'/'//trim(forms(k))))
         else if (.not. allocated(error)) then
            call rename_file(from//'/'//trim(forms(k)), to//'/'//trim(forms(k)), error)
         end if
      end do
   end subroutine move

   !> Rename a manifest. All earlier changes are flushed to disk before, and the rename itself afterwards.
   subroutine move_manifest(from, to, folder, error)
      character(len=*), intent(in) :: from, to, folder
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(error)) call sync_file(replaced_path(folder), error)
      if (.not. allocated(error)) call sync_file(folder, error)
      if (.not. allocated(error)) call rename_file(from, to, error)
      if (.not. allocated(error)) call sync_file(replaced_path(folder), error)
      if (.not. allocated(error)) call sync_file(folder, error)
   end subroutine move_manifest

   !> Whether a file of the result is never moved to `replaced`
   pure logical function is_excluded(name)
      character(len=*), intent(in) :: name

      is_excluded = name == replaced_name .or. name == lock_name
   end function is_excluded

   !> Path of the subfolder `replaced`
   pure function replaced_path(folder) result(path)
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/'//replaced_name
   end function replaced_path

end module polydem_replaced_result
