!> The record of the actions of a run: `actions.txt` in its result. `polydem run` repeats a run from it.
!>
!> A program that holds the simulation appends each action before it takes effect, and so before a checkpoint has it.
!> A run with a file of actions has them all in its record from the start, and resumes with them. A line that was not
!> completed, because the program was killed, is no action.
module polydem_action_record
   use polydem_actions, only: action_t, actions_t, add_bodies, line_of, read_action, remove_bodies
   use polydem_choose_methods, only: allow_exchange
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: exists, is_folder, rename_file, sync_file
   use polydem_folders, only: read_bytes
   use polydem_kinds, only: ip, lp
   use polydem_line_writer, only: line_writer_t
   use polydem_result_files, only: actions_name, checkpoint_path, profile_name, unfinished
   use polydem_run, only: run_t
   use polydem_strings, only: counted, to_text
   implicit none
   private
   public :: read_record, take_record, write_record, append_to_record, close_record, read_actions

   !> First line of a file of actions
   character(len=*), parameter :: header = '# polydem actions 1: step, kind, name, number of bodies and '// &
      'identifiers, values (SI units)'

contains

   !> Read the actions of a run: those of a file that is given, or of a result that is continued. All ranks read them.
   !> Collective; all ranks get the same error.
   subroutine read_record(run, error)
      !> The run with its options; `actions` is set if there are any
      type(run_t), intent(inout) :: run
      !> Names the file and the line
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(run%options%actions)) then
         allocate (run%actions)
         call read_actions(run%options%actions, run%actions, error)
      end if
      if (run%options%continues .and. run%options%has_files .and. .not. allocated(error)) call recall_record(run, error)
      call run%comm%all_reduce_error(error)
      if (run%options%is_guest .and. .not. allocated(run%actions)) allocate (run%actions)
   end subroutine read_record

   !> Take the actions that the result has already. A file that is given as well must have the same.
   subroutine recall_record(run, error)
      !> The run with its folder; `actions` are those of the file that is given
      type(run_t), intent(inout) :: run
      !> Names the files
      type(error_t), allocatable, intent(inout) :: error
      type(actions_t), allocatable :: given
      character(len=:), allocatable :: path

      path = run%folder//'/'//actions_name
      if (exists(path, error)) then
         call move_alloc(run%actions, given)
         allocate (run%actions)
         call read_actions(path, run%actions, error)
         if (allocated(given) .and. .not. allocated(error)) call check_same(run%actions, given, error)
      else if (.not. allocated(run%actions)) then
         if (exists(path//unfinished, error)) call raise(error, input_error, path//unfinished//': the run ended '// &
            'while it wrote its actions; give them again with --actions')
      else if (any([exists(checkpoint_path(run%folder, 1_ip)), exists(checkpoint_path(run%folder, 2_ip)), &
                    exists(run%folder//'/'//profile_name)])) then
         call raise(error, input_error, run%actions%file//': the run in '//run%folder//' began without actions, '// &
                    'and goes on without them; leave out --actions')
      end if
   end subroutine recall_record

   !> Check that a file has the actions of a result.
   subroutine check_same(recorded, given, error)
      !> Actions of the result
      type(actions_t), intent(in) :: recorded
      !> Those of the file
      type(actions_t), intent(in) :: given
      !> Names both files, and the first action that differs
      type(error_t), allocatable, intent(inout) :: error
      integer :: k, n

      n = min(recorded%n, given%n)
      do k = 1, n
         if (line_of(recorded%list(k)) /= line_of(given%list(k))) exit
      end do
      if (k > n .and. recorded%n == given%n) return
      call raise(error, input_error, given%file//': differs in action '//to_text(int(k, ip))//' from '// &
                 recorded%file//', with which the run goes on; leave out --actions')
   end subroutine check_same

   !> Read a file of actions.
   subroutine read_actions(path, actions, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      type(actions_t), intent(out) :: actions
      !> Names the file and the line
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text
      type(action_t) :: action
      integer :: first, last, line

      if (is_folder(path, error)) call raise(error, input_error, path//': is a folder, not a file of actions')
      if (.not. exists(path, error)) call raise(error, input_error, path//': there is no such file')
      if (.not. allocated(error)) call read_bytes(path, text, error)
      if (allocated(error)) return
      actions%file = path
      line = 0
      first = 1
      do
         last = index(text(first:), new_line('a')) + first - 2
         if (last < first - 1) return
         line = line + 1
         associate (words => text(first:last))
            if (len_trim(words) > 0 .and. index(adjustl(words), '#') /= 1) then
               call read_action(words, action, error)
               if (actions%n > 0 .and. .not. allocated(error)) then
                  if (action%step < actions%list(actions%n)%step) call raise(error, input_error, 'step '// &
                     to_text(action%step)//' follows step '//to_text(actions%list(actions%n)%step))
               end if
               if (allocated(error)) then
                  error%message = path//':'//to_text(int(line, ip))//': '//error%message
                  return
               end if
               call actions%append(action)
            end if
         end associate
         first = last + 2
      end do
   end subroutine read_actions

   !> Give the actions to the simulation. A program that resumes a run records its actions after the checkpoint again;
   !> those that it recorded directly after the step of the checkpoint have yet to take effect.
   subroutine take_record(run, step)
      !> The run with its simulation, before a checkpoint is restored
      type(run_t), intent(inout) :: run
      !> Step of the checkpoint; 0: there is none
      integer(lp), intent(in) :: step
      integer :: k

      if (.not. allocated(run%actions)) return
      associate (actions => run%actions)
         do k = 1, actions%n
            run%options%exchanges = run%options%exchanges .or. any(actions%list(k)%kind == [add_bodies, remove_bodies])
         end do
         if (run%options%is_guest .and. run%options%continues) then
            do while (actions%n > 0)
               if (actions%list(actions%n)%step <= step) exit
               actions%n = actions%n - 1
            end do
         end if
      end associate
      if (run%options%exchanges) call allow_exchange(run%simulation)
      call move_alloc(run%actions, run%simulation%actions)
   end subroutine take_record

   !> Write the record of the actions that are known at the start, if there are any. Called by the root rank only.
   subroutine write_record(run, error)
      !> The run with its folder
      type(run_t), intent(inout) :: run
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path
      type(line_writer_t) :: file
      integer :: k

      if (.not. allocated(run%simulation%actions) .or. allocated(error)) return
      path = run%folder//'/'//actions_name
      associate (actions => run%simulation%actions)
         if (actions%n == 0 .and. .not. run%manifest%owns(actions_name)) return
         call run%log%write_line('actions    '//counted(int(actions%n, lp), 'action')//' of '//actions%file)
         call run%manifest%add_file(path, error)
         call run%manifest%reopen(path, error)
         if (.not. allocated(error)) call file%open(path//unfinished, error)
         call file%put_line(header)
         do k = 1, actions%n
            call file%put_line(line_of(actions%list(k)))
         end do
         call file%close(error)
         if (.not. allocated(error)) call sync_file(path//unfinished, error)
         if (.not. allocated(error)) call rename_file(path//unfinished, path, error)
         call run%manifest%close_file(path, error)
      end associate
   end subroutine write_record

   !> Append an action to the record, before it takes effect.
   subroutine append_to_record(run, action, error)
      !> The run with its folder
      type(run_t), intent(inout) :: run
      type(action_t), intent(in) :: action
      !> Allocated if it cannot be written
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: path
      logical :: is_new

      path = run%folder//'/'//actions_name
      if (.not. run%records_actions) then
         is_new = .not. exists(path)
         call run%manifest%add_file(path, error)
         call run%manifest%reopen(path, error)
         if (.not. allocated(error)) call run%action_file%open(path, error, appended=.true.)
         if (allocated(error)) return
         run%records_actions = .true.
         if (is_new) call run%action_file%put_line(header)
      end if
      call run%action_file%put_line(line_of(action))
      call run%action_file%check(error)
   end subroutine append_to_record

   !> Complete the record, before a checkpoint or at the end of the run; the next action opens it again.
   subroutine close_record(run, error)
      type(run_t), intent(inout) :: run
      !> Allocated if it cannot be written
      type(error_t), allocatable, intent(inout) :: error

      if (.not. run%records_actions) return
      call run%action_file%close(error)
      call run%manifest%close_file(run%folder//'/'//actions_name, error)
      run%records_actions = .false.
   end subroutine close_record

end module polydem_action_record
