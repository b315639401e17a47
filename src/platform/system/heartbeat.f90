!> Heartbeat of this process in a file: a thread increments a counter in the file and checks whether the file still
!> contains the key of this process.
!>
!> The thread depends only on the operating system, so a long step or checkpoint does not delay it. It stops only if the
!> process is stopped or the file system does not respond. It writes the counter first and then reads the key; the
!> counter never overwrites the key of another process. If no thread can be created, `has_lost` gives the beats.
module polydem_heartbeat
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_funloc, c_int, c_intptr_t, &
      c_loc, c_null_char, c_null_ptr, c_ptr, c_short, c_size_t, c_sizeof
   use polydem_clock, only: wall_seconds
   use polydem_kinds, only: dp
   use polydem_lock_file, only: lock_file_t, read_record, record_length
   use polydem_posix, only: c_close, close_on_exec
   use polydem_posix_processes, only: c_free, c_malloc, c_pipe2, c_poll, pthread_create, pthread_join
   implicit none
   private
   public :: heartbeat_t, n_digits

   !> Number of digits of the counter
   integer, parameter :: n_digits = 10
   !> Maximum length of a path, PATH_MAX of Linux
   integer, parameter :: longest_path = 4096
   !> Number of intervals without a beat after which `has_lost` itself gives a beat
   real(dp), parameter :: max_delay = 2.0_dp

   !> Heartbeat of this process in one file
   type :: heartbeat_t
      private
      !> Address of a `pulse_t`; null if the heartbeat is stopped
      type(c_ptr) :: pulse = c_null_ptr
      !> The thread, if one was created
      integer(c_intptr_t) :: thread = 0_c_intptr_t
      !> Whether the thread exists
      logical :: has_thread = .false.
      !> Write end of a pipe; closing it wakes the thread
      integer(c_int) :: wake_write_end = -1_c_int
   contains
      procedure :: start
      procedure :: has_lost
      procedure :: stop => stop_heartbeat
   end type heartbeat_t

   !> Data shared by the thread and the run
   type, bind(C) :: pulse_t
      !> Descriptors of the file, and of the read end of the pipe that wakes the thread
      integer(c_int) :: descriptor, wake_read_end
      !> Time between two beats [ms]
      integer(c_int) :: interval
      !> Offsets of counter and key in the file, counted from 0 [B]
      integer(c_int) :: count_offset, key_offset
      !> Number of beats
      integer(c_int) :: count
      !> 1 if the file is gone or contains another key, else 0
      integer(c_int) :: is_lost
      !> Length of the key
      integer(c_int) :: key_length
      !> Time of the last beat [s]
      real(c_double) :: last_beat
      !> Key, and path of the file
      character(kind=c_char) :: key(record_length), path(longest_path)
   end type pulse_t

   !> struct pollfd of poll(2)
   type, bind(C) :: pollfd_t
      !> Descriptor
      integer(c_int) :: descriptor
      !> Events that are waited for, and events that occurred
      integer(c_short) :: wanted, found
   end type pollfd_t

   !> POLLIN of poll(2)
   integer(c_short), parameter :: readable = 1_c_short

