!> The verb `info --check`: compares every file of a result with the manifest of its folder.
module polydem_check_result
   use polydem_checked_files, only: check_manifest, find_problem, find_segments, find_stranger
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_file_checksum, only: verify_checksum
   use polydem_file_system, only: is_folder
   use polydem_folders, only: link_exists, list_names
   use polydem_kinds, only: ip
   use polydem_log, only: log_t
   use polydem_manifest, only: entry_t, manifest_t
   use polydem_result_files, only: checkpoint_path, complete_name, forms_of, is_table, manifest_name, n_checkpoints, &
      name_in, profile_name, segment_number, steps_name, trace_name
   use polydem_strings, only: to_text, counted
   implicit none
   private
   public :: check_result

   !> Findings of a check
   type :: findings_t
      !> Log on the screen
      type(log_t) :: log
      !> Number of files checked, and number of files that are wrong
      integer(ip) :: n_files = 0_ip, n_wrong = 0_ip
   end type findings_t

contains

   !> Check the result in a folder and print one line per file.
   subroutine check_result(folder, error)
      !> Result folder
      character(len=*), intent(in) :: folder
      !> Allocated unless every file matches the manifest
      type(error_t), allocatable, intent(inout) :: error
      type(manifest_t) :: manifest
      type(findings_t) :: findings
      integer :: k

      if (.not. is_folder(folder, error)) then
         call raise(error, input_error, folder//': there is no such result folder')
         return
      end if
      call manifest%read(folder)
      if (manifest%is_unread) then
         call check_manifest(manifest, error)
         return
      end if
      if (.not. manifest%is_found) then
         call raise(error, io_error, folder//': has no '//manifest_name//', so no file can be checked')
         return
      end if
      call findings%log%open('', error)
      call report_file(findings, manifest_name, manifest%problem, &
         'lists '//to_text(int(manifest%n, ip))//' files')
      if (.not. allocated(manifest%problem)) then
         do k = 1, manifest%n
            call check_entry(folder, manifest%run, manifest%entry(k), findings, error)
         end do
         call check_order(folder, manifest, findings)
         call check_others(folder, manifest, findings, error)
      end if
      if (findings%n_wrong > 0_ip) call raise(error, io_error, folder//': '//to_text(findings%n_wrong)//' of '// &
         to_text(findings%n_files)//' files are wrong; see the lines marked WRONG')
      if (.not. allocated(error)) call findings%log%write_line(folder//': all '//to_text(findings%n_files)// &
         ' files are intact')
      call findings%log%close(error)
   end subroutine check_result

   !> Check one file that the manifest lists.
   subroutine check_entry(folder, run, entry, findings, error)
      character(len=*), intent(in) :: folder, run
      type(entry_t), intent(in) :: entry
      type(findings_t), intent(inout) :: findings
      !> First file that cannot be read, which is not counted as wrong
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: failure
      character(len=:), allocatable :: name, problem, note
      integer(ip) :: k

      name = trim(entry%name)
      call check_unfinished(folder, name, findings, error)
      if (entry%is_closed) then
         call find_problem(folder, entry, problem, failure)
         if (allocated(problem) .and. is_table(name)) problem = problem//'; --continue makes it again'
         note = to_text(entry%bytes)//' bytes'
         if (segment_number(name) > 0_ip) note = note//', '//counted(entry%frames(1), 'frame')//', steps '// &
            to_text(entry%frames(2))//' to '//to_text(entry%frames(3))
         call report_entry()
         return
      end if
      if (.not. link_exists(folder//'/'//name, error)) return
      note = 'present, has no checksum'
      if (gets_closed(name)) problem = 'has no checksum: the run was killed before it recorded one, or is about '// &
         'to record it; --continue repairs this'
      do k = 1_ip, n_checkpoints
         if (name /= name_in(checkpoint_path('', k))) cycle
         call verify_checksum(folder//'/'//name, problem, failure)
         if (.not. (allocated(problem) .or. allocated(failure))) &
            call find_stranger(folder//'/'//name, run, problem, failure)
         note = 'its checksum is correct'
      end do
      call report_entry()

   contains

      subroutine report_entry()
         if (.not. allocated(failure)) then
            call report_file(findings, name, problem, note)
         else if (.not. allocated(error)) then
            call move_alloc(failure, error)
         end if
      end subroutine report_entry

   end subroutine check_entry

   !> Report the incomplete forms of a file, which a running or killed run has.
   subroutine check_unfinished(folder, name, findings, error)
      character(len=*), intent(in) :: folder, name
      type(findings_t), intent(inout) :: findings
      type(error_t), allocatable, intent(inout) :: error
      character(len=len(name) + 16) :: forms(3)
      character(len=:), allocatable :: problem
      integer :: k

      forms = forms_of(name)
      do k = 2, size(forms)
         if (link_exists(folder//'/'//trim(forms(k)), error)) call report_file(findings, trim(forms(k)), problem, &
            'is incomplete')
      end do
   end subroutine check_unfinished

   !> Check that segments have consecutive numbers and ascending steps.
   subroutine check_order(folder, manifest, findings)
      character(len=*), intent(in) :: folder
      type(manifest_t), intent(in) :: manifest
      type(findings_t), intent(inout) :: findings
      character(len=:), allocatable :: problem
      integer, allocatable :: places(:)

      call find_segments(manifest, folder, places, problem)
      if (allocated(problem)) call report_file(findings, manifest_name, problem, '')
   end subroutine check_order

   !> Report files that have the name of a segment or of the profile but are not in the manifest. A reader would take
   !> them for files of the result.
   subroutine check_others(folder, manifest, findings, error)
      character(len=*), intent(in) :: folder
      type(manifest_t), intent(in) :: manifest
      type(findings_t), intent(inout) :: findings
      type(error_t), allocatable, intent(inout) :: error
      character(len=255), allocatable :: found(:)
      character(len=:), allocatable :: name, problem
      integer :: k

      call list_names(folder, found, error)
      problem = 'has the name of a result file, but is not listed in '//manifest_name
      do k = 1, size(found)
         name = complete_name(trim(found(k)))
         if (segment_number(name) == 0_ip .and. name /= profile_name) cycle
         if (.not. manifest%owns(name)) call report_file(findings, trim(found(k)), problem, '')
      end do
   end subroutine check_others

   !> Whether the manifest records a checksum of a file when the file is complete
   logical function gets_closed(name)
      character(len=*), intent(in) :: name

      gets_closed = segment_number(name) > 0_ip .or. name == profile_name .or. name == trace_name .or. &
                    name == steps_name .or. is_table(name)
   end function gets_closed

   !> Count a file and write its line.
   subroutine report_file(findings, name, problem, note)
      type(findings_t), intent(inout) :: findings
      character(len=*), intent(in) :: name
      !> Problem with the file; unallocated if there is none
      character(len=:), allocatable, intent(in) :: problem
      !> Note on a file without a problem
      character(len=*), intent(in) :: note

      findings%n_files = findings%n_files + 1_ip
      if (allocated(problem)) then
         findings%n_wrong = findings%n_wrong + 1_ip
         call findings%log%write_line('WRONG  '//name//'  '//problem)
      else
         call findings%log%write_line('ok     '//name//'  '//note)
      end if
   end subroutine report_file

end module polydem_check_result
