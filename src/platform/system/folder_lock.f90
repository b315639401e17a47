!> The lock of a result folder. A run holds the lock file `running.lock` while it writes to the folder. The file names
!> the process and the machine of the run.
!>
!> *One machine.* The kernel locks the open file (`lock_file.f90`) and releases the lock when the run ends in any way. A
!> killed run leaves an unlocked file, with or without text. Reused process identifiers do no harm.
!>
!> *Creation and removal.* A process that has locked the file writes a new key into it and reads the key back through
!> the path. The process is the holder if it reads its own key; else it starts again. At most one process is the holder:
!> (1) Only the holder removes the file, and it does so while it has the lock. (2) Therefore, while a process holds the
!> file, no other process can make the path refer to another file. (3) A process that locks an already removed file
!> reads no key or another key through the path. The ranks of a run share its lock. A rank that outlives the root rank
!> keeps other runs out until it ends. Another run may get the lock while an exclusive lock changes to a shared lock, so
!> the key is read again after the change.
!>
!> *Several machines* may not share their kernel locks, and some file systems have no locks. The holder therefore
!> increments a counter in the lock file every `beat` seconds (`heartbeat.f90`). A lock that belongs to another kernel,
!> or that no kernel guards, is watched. If the counter changes, the run is alive. If nothing changes for `watch`
!> seconds, the lock is taken over. Clocks of different machines are never compared. A watch starts again if the
!> watching process itself was paused. The new holder writes its key and waits `settle` seconds, because another
!> watching process may do the same. It continues if the file still contains its key.
!>
!> *Limit.* A thread increments the counter, so long steps and checkpoints do not delay it. If a run is stopped or loses
!> access to its files for longer than `watch` seconds, a run on another machine may take over the lock. The first run
!> finds another key in the lock file before it writes the next frame, checkpoint or line, and ends (`check`). It does
!> complete the call in progress.
!>
!> An older version wrote one line of text without a key and used no kernel lock. Such a lock on this machine is valid
!> while its process is alive and runs this program.
module polydem_folder_lock
   use polydem_clock, only: wall_seconds
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_file_system, only: last_failure, remove_file
   use polydem_heartbeat, only: heartbeat_t
   use polydem_kinds, only: dp, ip
   use polydem_line_writer, only: line_writer_t
   use polydem_lock_file, only: is_busy, is_granted, is_unsupported, lock_file_t
   use polydem_lock_owner, only: key_length, new_key, owner_of, owner_t, count_offset, key_offset, text_of
   use polydem_processes, only: runs_same_program, is_running, own_process, wait_for
   use polydem_strings, only: to_text
   implicit none
   private
   public :: folder_lock_t, lock_times_t, lock_path

   !> Time constants of locks [s]
   type :: lock_times_t
      !> Interval of the heartbeat
      real(dp) :: beat = 10.0_dp
      !> Time without a heartbeat after which a lock is taken over. Six beats are then missing, and data written to a
      !> network file system reach other machines within some seconds
      real(dp) :: watch = 60.0_dp
      !> Time until text that another machine writes at the same moment can be read
      real(dp) :: settle = 2.0_dp
      !> Wait for a run that is about to end; five times longer if its process has ended but its ranks or the kernel
      !> still hold the lock
      real(dp) :: patience = 1.0_dp
   end type lock_times_t

   !> The lock of a result folder, held or not
   type :: folder_lock_t
      private
      !> Path of the lock; not allocated if it is not held
      character(len=:), allocatable :: path
      !> Key in the lock file while this process holds it
      character(len=key_length) :: key = ''
      type(lock_file_t) :: file
      type(heartbeat_t) :: heartbeat
   contains
      procedure :: acquire
      procedure :: join
      procedure :: check
      procedure :: is_held
      procedure :: release
   end type folder_lock_t

   !> Observations of a lock that another run holds or held
   type :: observation_t
      !> Time constants
      type(lock_times_t) :: times
      !> Owner at the last check
      type(owner_t) :: owner
      !> Times of the first and the last check of this owner [s]
      real(dp) :: since = 0.0_dp, last_check = -huge(0.0_dp)
      !> Whether the owner ran or runs under the kernel of this process
      logical :: is_same_kernel = .false.
      !> Whether the heartbeat of the owner was seen since `since`
      logical :: has_renewed = .false.
      !> Whether this process created the file, and no process has written its key yet
      logical :: is_creator = .false.
      !> Whether kernel locks alone do not decide if the lock is held, so the heartbeat decides
      logical :: is_watched = .false.
      !> Whether a message about the wait was printed
      logical :: is_announced = .false.
   contains
      procedure :: record
      procedure :: decide_if_free
      procedure :: decide_if_busy
      procedure :: wait => wait_for_next_check
   end type observation_t

   !> Decisions after a check: wait and check again, take the lock, or refuse to run
   integer, parameter :: wait_longer = 0, take = 1, refuse = 2

