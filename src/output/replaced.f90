!> The result that `--force` replaces: it is put aside into the folder `replaced` below that of the result, and stays
!> there until the new run has written its first frame. At any moment a kill leaves the one result whole or the other;
!> the next run in the folder sees by three files what was going on:
!>
!>     manifest.txt   replaced/              what happened, and what is done about it
!>     owns replaced  no list                the former result was being moved: its files are put back
!>     none           manifest.txt           it was moved, and the new run was about to begin: likewise
!>     owns replaced  manifest.txt           the new run has no frame: its files are removed, the former ones put back
!>     owns replaced  obsolete.txt           it has one: what is left of the former result is removed
!>
!> Each step from one row to the next is one renaming of a manifest, in one indivisible step. Only files that the
!> manifests list are moved and removed.
module polydem_replaced
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_folders, only: is_there, remove_folder, true_path
   use polydem_manifest, only: manifest_t
   use polydem_manifest_lines, only: longest_name
   use polydem_name_forms, only: forms_of, in_the_way, manifest_name
   use polydem_paths, only: make_folder, remove_file, rename_file, sync_file
   use polydem_result_folder, only: unfinished
   implicit none
   private
   public :: replaced_name, holds_result, put_aside, drop_replaced, recover, check_inputs

   !> Name of the folder, and of the manifest in it once the former result is not wanted any more
   character(len=*), parameter :: replaced_name = 'replaced', obsolete_name = 'obsolete.txt'
   !> Name of the lock, which is no part of a result
   character(len=*), parameter :: lock_name = 'running.lock'

