!> The lock of a result folder: while a run writes there, it holds `running.lock`, which names its process and
!> machine.
!>
!> *One machine.* The kernel locks the open file (`lock_file.f90`) and releases it at any end of the run. A killed run
!> leaves a free file, with or without a text; process numbers do not matter.
!>
!> *Making and removing.* A process that has locked the file writes a new key into it and reads the key back through
!> the path. It is the holder if it finds its own key there; else it starts over. The argument: (1) Only a holder
!> removes the file, and it still has the lock then. (2) So while somebody holds the file of the path, nobody else can
!> make the path lead to another file. (3) A process that locks a file which was removed before finds no key or
!> another key behind the path. So at most one process holds the path. The ranks of a run share its lock, and a rank
!> that outlives the leader keeps others out until it has ended. The change from the lock of one to a shared lock may
!> let another run in between, so the key is read again after it.
!>
!> *Several machines* may not know each other's kernel locks, and some file systems have no locks. So a holder counts
!> in its lock every `beat` seconds (`heartbeat.f90`). A lock that belongs to another kernel, or that no kernel
!> guards, is watched: if the count goes on, its run lives; if nothing changes for `watch` seconds, it is taken over.
!> No clocks of two machines are compared, and a watch begins again after a pause of the watcher itself. The new
!> holder writes its key, waits `settle` seconds, in which another watcher may do the same, and goes on if its key is
!> still there.
!>
!> *Limit.* The count is that of a thread, so long steps and checkpoints do not stop it. A run that is stopped, or cut
!> off from its files, for longer than `watch` seconds may be taken over from another machine. It finds another key in
!> its lock before it writes the next frame, checkpoint or line, and ends (`check`); but it completes the call that it
!> was in.
!>
!> An older version wrote one line of text without a key and had no kernel lock. Such a lock on this machine counts
!> while its process lives and runs this program, as it did for that version.
module polydem_run_lock
   use polydem_clock, only: wall_seconds
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_heartbeat, only: heartbeat_t
   use polydem_kinds, only: dp, ip
   use polydem_line_writer, only: line_writer_t
   use polydem_lock_file, only: is_busy, is_granted, is_unsupported, lock_file_t
   use polydem_lock_owner, only: key_length, new_key, owner_of, owner_t, place_of_count, place_of_key, text_of
   use polydem_paths, only: last_failure, remove_file
   use polydem_processes, only: has_own_program, lives, own_process, wait_for
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_lock_t, lock_times_t, lock_path

   !> Times of locks [s]
   type :: lock_times_t
      !> Between two signs of life
      real(dp) :: beat = 10.0_dp
      !> Without a sign of life until a lock is taken over: six of them are missing, and what one machine writes to a
      !> network file system reaches the others within some seconds
      real(dp) :: watch = 60.0_dp
      !> Until a text that another machine writes at the same time can be read
      real(dp) :: settle = 2.0_dp
      !> For a run that ends just now; five times as long if its process has ended but its ranks or the kernel have not
      real(dp) :: patience = 1.0_dp
   end type lock_times_t

   !> The lock of a result folder, held or not
   type :: run_lock_t
      private
      !> Path of the lock; not allocated if it is not held
      character(len=:), allocatable :: path
      !> What stands in it as long as it is held
      character(len=key_length) :: key = ''
      type(lock_file_t) :: file
      type(heartbeat_t) :: heartbeat
   contains
      procedure :: acquire
      procedure :: join
      procedure :: check
      procedure :: is_held
      procedure :: release
   end type run_lock_t

   !> What was seen of a lock that another one holds or held
   type :: vigil_t
      !> Its times
      type(lock_times_t) :: times
      !> Its owner at the last look
      type(owner_t) :: owner
      !> When this owner was first seen, and when the last look was [s]
      real(dp) :: since = 0.0_dp, last_look = -huge(0.0_dp)
      !> Whether this owner ran or runs under the kernel of this process
      logical :: is_near = .false.
      !> Whether the owner gave a sign of life meanwhile
      logical :: has_renewed = .false.
      !> Whether this process made the file, and nobody has signed it yet
      logical :: has_made = .false.
      !> Whether kernels alone do not tell if it is held, so that its signs of life count
      logical :: is_watched = .false.
      !> Whether the wait was announced
      logical :: is_announced = .false.
   contains
      procedure :: see
      procedure :: judge_free
      procedure :: judge_busy
      procedure :: wait => wait_a_little
   end type vigil_t

   !> What comes of a look: wait and look again, take the lock, or leave it
   integer, parameter :: wait_longer = 0, take = 1, refuse = 2

