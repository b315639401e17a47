!> The owner of a lock, as described by the text in the lock file:
!>
!>     4711 node07                       process identifier and machine
!>     since 2026-11-21T12:00:00Z
!>     kernel 3e1f8a52-...               identity of the kernel of the process; - if unknown
!>     guard lock                        or 'heartbeat' if the file system has no locks
!>     key 8f2c6d0e1b3a4957              random, unique to this lock
!>     renewed 0000000012                number of heartbeats so far
!>
!> The text has a fixed length, and the last two lines are at its end. A delayed write of the counter therefore never
!> changes the key of another process. Older versions wrote only the first line, and can read it.
module polydem_lock_owner
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_new_line, c_null_char, c_size_t
   use polydem_errors, only: error_t, raise_unread
   use polydem_file_system, only: errno_message
   use polydem_hash, only: hexadecimal, mix_word
   use polydem_heartbeat, only: n_digits
   use polydem_host, only: boot_identity, host_name, utc_now
   use polydem_kinds, only: ip, lp
   use polydem_lock_file, only: read_record, record_length
   use polydem_posix_processes, only: c_getrandom
   use polydem_processes, only: own_process
   use polydem_strings, only: to_text
   implicit none
   private
   public :: owner_t, text_of, owner_of, new_key, key_length, key_offset, count_offset

   !> Length of a key
   integer, parameter :: key_length = 16
   !> Words before the key and before the counter of heartbeats
   character(len=*), parameter :: key_word = 'key ', count_word = 'renewed '
   !> Offsets of counter and key in the file, counted from 0, the same in all locks [B]
   integer, parameter :: count_offset = record_length - 1 - n_digits
   integer, parameter :: key_offset = count_offset - len(count_word) - 1 - key_length

   !> The owner of a lock
   type :: owner_t
      !> Process identifier; 0 if it cannot be read
      integer(ip) :: process = 0_ip
      !> Name of the machine
      character(len=256) :: host = ''
      !> Start time of the lock (UTC)
      character(len=32) :: since = ''
      !> Identity of the kernel of the process; '-' if unknown
      character(len=64) :: kernel = '-'
      !> Whether the file was locked by the kernel when the text was written
      logical :: has_lock = .false.
      !> Key, unique to this lock; empty if an older version wrote the file
      character(len=key_length) :: key = ''
      !> Counter of heartbeats
      character(len=n_digits) :: renewed = ''
      !> Whether the file exists
      logical :: link_exists = .false.
      !> Whether the file is empty
      logical :: is_empty = .false.
   contains
      procedure :: is_under_this_kernel
      procedure :: name => name_of
   end type owner_t

contains

   !> Text of a new lock of this process
   function text_of(key, has_lock) result(text)
      !> Key of the lock
      character(len=key_length), intent(in) :: key
      !> Whether the kernel has locked the file for this process
      logical, intent(in) :: has_lock
      !> The text, which replaces the whole previous text of the file
      character(len=record_length, kind=c_char) :: text
      character(len=:), allocatable :: guard

      guard = 'heartbeat'
      if (has_lock) guard = 'lock'
      text = to_text(own_process())//' '//host_name()//c_new_line//'since '//utc_now()//c_new_line//'kernel '// &
             boot_identity()//c_new_line//'guard '//guard//c_new_line
      text(key_offset - len(key_word):) = c_new_line//key_word//key//c_new_line//count_word//repeat('0', n_digits)// &
                                            c_new_line
   end function text_of

   !> A new, unique key
   function new_key() result(key)
      character(len=key_length) :: key
      integer(c_int64_t) :: word
      integer(c_size_t) :: ignored
      integer(lp) :: ticks

      word = 0_c_int64_t
      ignored = c_getrandom(word, 8_c_size_t, 0_c_int)
      call system_clock(ticks)
      key = hexadecimal(mix_word(mix_word(int(word, lp), ticks), int(own_process(), lp)))
   end function new_key

   !> Read the owner of a lock.
   function owner_of(path, error) result(owner)
      !> Path of the lock file
      character(len=*), intent(in) :: path
      !> Allocated if the file exists but cannot be read
      type(error_t), allocatable, intent(inout) :: error
      type(owner_t) :: owner
      character(len=record_length, kind=c_char) :: text
      character(len=record_length) :: line
      integer(c_int) :: number
      integer :: length, first, last, status
      logical :: is_gone

      call read_record(path//c_null_char, text, length, is_gone, number)
      if (number /= 0_c_int) call raise_unread(error, path, errno_message(number))
      owner%link_exists = .not. is_gone
      owner%is_empty = length == 0
      first = 1
      do while (first <= length)
         last = index(text(first:), c_new_line)
         if (last == 0) last = record_length + 2 - first
         line = text(first:first + last - 2)
         if (first == 1) then
            read (line, *, iostat=status) owner%process, owner%host
            if (status /= 0) owner%process = 0_ip
         end if
         if (index(line, 'since ') == 1) owner%since = line(7:)
         if (index(line, 'kernel ') == 1) owner%kernel = line(8:)
         if (index(line, 'guard ') == 1) owner%has_lock = line(7:) == 'lock'
         if (index(line, key_word) == 1) owner%key = line(len(key_word) + 1:)
         if (index(line, count_word) == 1) owner%renewed = line(len(count_word) + 1:)
         first = first + last
      end do
   end function owner_of

   !> Whether the owner ran or runs under the kernel of this process, which then manages all locks of the owner. The
   !> names of the machines are compared if the identity of a kernel is unknown.
   logical function is_under_this_kernel(self)
      class(owner_t), intent(in) :: self
      character(len=:), allocatable :: kernel

      kernel = boot_identity()
      if (self%kernel /= '-' .and. kernel /= '-') then
         is_under_this_kernel = self%kernel == kernel
      else
         is_under_this_kernel = self%host == host_name()
      end if
   end function is_under_this_kernel

   !> Description of the owner for messages
   function name_of(self) result(name)
      class(owner_t), intent(in) :: self
      character(len=:), allocatable :: name

      name = 'an unknown process'
      if (self%process < 1_ip) return
      name = 'process '//to_text(self%process)
      if (self%host /= host_name()) name = name//' on the machine '//trim(self%host)
   end function name_of

end module polydem_lock_owner
