!> Making a folder that of a run: what the run will write there becomes its own before it writes anything.
module polydem_claim_folder
   use polydem_checked_files, only: check_free
   use polydem_description, only: has_deep_contacts
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip
   use polydem_manifest, only: manifest_t
   use polydem_replaced, only: check_inputs, put_aside, replaced_name
   use polydem_result_folder, only: checkpoint_path, log_path, n_checkpoints, name_in, overlaps_path, profile_path, &
      steps_path, trace_path
   use polydem_run_lock, only: lock_path
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: claim_folder

   !> Longest name of a file of a result
   integer, parameter :: longest = 32

contains

   !> Begin the manifest of a run, or go on with that of former attempts. A result that is overwritten is put aside.
   subroutine claim_folder(simulation, folder, force, goes_on, manifest, error)
      !> Simulation at its start
      type(simulation_t), intent(in) :: simulation
      !> Folder of the result, which is locked
      character(len=*), intent(in) :: folder
      !> Whether a result that is there is overwritten
      logical, intent(in) :: force
      !> Whether what former attempts left stays
      logical, intent(in) :: goes_on
      !> Good manifest of the folder, or none; afterwards that of this run
      type(manifest_t), intent(inout) :: manifest
      !> What is in the way; then nothing was changed
      type(error_t), allocatable, intent(inout) :: error
      character(len=longest), allocatable :: names(:)
      character(len=longest) :: lock
      integer :: k

      call list_own_names(simulation, names)
      call check_free(manifest, folder, names, error)
      lock = name_in(lock_path(''))
      if (.not. manifest%is_found) then
         if (.not. allocated(error)) call manifest%begin(folder, [lock, names], error)
      else if (force) then
         call check_inputs(manifest, folder, inputs_of(simulation), error)
         call manifest%take_up()
         if (.not. allocated(error)) call put_aside(manifest, folder, error)
         names = [character(len=longest) :: lock, names, replaced_name]
         if (.not. allocated(error)) call manifest%begin(folder, names, error)
      else
         call manifest%take_up()
         do k = 1, size(names)
            call manifest%own(trim(names(k)), error)
         end do
         do k = 1, merge(0, manifest%n, goes_on)
            if (manifest%entry(k)%name /= lock .and. .not. allocated(error)) &
               call manifest%empty(trim(manifest%entry(k)%name), error)
         end do
      end if
   end subroutine claim_folder

   !> Paths of what a run reads; a scene that reads no such file has an empty one
   function inputs_of(simulation) result(inputs)
      type(simulation_t), intent(in) :: simulation
      character(len=:), allocatable :: inputs(:)

      associate (file => simulation%settings%file, scene => simulation%settings%scene)
         allocate (character(len=max(len(file), len(scene%bodies_file), len(scene%packing))) :: inputs(3))
         inputs(1) = file
         inputs(2) = scene%bodies_file
         inputs(3) = scene%packing
      end associate
   end function inputs_of

   !> The names of the files that a run may write, but for segments
   subroutine list_own_names(simulation, names)
      type(simulation_t), intent(in) :: simulation
      character(len=longest), allocatable, intent(out) :: names(:)
      integer(ip) :: k

      allocate (names(2))
      names = [character(len=longest) :: name_in(log_path('')), name_in(profile_path(''))]
      do k = 1_ip, n_checkpoints
         names = [character(len=longest) :: names, name_in(checkpoint_path('', k))]
      end do
      associate (output => simulation%settings%output)
         if (output%trace_steps > 0_ip) names = [character(len=longest) :: names, name_in(trace_path(''))]
         if (output%step_profile) names = [character(len=longest) :: names, name_in(steps_path(''))]
      end associate
      if (has_deep_contacts(simulation)) names = [character(len=longest) :: names, name_in(overlaps_path(''))]
   end subroutine list_own_names

end module polydem_claim_folder