contains

   !> Whether a folder holds a result, or one that is put aside
   logical function holds_result(folder)
      !> Folder of the result
      character(len=*), intent(in) :: folder

      holds_result = is_there(folder//'/'//manifest_name)
      if (.not. holds_result) holds_result = is_there(aside(folder)//'/'//manifest_name)
   end function holds_result

   !> Refuse to replace a result that the run itself reads from.
   subroutine check_inputs(manifest, folder, inputs, error)
      !> Manifest of the result
      type(manifest_t), intent(in) :: manifest
      !> Its folder
      character(len=*), intent(in) :: folder
      !> Paths of what the run reads, blank-padded; empty ones and those that are not there do not count
      character(len=*), intent(in) :: inputs(:)
      !> Names the input
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: input
      character(len=longest_name + len(unfinished)) :: forms(3)
      logical :: is_own
      integer :: k, j, i

      do i = 1, size(inputs)
         if (inputs(i) == '') cycle
         input = true_path(trim(inputs(i)))
         if (input == '') cycle
         is_own = input == true_path(folder)
         do k = 1, manifest%n
            forms = forms_of(trim(manifest%entry(k)%name))
            do j = 1, size(forms)
               if (.not. is_own) is_own = input == true_path(folder//'/'//trim(forms(j)))
            end do
         end do
         if (is_own) call raise(error, input_error, '--force would replace '//trim(inputs(i))// &
            ', which this run reads. Choose another folder with --set output.folder=NAME, or copy that file first')
      end do
   end subroutine check_inputs

   !> Put the result in a folder aside. Afterwards there is no manifest, and a new one that owns `replaced` must follow.
   subroutine put_aside(manifest, folder, error)
      !> Manifest of the result, which is written to
      type(manifest_t), intent(inout) :: manifest
      !> Its folder, which is locked
      character(len=*), intent(in) :: folder
      !> Allocated on failure; the result is then put back by `recover`
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      call manifest%own(replaced_name, error)
      if (allocated(error)) return
      call make_folder(aside(folder), error)
      do k = 1, manifest%n
         call move(trim(manifest%entry(k)%name), folder, aside(folder), error)
      end do
      call move_manifest(folder//'/'//manifest_name, aside(folder)//'/'//manifest_name, folder, error)
   end subroutine put_aside

   !> Remove the result that was put aside, since the new one has a frame.
   subroutine drop_replaced(manifest, folder, error)
      !> Manifest of the new result, which is written to
      type(manifest_t), intent(inout) :: manifest
      !> Its folder
      character(len=*), intent(in) :: folder
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      if (.not. manifest%owns(replaced_name)) return
      call move_manifest(aside(folder)//'/'//manifest_name, aside(folder)//'/'//obsolete_name, folder, error)
      if (.not. allocated(error)) call clear_obsolete(manifest, folder, error)
   end subroutine drop_replaced

   !> Bring to an end what a run with `--force` began and did not finish, so that there is one result or none.
   subroutine recover(folder, note, error)
      !> Folder of the result, which is locked
      character(len=*), intent(in) :: folder
      !> What was done, if anything was
      character(len=:), allocatable, intent(out) :: note
      !> Why it could not be done
      type(error_t), allocatable, intent(inout) :: error
      type(manifest_t) :: manifest, former
      logical :: was_moved
      integer :: k

      call manifest%read(folder)
      if (allocated(manifest%problem)) return
      if (manifest%is_found .and. .not. manifest%owns(replaced_name)) return
      call manifest%take_up()
      if (is_there(aside(folder)//'/'//obsolete_name)) then
         if (manifest%is_found) call clear_obsolete(manifest, folder, error)
         return
      end if
      call former%read(aside(folder))
      if (former%is_found) then
         if (.not. manifest%is_found .and. .not. former%owns(replaced_name)) return
         if (allocated(former%problem)) then
            call raise(error, io_error, former%problem//'. The folder is that of a result which --force was to '// &
                       'replace; bring the file back from a copy, or move the folder away')
            return
         end if
         do k = 1, manifest%n
            if (is_kept(manifest%entry(k)%name)) cycle
            call manifest%empty(trim(manifest%entry(k)%name), error)
         end do
         call move_manifest(aside(folder)//'/'//manifest_name, folder//'/'//manifest_name, folder, error)
         if (allocated(error)) return
         call manifest%read(folder)
         call manifest%take_up()
      end if
      if (.not. manifest%is_found) return
      call put_back(manifest, folder, was_moved, error)
      if (was_moved .and. .not. allocated(error)) note = 'put back the result in '//folder//': the run that was to '// &
         'replace it (--force) wrote no frame'
   end subroutine recover

   !> Move the files of a result to where they were.
   subroutine put_back(manifest, folder, was_moved, error)
      type(manifest_t), intent(inout) :: manifest
      character(len=*), intent(in) :: folder
      !> Whether any was elsewhere
      logical, intent(out) :: was_moved
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: k

      was_moved = .false.
      do k = 1, manifest%n
         name = trim(manifest%entry(k)%name)
         if (.not. was_moved) was_moved = is_there(aside(folder)//'/'//name)
         call move(name, aside(folder), folder, error)
      end do
      if (.not. allocated(error)) call sync_file(folder, error)
      if (allocated(error)) return
      call remove_folder(aside(folder))
      call manifest%forget(replaced_name, error)
   end subroutine put_back

   !> Remove the files of a former result that is not wanted any more, the list of them last.
   subroutine clear_obsolete(manifest, folder, error)
      type(manifest_t), intent(inout) :: manifest
      character(len=*), intent(in) :: folder
      type(error_t), allocatable, intent(inout) :: error
      type(manifest_t) :: former
      character(len=longest_name + len(unfinished)) :: forms(3)
      character(len=:), allocatable :: path
      integer :: k, j

      call former%read(aside(folder), obsolete_name)
      if (allocated(former%problem)) call raise(error, io_error, former%problem//'. It lists the files of a result '// &
         'that --force has replaced. If this happens again, remove that folder')
      if (allocated(error)) return
      do k = 1, former%n
         if (is_kept(former%entry(k)%name)) cycle
         forms = forms_of(trim(former%entry(k)%name))
         do j = 1, size(forms)
            path = aside(folder)//'/'//trim(forms(j))
            if (is_there(path) .and. .not. allocated(error)) call remove_file(path, error)
         end do
      end do
      if (allocated(error)) return
      call remove_file(aside(folder)//'/'//obsolete_name, error)
      call remove_folder(aside(folder))
      call manifest%forget(replaced_name, error)
   end subroutine clear_obsolete

   !> Move a file, whatever form of it there is, from one folder to another where it must not be.
   subroutine move(name, from, to, error)
      character(len=*), intent(in) :: name, from, to
      type(error_t), allocatable, intent(inout) :: error
      character(len=len(name) + len(unfinished)) :: forms(3)
      integer :: k

      if (is_kept(name)) return
      forms = forms_of(name)
      do k = 1, size(forms)
         if (allocated(error)) return
         if (.not. is_there(from//'/'//trim(forms(k)))) cycle
         if (is_there(to//'/'//trim(forms(k)))) then
            call raise(error, input_error, in_the_way(to//'/'//trim(forms(k))))
         else
            call rename_file(from//'/'//trim(forms(k)), to//'/'//trim(forms(k)), error)
         end if
      end do
   end subroutine move

   !> Rename a manifest once everything before is on the disk, and bring that to disk, too.
   subroutine move_manifest(from, to, folder, error)
      character(len=*), intent(in) :: from, to, folder
      type(error_t), allocatable, intent(inout) :: error

      if (.not. allocated(error)) call sync_file(aside(folder), error)
      if (.not. allocated(error)) call sync_file(folder, error)
      if (.not. allocated(error)) call rename_file(from, to, error)
      if (.not. allocated(error)) call sync_file(aside(folder), error)
      if (.not. allocated(error)) call sync_file(folder, error)
   end subroutine move_manifest

   !> Whether a name of the result is never put aside
   pure logical function is_kept(name)
      character(len=*), intent(in) :: name

      is_kept = name == replaced_name .or. name == lock_name
   end function is_kept

   pure function aside(folder) result(path)
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/'//replaced_name
   end function aside

end module polydem_replaced