contains

   !> Path of the lock
   pure function lock_path(folder) result(path)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path

      path = folder//'/running.lock'
   end function lock_path

   !> Keep other runs out of a folder until `release`.
   subroutine acquire(self, folder, note, error, is_shared, times)
      class(run_lock_t), intent(inout) :: self
      !> Folder of the result, which must be there
      character(len=*), intent(in) :: folder
      !> A line for the log if the lock of a dead run was taken over, else not allocated
      character(len=:), allocatable, intent(out) :: note
      !> Allocated if another run holds the folder, or if the lock cannot be made
      type(error_t), allocatable, intent(inout) :: error
      !> Whether other processes of this run will `join`; no if absent
      logical, intent(in), optional :: is_shared
      !> Times of locks; the usual ones if absent
      type(lock_times_t), intent(in), optional :: times
      type(vigil_t) :: vigil
      character(len=:), allocatable :: reason
      integer :: answer, verdict
      logical :: is_new, is_held, shares

      shares = .false.
      if (present(is_shared)) shares = is_shared
      if (present(times)) vigil%times = times
      is_held = .false.
      do while (.not. is_held)
         call self%file%open(lock_path(folder), is_new, reason)
         if (allocated(reason)) call raise(error, io_error, lock_path(folder)//': cannot be made: '//reason)
         if (allocated(error)) return
         if (self%file%descriptor < 0) cycle
         answer = self%file%lock(is_shared=.false.)
         call vigil%see(owner_of(lock_path(folder)), is_new)
         verdict = take
         if (answer == is_busy) verdict = vigil%judge_busy()
         if (answer /= is_busy .and. .not. vigil%has_made) verdict = vigil%judge_free(answer == is_granted)
         if (verdict == take) call sign_lock(self, folder, vigil, answer, shares, is_held, error)
         if (is_held .or. allocated(error)) exit
         call self%file%close()
         if (verdict == refuse) call raise(error, input_error, refusal(folder, vigil, answer))
         if (allocated(error)) return
         call vigil%wait(folder)
      end do
      if (is_held) then
         self%path = lock_path(folder)
         if (.not. vigil%has_made) note = takeover(folder, vigil)
      end if
   end subroutine acquire

   !> As a further process of a run whose leader has acquired the lock, share it. This is not needed while the leader
   !> lives, so a file system without locks is no failure.
   subroutine join(self, folder)
      class(run_lock_t), intent(inout) :: self
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: reason
      logical :: is_new

      call self%file%open(lock_path(folder), is_new, reason)
      if (self%file%descriptor < 0) return
      if (self%file%lock(is_shared=.true.) /= is_granted) call self%file%close()
   end subroutine join

   !> See whether a lock that was held is gone or belongs to another run. Then nothing may be written to the folder.
   subroutine check(self, is_lost, error)
      class(run_lock_t), intent(in) :: self
      !> Whether it is so
      logical, intent(out) :: is_lost
      !> Allocated if it is so
      type(error_t), allocatable, intent(inout) :: error

      is_lost = self%heartbeat%has_lost()
      if (is_lost) call raise(error, io_error, self%path//' is gone or belongs to another run, which may take a '// &
         'folder over if this one was stopped or cut off for a minute: this run ends and writes nothing more '// &
         'there; once the other one has ended, --continue goes on from the last checkpoint')
   end subroutine check

   !> Whether this process holds the lock, of which another run may know better (`check`)
   pure logical function is_held(self)
      class(run_lock_t), intent(in) :: self

      is_held = allocated(self%path)
   end function is_held

   !> Let other runs into the folder; nothing happens unless the lock is held.
   subroutine release(self)
      class(run_lock_t), intent(inout) :: self
      type(owner_t) :: owner
      type(error_t), allocatable :: ignored

      call self%heartbeat%stop()
      if (allocated(self%path)) then
         owner = owner_of(self%path)
         if (owner%key == self%key) call remove_file(self%path, ignored)
         deallocate (self%path)
      end if
      call self%file%close()
   end subroutine release

   !> Write into a locked file who holds it, and see whether the path leads there.
   subroutine sign_lock(self, folder, vigil, answer, shares, is_held, error)
      class(run_lock_t), intent(inout) :: self
      character(len=*), intent(in) :: folder
      type(vigil_t), intent(in) :: vigil
      !> What the kernel said
      integer, intent(in) :: answer
      !> Whether others will share the lock
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
         ! Nobody else can have it: this process made it and has locked it since.
         if (vigil%has_made .and. answer == is_granted) call remove_file(lock_path(folder), ignored)
         call self%file%close()
         return
      end if
      if (answer == is_unsupported .or. (vigil%is_watched .and. .not. vigil%has_made)) call wait_for(vigil%times%settle)
      is_held = has_key(self, folder)
      if (is_held .and. shares .and. answer == is_granted) then
         is_held = self%file%lock(is_shared=.true.) == is_granted
         if (is_held) is_held = has_key(self, folder)
      end if
      if (is_held) call self%heartbeat%start(self%file, lock_path(folder), self%key, place_of_key, place_of_count, &
                                             vigil%times%beat)
   end subroutine sign_lock

   logical function has_key(self, folder)
      class(run_lock_t), intent(in) :: self
      character(len=*), intent(in) :: folder
      type(owner_t) :: owner

      owner = owner_of(lock_path(folder))
      has_key = owner%key == self%key
   end function has_key

   !> Take notice of an owner. After a pause of this process, or of the file system, the watch begins again.
   subroutine see(self, owner, is_new)
      class(vigil_t), intent(inout) :: self
      !> The owner now
      type(owner_t), intent(in) :: owner
      !> Whether this process has just made the file
      logical, intent(in) :: is_new
      real(dp) :: now
      logical :: is_same

      now = wall_seconds()
      is_same = owner%key == self%owner%key .and. owner%process == self%owner%process .and. &
                owner%host == self%owner%host .and. (owner%is_there .eqv. self%owner%is_there) .and. &
                (owner%is_empty .eqv. self%owner%is_empty) .and. now - self%last_look < 0.5_dp*self%times%watch
      self%has_renewed = is_same .and. (self%has_renewed .or. owner%renewed /= self%owner%renewed)
      if (.not. is_same) self%since = now
      self%has_made = owner%is_empty .and. (is_new .or. (self%has_made .and. is_same))
      self%owner = owner
      self%is_near = owner%is_under_this_kernel()
      self%last_look = now
   end subroutine see

   !> What to do with a file that no kernel keeps from this process
   integer function judge_free(self, has_lock)
      class(vigil_t), intent(inout) :: self
      !> Whether the kernel has granted the lock
      logical, intent(in) :: has_lock
      logical :: is_over
      real(dp) :: waited

      waited = self%last_look - self%since
      self%is_watched = .false.
      judge_free = wait_longer
      if (.not. self%owner%is_there) return
      if (self%owner%is_empty) then
         ! A process that has just made it signs it now, unless it was killed in between.
         is_over = waited >= self%times%settle
      else if (self%owner%key == '' .and. self%owner%process > 0_ip .and. self%is_near) then
         is_over = .not. runs_older_version(self%owner%process)
         if (.not. is_over) judge_free = refuse
      else if (has_lock .and. self%owner%has_lock .and. self%is_near) then
         is_over = .true.
      else
         self%is_watched = .true.
         is_over = waited >= self%times%watch
         if (self%has_renewed) judge_free = refuse
      end if
      if (is_over .and. judge_free /= refuse) judge_free = take
   end function judge_free

   !> What to do with a file that a kernel keeps from this process
   integer function judge_busy(self)
      class(vigil_t), intent(inout) :: self
      real(dp) :: limit

      self%is_watched = self%owner%key /= '' .and. .not. self%is_near
      limit = self%times%patience
      if (.not. lives(self%owner%process)) limit = 5.0_dp*limit
      ! A server of files takes a while until it gives up a machine that is dead.
      if (self%is_watched) limit = 2.0_dp*self%times%watch
      judge_busy = wait_longer
      if (self%last_look - self%since >= limit .or. (self%is_watched .and. self%has_renewed)) judge_busy = refuse
   end function judge_busy

   !> Whether the process of a lock without a key may be a living run of an older version. One with the number of this
   !> process was in another container.
   logical function runs_older_version(process)
      integer(ip), intent(in) :: process

      runs_older_version = process /= own_process()
      if (runs_older_version) runs_older_version = lives(process)
      if (runs_older_version) runs_older_version = has_own_program(process)
   end function runs_older_version

   !> Wait until it is time to look again, and say so if it takes long.
   subroutine wait_a_little(self, folder)
      class(vigil_t), intent(inout) :: self
      !> Folder of the result
      character(len=*), intent(in) :: folder
      type(line_writer_t) :: screen

      if (.not. self%is_watched) then
         call wait_for(0.01_dp)
         return
      end if
      if (.not. self%is_announced) then
         call screen%open_screen()
         call screen%put_line(lock_path(folder)//' is that of '//self%owner%name()//'; waiting up to '// &
                              seconds(self%times%watch)//' for a sign of its life')
      end if
      self%is_announced = .true.
      call wait_for(min(0.25_dp, 0.05_dp*self%times%watch))
   end subroutine wait_a_little

   !> Why a run must not begin
   function refusal(folder, vigil, answer) result(message)
      character(len=*), intent(in) :: folder
      type(vigil_t), intent(in) :: vigil
      !> What the kernel said
      integer, intent(in) :: answer
      character(len=:), allocatable :: message

      message = folder//': another run ('//vigil%owner%name()//') '
      if (answer == is_busy .and. vigil%is_watched .and. .not. vigil%has_renewed) then
         message = message//'has locked this folder but gives no sign of life; end it'
      else
         message = message//'writes into this folder; wait for its end'
      end if
      message = message//' or choose another folder with --set output.folder=NAME'
   end function refusal

   !> What the log says of a lock that was taken over
   function takeover(folder, vigil) result(note)
      character(len=*), intent(in) :: folder
      type(vigil_t), intent(in) :: vigil
      character(len=:), allocatable :: note

      if (vigil%owner%is_empty) then
         note = 'took over '//lock_path(folder)//', which nobody had signed'
         return
      end if
      note = 'took over '//lock_path(folder)//' of '//vigil%owner%name()//', which has ended'
      if (vigil%is_watched) note = 'took over '//lock_path(folder)//' of '//vigil%owner%name()// &
                                   ', which gave no sign of life for '//seconds(vigil%times%watch)
   end function takeover

   function seconds(time) result(text)
      real(dp), intent(in) :: time
      character(len=:), allocatable :: text

      text = to_text(nint(time, ip))//' s'
   end function seconds

end module polydem_run_lock
