!> The lock of a result folder: while a run writes there, `running.lock` names its process and machine.
!>
!> The file is made in one indivisible step, so only one of several runs gets it. A run that is killed leaves it
!> behind; the next one on the same machine sees that the process is gone, and takes the folder over.
module polydem_run_lock
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_kinds, only: ip
   use polydem_line_writer, only: line_writer_t
   use polydem_machine, only: host_name
   use polydem_paths, only: exists, remove_file, rename_file
   use polydem_processes, only: lives, own_process
   use polydem_strings, only: to_text
   implicit none
   private
   public :: lock_result, unlock_result, lock_path

   !> Who holds a lock
   type :: owner_t
      !> Number of the process; 0 if it cannot be read
      integer(ip) :: process = 0_ip
      !> Name of its machine
      character(len=256) :: host = ''
   end type owner_t

contains

   !> Path of the lock
   pure function lock_path(folder) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/running.lock'
   end function lock_path

   !> Keep other runs out of a folder until `unlock_result`.
   subroutine lock_result(folder, note, error)
      !> Folder of the result, which must be there
      character(len=*), intent(in) :: folder
      !> A line for the log if the lock of a dead run was taken over, else not allocated
      character(len=:), allocatable, intent(out) :: note
      !> Allocated if another run holds the folder, or if the lock cannot be made
      type(error_t), allocatable, intent(inout) :: error
      type(owner_t) :: owner
      character(len=:), allocatable :: reason
      logical :: made

      call make_lock(folder, made, reason)
      if (.not. made) then
         if (.not. exists(lock_path(folder))) then
            call raise(error, io_error, lock_path(folder)//': cannot be made: '//reason)
            return
         end if
         owner = owner_of(lock_path(folder))
         call refuse_the_living(folder, owner, error)
         if (.not. allocated(error)) call drop_lock(folder, owner, error)
         if (allocated(error)) return
         call make_lock(folder, made, reason)
         if (.not. made) then
            call raise(error, input_error, just_begun(folder))
            return
         end if
         note = 'took over '//lock_path(folder)//' of process '//to_text(owner%process)//', which has ended'
      end if
      call sign_lock(folder, error)
   end subroutine lock_result

   !> Let other runs into a folder; nothing happens unless this process holds its lock.
   subroutine unlock_result(folder)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      type(error_t), allocatable :: ignored

      if (is_own(owner_of(lock_path(folder)))) call remove_file(lock_path(folder), ignored)
   end subroutine unlock_result

   !> Remove the lock of a dead run. It is put aside first, in one indivisible step: another run may have seen the same
   !> dead one, and what is put aside may already be its lock, which it gets back.
   subroutine drop_lock(folder, dead, error)
      character(len=*), intent(in) :: folder
      type(owner_t), intent(in) :: dead
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: ignored
      type(owner_t) :: owner
      character(len=:), allocatable :: aside

      aside = lock_path(folder)//'.'//to_text(own_process())
      call rename_file(lock_path(folder), aside, error)
      if (allocated(error)) then
         if (.not. exists(lock_path(folder))) then
            error%code = input_error
            error%message = just_begun(folder)
         end if
         return
      end if
      owner = owner_of(aside)
      if (owner%process == dead%process .and. owner%host == dead%host) then
         call remove_file(aside, error)
      else
         call rename_file(aside, lock_path(folder), ignored)
         call raise(error, input_error, just_begun(folder))
      end if
   end subroutine drop_lock

   function just_begun(folder) result(message)
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: message

      message = folder//': another run has just begun in this folder; choose another one'
   end function just_begun

   !> Make the empty file of a lock, which fails if it is there.
   subroutine make_lock(folder, made, reason)
      character(len=*), intent(in) :: folder
      logical, intent(out) :: made
      character(len=:), allocatable, intent(out) :: reason
      character(len=256) :: words
      integer :: unit, status

      open (newunit=unit, file=lock_path(folder), status='new', action='write', iostat=status, iomsg=words)
      made = status == 0
      if (made) close (unit)
      reason = trim(words)
   end subroutine make_lock

   !> Write process and machine into a new lock.
   subroutine sign_lock(folder, error)
      character(len=*), intent(in) :: folder
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: ignored
      type(line_writer_t) :: writer

      call writer%open(lock_path(folder), error)
      call writer%put_line(to_text(own_process())//' '//host_name())
      call writer%close(error)
      if (allocated(error)) call remove_file(lock_path(folder), ignored)
   end subroutine sign_lock

   function owner_of(path) result(owner)
      character(len=*), intent(in) :: path
      type(owner_t) :: owner
      integer :: unit, status

      open (newunit=unit, file=path, status='old', action='read', iostat=status)
      if (status /= 0) return
      read (unit, *, iostat=status) owner%process, owner%host
      if (status /= 0) owner = owner_t()
      close (unit)
   end function owner_of

   logical function is_own(owner)
      type(owner_t), intent(in) :: owner

      is_own = owner%process == own_process()
      if (is_own) is_own = owner%host == host_name()
   end function is_own

   !> Raise an error unless the owner is certainly dead. A lock with the number of this process was left by another one
   !> that had the same number, as happens in containers.
   subroutine refuse_the_living(folder, owner, error)
      character(len=*), intent(in) :: folder
      type(owner_t), intent(in) :: owner
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: holder

      if (is_own(owner)) return
      if (owner%process < 1_ip) then
         holder = 'an unknown process'
      else if (owner%host /= host_name()) then
         holder = 'process '//to_text(owner%process)//' on the machine '//trim(owner%host)
      else if (lives(owner%process)) then
         holder = 'process '//to_text(owner%process)
      else
         return
      end if
      call raise(error, input_error, folder//': another run ('//holder//') writes into this folder; wait for its '// &
                 "end or choose another folder with --set output.folder=NAME. If there is no such run, remove '"// &
                 lock_path(folder)//"'")
   end subroutine refuse_the_living

end module polydem_run_lock
