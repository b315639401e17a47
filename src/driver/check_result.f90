!> Whether a result is whole: its manifest, and every file against it.
module polydem_check_result
   use polydem_checked_files, only: find_problem, find_segments
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_folders, only: is_there, list_names
   use polydem_kinds, only: ip
   use polydem_log, only: log_t
   use polydem_manifest, only: manifest_t
   use polydem_manifest_lines, only: entry_t
   use polydem_name_forms, only: complete_name, forms_of, manifest_name
   use polydem_paths, only: is_folder
   use polydem_replaced, only: replaced_name
   use polydem_result_folder, only: checkpoint_path, n_checkpoints, name_in, overlaps_path, profile_path, &
      segment_number, steps_path, trace_path
   use polydem_sealed_file, only: check_seal
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_result

   !> What was found so far
   type :: findings_t
      !> Where it is written
      type(log_t) :: log
      !> Files looked at, and those of them that are not as they were written
      integer(ip) :: n_files = 0_ip, n_wrong = 0_ip
   end type findings_t

contains

   !> Check the result in a folder, and print a line for each of its files.
   subroutine check_result(folder, error)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Allocated unless every file is as it was written
      type(error_t), allocatable, intent(inout) :: error
      type(manifest_t) :: manifest
      type(findings_t) :: findings
      integer :: k

      if (.not. is_folder(folder)) then
         call raise(error, input_error, folder//': is not the folder of a result')
         return
      end if
      call manifest%read(folder)
      if (.not. manifest%is_found) then
         call raise(error, io_error, folder//': has no '//manifest_name//', so nothing can be checked. It holds no '// &
                    'result, or that of an older version of this program')
         return
      end if
      call findings%log%open('', error)
      call tell(findings, manifest_name, manifest%problem, whole_manifest(manifest))
      if (.not. allocated(manifest%problem)) then
         do k = 1, manifest%n
            call check_entry(folder, manifest%entry(k), findings)
         end do
         call check_order(folder, manifest, findings)
         call check_others(folder, manifest, findings, error)
      end if
      if (findings%n_wrong > 0_ip) call raise(error, io_error, folder//': '//to_text(findings%n_wrong)//' of '// &
         to_text(findings%n_files)//' files are not as they should be')
      if (findings%n_wrong == 0_ip) call findings%log%write_line(folder//': all of '//to_text(findings%n_files)// &
         ' files are as they were written')
      call findings%log%close(error)
   end subroutine check_result

   function whole_manifest(manifest) result(text)
      type(manifest_t), intent(in) :: manifest
      character(len=:), allocatable :: text

      text = 'lists '//to_text(int(manifest%n, ip))//' files'
      if (manifest%is_torn) text = text//'; its last line was left in the middle, which is no harm'
   end function whole_manifest

   !> Look at a file that the manifest lists.
   subroutine check_entry(folder, entry, findings)
      character(len=*), intent(in) :: folder
      type(entry_t), intent(in) :: entry
      type(findings_t), intent(inout) :: findings
      character(len=:), allocatable :: name, problem, remark
      integer(ip) :: k

      name = trim(entry%name)
      if (name == replaced_name) then
         problem = 'a run with --force was interrupted; the next run in this folder puts the former result back, '// &
            'or removes what is left of it'
         call tell(findings, name, problem, '')
         return
      end if
      call check_unfinished(folder, name, findings)
      if (entry%is_closed) then
         call find_problem(folder, entry, problem)
         remark = to_text(entry%bytes)//' bytes'
         if (segment_number(name) > 0_ip) remark = remark//', '//to_text(entry%frames(1))//' frames, steps '// &
            to_text(entry%frames(2))//' to '//to_text(entry%frames(3))
         call tell(findings, name, problem, remark)
         return
      end if
      if (.not. is_there(folder//'/'//name)) return
      remark = 'there, without a checksum'
      if (gets_closed(name)) problem = 'has no checksum: the run was killed before it wrote that down, or is just '// &
         'about to; --continue looks after it'
      do k = 1_ip, n_checkpoints
         if (name /= name_in(checkpoint_path('', k))) cycle
         call check_seal(folder//'/'//name, problem)
         remark = 'its seal is right'
      end do
      call tell(findings, name, problem, remark)
   end subroutine check_entry

   !> Say which files are not complete, as a run that goes on or was killed has them.
   subroutine check_unfinished(folder, name, findings)
      character(len=*), intent(in) :: folder, name
      type(findings_t), intent(inout) :: findings
      character(len=len(name) + 16) :: forms(3)
      character(len=:), allocatable :: problem
      integer :: k

      forms = forms_of(name)
      do k = 2, size(forms)
         if (is_there(folder//'/'//trim(forms(k)))) call tell(findings, trim(forms(k)), problem, 'is not complete')
      end do
   end subroutine check_unfinished

   !> Segments must have consecutive numbers and ascending steps.
   subroutine check_order(folder, manifest, findings)
      character(len=*), intent(in) :: folder
      type(manifest_t), intent(in) :: manifest
      type(findings_t), intent(inout) :: findings
      character(len=:), allocatable :: problem
      integer, allocatable :: places(:)

      call find_segments(manifest, folder, places, problem)
      if (allocated(problem)) call tell(findings, manifest_name, problem, '')
   end subroutine check_order

   !> Name files that a reader would take for ones of the result, but that are not.
   subroutine check_others(folder, manifest, findings, error)
      character(len=*), intent(in) :: folder
      type(manifest_t), intent(in) :: manifest
      type(findings_t), intent(inout) :: findings
      type(error_t), allocatable, intent(inout) :: error
      character(len=255), allocatable :: found(:)
      character(len=:), allocatable :: name, problem
      integer :: k

      call list_names(folder, found, error)
      problem = 'has a name of the result, but is not listed in '//manifest_name
      do k = 1, size(found)
         name = complete_name(trim(found(k)))
         if (segment_number(name) == 0_ip .and. name /= name_in(profile_path(''))) cycle
         if (.not. manifest%owns(name)) call tell(findings, trim(found(k)), problem, '')
      end do
   end subroutine check_others

   !> Whether a file gets a checksum when it is complete
   logical function gets_closed(name)
      character(len=*), intent(in) :: name

      gets_closed = segment_number(name) > 0_ip .or. name == name_in(profile_path('')) .or. &
                    name == name_in(trace_path('')) .or. name == name_in(steps_path('')) .or. &
                    name == name_in(overlaps_path(''))
   end function gets_closed

   !> Write the line of a file.
   subroutine tell(findings, name, problem, remark)
      type(findings_t), intent(inout) :: findings
      character(len=*), intent(in) :: name
      !> What is wrong with it, if anything is
      character(len=:), allocatable, intent(in) :: problem
      !> What is said if nothing is
      character(len=*), intent(in) :: remark

      findings%n_files = findings%n_files + 1_ip
      if (allocated(problem)) then
         findings%n_wrong = findings%n_wrong + 1_ip
         call findings%log%write_line('WRONG  '//name//'  '//problem)
      else
         call findings%log%write_line('ok     '//name//'  '//remark)
      end if
   end subroutine tell

end module polydem_check_result