contains

   !> Path of the lock file
   pure function lock_path(folder) result(path)
      !> Result folder
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/running.lock'
   end function lock_path

   !> Acquire the lock of a folder, which keeps other runs out until `release`.
   subroutine acquire(self, folder, note, error, is_shared, times)
      class(folder_lock_t), intent(inout) :: self
      !> Result folder, which must exist
      character(len=*), intent(in) :: folder
      !> Line for the log if the lock of a dead run was taken over; else not allocated
      character(len=:), allocatable, intent(out) :: note
      !> Allocated if another run holds the lock, or if the lock file cannot be created
      type(error_t), allocatable, intent(inout) :: error
      !> Whether other ranks of this run will `join`; false if absent
      logical, intent(in), optional :: is_shared
      !> Time constants; the default ones if absent
      type(lock_times_t), intent(in), optional :: times
      type(observation_t) :: observed
      character(len=:), allocatable :: reason
      integer :: answer, decision
      logical :: is_new, is_held, shares

      shares = .false.
      if (present(is_shared)) shares = is_shared
      if (present(times)) observed%times = times
      is_held = .false.
      do while (.not. is_held)
         call self%file%open(lock_path(folder), is_new, reason)
         if (allocated(reason)) call raise(error, io_error, lock_path(folder)//': cannot be created: '//reason)
         if (allocated(error)) return
         if (self%file%descriptor < 0) cycle
         answer = self%file%lock(is_shared=.false.)
         call observed%record(owner_of(lock_path(folder), error), is_new)
         if (allocated(error)) then
            call self%file%close()
            return
         end if
         decision = take
         if (answer == is_busy) decision = observed%decide_if_busy()
         if (answer /= is_busy .and. .not. observed%is_creator) decision = observed%decide_if_free(answer == is_granted)
         if (decision == take) call write_key(self, folder, observed, answer, shares, is_held, error)
         if (is_held .or. allocated(error)) exit
         call self%file%close()
         if (decision == refuse) call raise(error, input_error, refusal(folder, observed, answer))
         if (allocated(error)) return
         call observed%wait(folder)
      end do
      if (is_held) then
         self%path = lock_path(folder)
         if (.not. observed%is_creator) note = takeover(folder, observed)
      end if
   end subroutine acquire

   !> Share the lock that the root rank of the run has acquired. This matters only after the root rank has ended, so a
   !> file system without locks is no failure.
   subroutine join(self, folder)
      class(folder_lock_t), intent(inout) :: self
      !> Result folder
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: reason
      logical :: is_new

      call self%file%open(lock_path(folder), is_new, reason)
      if (self%file%descriptor < 0) return
      if (self%file%lock(is_shared=.true.) /= is_granted) call self%file%close()
   end subroutine join

   !> Check whether the lock is lost: its file is gone or belongs to another run. Then nothing may be written any more.
   subroutine check(self, is_lost, error)
      class(folder_lock_t), intent(in) :: self
      !> Whether the lock is lost
      logical, intent(out) :: is_lost
      !> Allocated if the lock is lost
      type(error_t), allocatable, intent(inout) :: error

      is_lost = self%heartbeat%has_lost()
      if (is_lost) call raise(error, io_error, self%path//' is gone or belongs to another run. Another run '// &
         'may take over the folder if this run does not respond for a minute. This run ends and writes nothing '// &
         'more there. When the other run has ended, --continue resumes from the last checkpoint')
   end subroutine check

   !> Whether this process has acquired the lock; `check` detects that another run has taken it over
   pure logical function is_held(self)
      class(folder_lock_t), intent(in) :: self

      is_held = allocated(self%path)
   end function is_held

   !> Release the lock; nothing happens if it is not held.
   subroutine release(self)
      class(folder_lock_t), intent(inout) :: self
      type(owner_t) :: owner
      type(error_t), allocatable :: ignored

      call self%heartbeat%stop()
      if (allocated(self%path)) then
         owner = owner_of(self%path, ignored)
         if (owner%key == self%key) call remove_file(self%path, ignored)
         deallocate (self%path)
      end if
      call self%file%close()
   end subroutine release

   !> Write a new key into a locked file, and check that the path refers to this file.
   subroutine write_key(self, folder, observed, answer, shares, is_held, error)
      class(folder_lock_t), intent(inout) :: self
      character(len=*), intent(in) :: folder
      type(observation_t), intent(in) :: observed
      !> Answer of the kernel: is_granted, is_busy or is_unsupported
      integer, intent(in) :: answer
      !> Whether other ranks will share the lock
      logical, intent(in) :: shares
      !> Whether this process holds the lock now
      logical, intent(out) :: is_held
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: ignored
      logical :: is_written

      is_held = .false.
      self%key = new_key()
      call self%file%write(text_of(self%key, answer == is_granted), 0, is_written)
      if (.not. is_written) then
         call raise(error, io_error, lock_path(folder)//': cannot be written: '//last_failure())
         ! No other process can hold the file: this process created it and has had the lock since.
         if (observed%is_creator .and. answer == is_granted) call remove_file(lock_path(folder), ignored)
         call self%file%close()
         return
      end if
      if (answer == is_unsupported .or. (observed%is_watched .and. .not. observed%is_creator)) &
         call wait_for(observed%times%settle)
      is_held = has_key(self, folder, error)
      if (is_held .and. shares .and. answer == is_granted) then
         is_held = self%file%lock(is_shared=.true.) == is_granted
         if (is_held) is_held = has_key(self, folder, error)
      end if
      if (allocated(error)) call self%file%close()
      if (is_held) call self%heartbeat%start(self%file, lock_path(folder), self%key, key_offset, count_offset, &
                                             observed%times%beat)
   end subroutine write_key

   !> Whether the lock file of a folder contains the key of this process
   logical function has_key(self, folder, error)
      class(folder_lock_t), intent(in) :: self
      character(len=*), intent(in) :: folder
      type(error_t), allocatable, intent(inout) :: error
      type(owner_t) :: owner

      owner = owner_of(lock_path(folder), error)
      has_key = owner%key == self%key
   end function has_key

   !> Record the current owner. The watch starts again after a pause of this process or of the file system.
   subroutine record(self, owner, is_new)
      class(observation_t), intent(inout) :: self
      !> Current owner
      type(owner_t), intent(in) :: owner
      !> Whether this process has just created the file
      logical, intent(in) :: is_new
      real(dp) :: now
      logical :: is_same

      now = wall_seconds()
      is_same = owner%key == self%owner%key .and. owner%process == self%owner%process .and. &
                owner%host == self%owner%host .and. (owner%link_exists .eqv. self%owner%link_exists) .and. &
                (owner%is_empty .eqv. self%owner%is_empty) .and. now - self%last_check < 0.5_dp*self%times%watch
      self%has_renewed = is_same .and. (self%has_renewed .or. owner%renewed /= self%owner%renewed)
      if (.not. is_same) self%since = now
      self%is_creator = owner%is_empty .and. (is_new .or. (self%is_creator .and. is_same))
      self%owner = owner
      self%is_same_kernel = owner%is_under_this_kernel()
      self%last_check = now
   end subroutine record

   !> Decision about a file that no kernel lock denies to this process: wait_longer, take or refuse
   integer function decide_if_free(self, has_lock)
      class(observation_t), intent(inout) :: self
      !> Whether the kernel has granted the lock
      logical, intent(in) :: has_lock
      logical :: is_finished
      real(dp) :: waited

      waited = self%last_check - self%since
      self%is_watched = .false.
      decide_if_free = wait_longer
      if (.not. self%owner%link_exists) return
      if (self%owner%is_empty) then
         ! Its creator writes its key at once, unless it was killed in between.
         is_finished = waited >= self%times%settle
      else if (self%owner%key == '' .and. self%owner%process > 0_ip .and. self%is_same_kernel) then
         is_finished = .not. runs_older_version(self%owner%process)
         if (.not. is_finished) decide_if_free = refuse
      else if (has_lock .and. self%owner%has_lock .and. self%is_same_kernel) then
         is_finished = .true.
      else
         self%is_watched = .true.
         is_finished = waited >= self%times%watch
         if (self%has_renewed) decide_if_free = refuse
      end if
      if (is_finished .and. decide_if_free /= refuse) decide_if_free = take
   end function decide_if_free

   !> Decision about a file that a kernel lock denies to this process: wait_longer or refuse
   integer function decide_if_busy(self)
      class(observation_t), intent(inout) :: self
      real(dp) :: limit

      self%is_watched = self%owner%key /= '' .and. .not. self%is_same_kernel
      limit = self%times%patience
      if (.not. is_running(self%owner%process)) limit = 5.0_dp*limit
      ! A file server releases the locks of a dead machine only after some time.
      if (self%is_watched) limit = 2.0_dp*self%times%watch
      decide_if_busy = wait_longer
      if (self%last_check - self%since >= limit .or. (self%is_watched .and. self%has_renewed)) decide_if_busy = refuse
   end function decide_if_busy

   !> Whether the process of a lock without a key may be a living run of an older version. A process with the identifier
   !> of this process was in another container.
   logical function runs_older_version(process)
      integer(ip), intent(in) :: process

      runs_older_version = process /= own_process()
      if (runs_older_version) runs_older_version = is_running(process)
      if (runs_older_version) runs_older_version = runs_same_program(process)
   end function runs_older_version

   !> Wait until the next check. The first long wait is announced on the screen.
   subroutine wait_for_next_check(self, folder)
      class(observation_t), intent(inout) :: self
      !> Result folder
      character(len=*), intent(in) :: folder
      type(line_writer_t) :: screen

      if (.not. self%is_watched) then
         call wait_for(0.01_dp)
         return
      end if
      if (.not. self%is_announced) then
         call screen%open_screen()
         call screen%put_line(lock_path(folder)//' belongs to '//self%owner%name()//'; waiting up to '// &
                              seconds(self%times%watch)//' for a sign of life')
      end if
      self%is_announced = .true.
      call wait_for(min(0.25_dp, 0.05_dp*self%times%watch))
   end subroutine wait_for_next_check

   !> Message that another run writes to the folder
   function refusal(folder, observed, answer) result(message)
      character(len=*), intent(in) :: folder
      type(observation_t), intent(in) :: observed
      !> Answer of the kernel: is_granted, is_busy or is_unsupported
      integer, intent(in) :: answer
      character(len=:), allocatable :: message

      message = folder//': another run ('//observed%owner%name()//') '
      if (answer == is_busy .and. observed%is_watched .and. .not. observed%has_renewed) then
         message = message//'has locked this folder but gives no sign of life; end it'
      else
         message = message//'writes to this folder; wait until it ends'
      end if
      message = message//' or choose another folder with --set output.folder=NAME'
   end function refusal

   !> Line for the log about a lock that was taken over
   function takeover(folder, observed) result(note)
      character(len=*), intent(in) :: folder
      type(observation_t), intent(in) :: observed
      character(len=:), allocatable :: note

      if (observed%owner%is_empty) then
         note = 'took over '//lock_path(folder)//', which was empty'
         return
      end if
      note = 'took over '//lock_path(folder)//' of '//observed%owner%name()//', which has ended'
      if (observed%is_watched) note = 'took over '//lock_path(folder)//' of '//observed%owner%name()// &
                                      ', which gave no sign of life for '//seconds(observed%times%watch)
   end function takeover

   !> A time in whole seconds with its unit
   function seconds(time) result(text)
      real(dp), intent(in) :: time
      character(len=:), allocatable :: text

      text = to_text(nint(time, ip))//' s'
   end function seconds

end module polydem_folder_lock