contains

   !> Start the heartbeat.
   subroutine start(self, file, path, key, key_offset, count_offset, interval)
      class(heartbeat_t), intent(inout) :: self
      !> The open lock file
      type(lock_file_t), intent(in) :: file
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Key in the file while it belongs to this process
      character(len=*), intent(in) :: key
      !> Offsets of key and counter in the file, counted from 0 [B]
      integer, intent(in) :: key_offset, count_offset
      !> Time between two beats [s]
      real(dp), intent(in) :: interval
      type(pulse_t), pointer :: pulse
      type(pulse_t) :: sample
      integer(c_int) :: ends(2)
      integer :: k

      self%pulse = c_malloc(c_sizeof(sample))
      if (.not. c_associated(self%pulse)) return
      call c_f_pointer(self%pulse, pulse)
      pulse%descriptor = file%descriptor
      pulse%wake_read_end = -1_c_int
      pulse%interval = max(1_c_int, nint(1.0e3_dp*interval, c_int))
      pulse%count_offset = int(count_offset, c_int)
      pulse%key_offset = int(key_offset, c_int)
      pulse%count = 0_c_int
      pulse%is_lost = 0_c_int
      pulse%key_length = int(len(key), c_int)
      pulse%last_beat = real(wall_seconds(), c_double)
      do k = 1, len(key)
         pulse%key(k) = key(k:k)
      end do
      do k = 1, min(len(path), longest_path - 1)
         pulse%path(k) = path(k:k)
         pulse%path(k + 1) = c_null_char
      end do
      if (c_pipe2(ends, close_on_exec) /= 0_c_int) return
      pulse%wake_read_end = ends(1)
      self%wake_write_end = ends(2)
      self%has_thread = pthread_create(self%thread, c_null_ptr, c_funloc(beat), self%pulse) == 0_c_int
   end subroutine start

   !> Whether the file is gone or belongs to another process. If the last beat is overdue, for example because this
   !> process was stopped, a beat is given first.
   logical function has_lost(self)
      class(heartbeat_t), intent(in) :: self
      type(pulse_t), pointer, volatile :: pulse

      has_lost = .false.
      if (.not. c_associated(self%pulse)) return
      call c_f_pointer(self%pulse, pulse)
      if (wall_seconds() - pulse%last_beat > 1.0e-3_dp*max_delay*real(pulse%interval, dp)) call give_beat(pulse)
      has_lost = pulse%is_lost == 1_c_int
   end function has_lost

   !> Stop the heartbeat; nothing happens if it was not started. The file stays open.
   subroutine stop_heartbeat(self)
      class(heartbeat_t), intent(inout) :: self
      type(pulse_t), pointer :: pulse
      integer(c_int) :: ignored

      if (.not. c_associated(self%pulse)) return
      call c_f_pointer(self%pulse, pulse)
      if (self%wake_write_end >= 0_c_int) ignored = c_close(self%wake_write_end)
      if (self%has_thread) ignored = pthread_join(self%thread, c_null_ptr)
      if (pulse%wake_read_end >= 0_c_int) ignored = c_close(pulse%wake_read_end)
      call c_free(self%pulse)
      self%pulse = c_null_ptr
      self%has_thread = .false.
      self%wake_write_end = -1_c_int
   end subroutine stop_heartbeat

   !> Main procedure of the thread: beats until the thread is woken or the file is lost.
   recursive function beat(argument) result(nothing) bind(C)
      type(c_ptr), value :: argument
      type(c_ptr) :: nothing
      type(pulse_t), pointer, volatile :: pulse
      type(pollfd_t), target :: event

      nothing = c_null_ptr
      call c_f_pointer(argument, pulse)
      do while (pulse%is_lost == 0_c_int)
         event = pollfd_t(pulse%wake_read_end, readable, 0_c_short)
         if (c_poll(c_loc(event), 1_c_size_t, pulse%interval) > 0_c_int) exit
         call give_beat(pulse)
      end do
   end function beat

   !> One beat: write the counter into the file, then read the key. If the file cannot be read, the next beat retries.
   recursive subroutine give_beat(pulse)
      type(pulse_t), intent(inout), volatile :: pulse
      type(lock_file_t) :: file
      character(len=n_digits, kind=c_char) :: digits
      character(len=record_length, kind=c_char) :: text
      character(len=longest_path, kind=c_char) :: path
      integer :: k, length
      integer(c_int) :: rest
      logical :: ignored, is_gone, is_other

      pulse%count = pulse%count + 1_c_int
      rest = pulse%count
      do k = n_digits, 1, -1
         digits(k:k) = achar(iachar('0') + int(modulo(rest, 10_c_int)))
         rest = rest/10_c_int
      end do
      file%descriptor = pulse%descriptor
      call file%write(digits, int(pulse%count_offset), ignored)
      do k = 1, longest_path
         path(k:k) = pulse%path(k)
         if (path(k:k) == c_null_char) exit
      end do
      call read_record(path, text, length, is_gone)
      is_other = .false.
      do k = 1, int(pulse%key_length)
         if (length >= 0) is_other = is_other .or. text(pulse%key_offset + k:pulse%key_offset + k) /= pulse%key(k)
      end do
      if (is_gone .or. is_other) pulse%is_lost = 1_c_int
      pulse%last_beat = real(wall_seconds(), c_double)
   end subroutine give_beat

end module polydem_heartbeat
