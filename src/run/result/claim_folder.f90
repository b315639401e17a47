!> Claiming a result folder: the manifest lists the files of a run before the run writes any of them.
module polydem_claim_folder
   use polydem_checked_files, only: check_free, check_manifest
   use polydem_errors, only: error_t, input_error, raise
   use polydem_folder_lock, only: folder_lock_t, lock_path
   use polydem_kinds, only: ip
   use polydem_manifest, only: longest_name, manifest_t
   use polydem_table_file, only: table_path
   use polydem_result_files, only: actions_name, checkpoint_path, log_name, n_checkpoints, name_in, overlaps_name, &
      profile_name, series_name, steps_name, trace_name
   use polydem_set_aside, only: set_aside
   use polydem_settings, only: output_settings_t, settings_t
   implicit none
   private
   public :: check_overwrite, claim_folder

contains

   !> Refuse to overwrite a result, and to use a folder whose manifest is damaged. Called by the root rank only.
   subroutine check_overwrite(folder, is_allowed, manifest, error)
      !> Result folder
      character(len=*), intent(in) :: folder
      !> Whether the result is continued or replaced
      logical, intent(in) :: is_allowed
      !> Manifest of the folder, which is read
      type(manifest_t), intent(inout) :: manifest
      !> Allocated if the run must not use the folder
      type(error_t), allocatable, intent(inout) :: error

      call manifest%read(folder)
      call check_manifest(manifest, error)
      if (is_allowed .or. .not. manifest%is_found) return
      call raise(error, input_error, folder//' already holds a result; add --continue to resume it or --force to '// &
                 'set it aside and start again, or choose another folder with --set output.folder=NAME')
   end subroutine check_overwrite

   !> Begin the manifest of a run, or continue that of previous starts. The folder of a result to be replaced is
   !> renamed.
   subroutine claim_folder(settings, has_deep_contacts, folder, force, is_restart, shares, lock, note, manifest, error)
      type(settings_t), intent(in) :: settings
      !> Whether the run writes a table of deep contacts
      logical, intent(in) :: has_deep_contacts
      !> Result folder; this run holds its lock
      character(len=*), intent(in) :: folder
      !> Whether the run replaces an existing result
      logical, intent(in) :: force
      !> Whether the run keeps the files of previous starts
      logical, intent(in) :: is_restart
      !> Whether other ranks of the run share the lock
      logical, intent(in) :: shares
      !> Lock of the folder
      type(folder_lock_t), intent(inout) :: lock
      !> Sentence for the log about a result that was set aside
      character(len=:), allocatable, intent(inout) :: note
      !> On entry the valid manifest of the folder, or none; on return that of this run
      type(manifest_t), intent(inout) :: manifest
      !> Allocated if a file is in the way; names the file. The folder is then unchanged
      type(error_t), allocatable, intent(inout) :: error
      character(len=longest_name), allocatable :: names(:)
      character(len=longest_name) :: lock_name
      integer :: k

      call list_output_names(settings%output, has_deep_contacts, names)
      lock_name = name_in(lock_path(''))
      if (force .and. manifest%is_found) then
         call set_aside(folder, input_paths(settings), shares, lock, note, error)
         manifest%is_found = .false.
      end if
      if (.not. allocated(error)) call check_free(manifest, folder, names, error)
      if (.not. manifest%is_found) then
         if (.not. allocated(error)) call manifest%begin(folder, [lock_name, names], error)
      else
         call manifest%continue_writing()
         do k = 1, size(names)
            call manifest%add_file(trim(names(k)), error)
         end do
         do k = 1, merge(0, manifest%n, is_restart)
            ! A run that begins anew after a kill has its actions from there only.
            if (manifest%entry(k)%name == actions_name) cycle
            if (manifest%entry(k)%name /= lock_name .and. .not. allocated(error)) &
               call manifest%remove_file(trim(manifest%entry(k)%name), error)
         end do
      end if
   end subroutine claim_folder

   !> Paths of the input files of a run: namelist, bodies file, packings, tables; empty where the scene reads no such
   !> file
   function input_paths(settings) result(inputs)
      type(settings_t), intent(in) :: settings
      character(len=:), allocatable :: inputs(:)
      integer :: k, longest_path

      associate (file => settings%file, scene => settings%scene, grains => settings%grains, motions => settings%motion)
         longest_path = max(len(file), len(scene%bodies_file), len(scene%packing))
         do k = 1, size(grains)
            longest_path = max(longest_path, len(grains(k)%packing))
         end do
         do k = 1, size(motions)
            longest_path = max(longest_path, len(table_path(settings, motions(k))))
         end do
         allocate (character(len=longest_path) :: inputs(3 + size(grains) + size(motions)))
         inputs(1) = file
         inputs(2) = scene%bodies_file
         inputs(3) = scene%packing
         do k = 1, size(grains)
            inputs(3 + k) = grains(k)%packing
         end do
         do k = 1, size(motions)
            inputs(3 + size(grains) + k) = table_path(settings, motions(k))
         end do
      end associate
   end function input_paths

   !> Names of the files that a run can write, without segments
   subroutine list_output_names(output, has_deep_contacts, names)
      type(output_settings_t), intent(in) :: output
      logical, intent(in) :: has_deep_contacts
      character(len=longest_name), allocatable, intent(out) :: names(:)
      integer(ip) :: k

      allocate (names(2))
      names = [character(len=longest_name) :: log_name, profile_name]
      do k = 1_ip, n_checkpoints
         names = [character(len=longest_name) :: names, name_in(checkpoint_path('', k))]
      end do
      if (output%trace_steps > 0_ip) names = [character(len=longest_name) :: names, trace_name]
      if (output%step_profile) names = [character(len=longest_name) :: names, steps_name]
      if (has_deep_contacts) names = [character(len=longest_name) :: names, overlaps_name]
      if (output%csv) names = [character(len=longest_name) :: names, series_name]
   end subroutine list_output_names

end module polydem_claim_folder
