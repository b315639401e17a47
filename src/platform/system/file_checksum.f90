!> Checksums of files: CRC-32, which detects truncated files and changed bits.
!>
!> The checksum of a file that stands alone is a line of text in its first bytes, which HDF5 reserves for its users (the
!> *user block*; `head -1` shows it). It contains the number of bytes that follow and their CRC-32, and is verified
!> before HDF5 reads the file. `sum_file` sums all bytes of a file without such a line, for callers that store the
!> checksum elsewhere.
module polydem_file_checksum
   use, intrinsic :: iso_fortran_env, only: iostat_end
   use polydem_crc32, only: crc32_t, new_crc32
   use polydem_errors, only: error_t, io_error, raise, raise_unread
   use polydem_file_status, only: is_stream, stream_reason
   use polydem_file_system, only: find_length, overwrite_start
   use polydem_kinds, only: bp, ip, lp
   use polydem_strings, only: to_text
   implicit none
   private
   public :: checksum_length, append_checksum, verify_checksum, sum_file

   !> Length of the checksum line [B], the smallest user block that HDF5 allows
   integer(ip), parameter :: checksum_length = 512_ip
   !> Number of 8-byte words that are read at once
   integer(ip), parameter :: n_words = 8192_ip

contains

   !> Write the checksum into the first bytes of a closed file, flush it to disk, read the file back and verify it.
   subroutine append_checksum(path, error)
      !> Path of the file; its first `checksum_length` bytes are reserved for the checksum
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      character(len=256) :: reason
      character(len=:), allocatable :: problem
      character(len=checksum_length) :: checksum_line
      integer :: unit, status

      open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
            iostat=status, iomsg=reason)
      if (status == 0) then
         call make_checksum(unit, checksum_line, status, reason)
         close (unit)
      end if
      if (status /= 0) then
         call raise(error, io_error, path//': cannot compute the checksum: '//trim(reason))
         return
      end if
      call overwrite_start(path, checksum_line, error)
      if (allocated(error)) return
      call verify_checksum(path, problem, error)
      if (allocated(problem)) call raise(error, io_error, path//': read back after its checksum was written: '//problem)
   end subroutine append_checksum

   !> Verify the checksum of a file.
   subroutine verify_checksum(path, problem, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Description of the damage; not allocated if the checksum matches
      character(len=:), allocatable, intent(out) :: problem
      !> Allocated if the file cannot be read, which is no damage
      type(error_t), allocatable, intent(inout) :: error
      character(len=256) :: reason
      character(len=checksum_length) :: checksum_line, expected
      integer :: unit, status

      if (is_stream(path)) call raise_unread(error, path, stream_reason)
      if (allocated(error)) return
      open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
            iostat=status, iomsg=reason)
      if (status == 0) then
         read (unit, iostat=status, iomsg=reason) checksum_line
         if (status == 0) call make_checksum(unit, expected, status, reason)
         close (unit)
      end if
      if (status == iostat_end) then
         problem = 'it is truncated'
      else if (status /= 0) then
         call raise_unread(error, path, reason)
      else if (checksum_line /= expected) then
         problem = 'its checksum does not match: it was truncated or changed after it was written'
      end if
   end subroutine verify_checksum

   !> Length and checksum of a whole file.
   subroutine sum_file(path, bytes, checksum, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Length of the file [B]
      integer(lp), intent(out) :: bytes
      !> CRC-32 of all bytes, eight hexadecimal digits
      character(len=8), intent(out) :: checksum
      !> Allocated if the file cannot be read
      type(error_t), allocatable, intent(inout) :: error
      character(len=256) :: reason
      integer :: unit, status

      bytes = 0_lp
      checksum = ''
      if (is_stream(path)) call raise_unread(error, path, stream_reason)
      if (allocated(error)) return
      open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
            iostat=status, iomsg=reason)
      if (status == 0) then
         call find_length(unit, bytes, status, reason)
         if (status == 0) call sum_bytes(unit, 0_ip, bytes, checksum, status, reason)
         close (unit)
      end if
      if (status /= 0) call raise_unread(error, path, reason)
   end subroutine sum_file

   !> Checksum line of the bytes that follow it.
   subroutine make_checksum(unit, checksum_line, status, reason)
      integer, intent(in) :: unit
      character(len=checksum_length), intent(out) :: checksum_line
      integer, intent(out) :: status
      character(len=*), intent(inout) :: reason
      character(len=8) :: checksum
      integer(lp) :: bytes

      call find_length(unit, bytes, status, reason)
      bytes = bytes - int(checksum_length, lp)
      if (status == 0) call sum_bytes(unit, checksum_length, max(0_lp, bytes), checksum, status, reason)
      if (status /= 0) return
      checksum_line = 'polydem: '//to_text(bytes)//' bytes follow, CRC-32 '//checksum
      checksum_line(checksum_length:) = new_line('a')
   end subroutine make_checksum

   !> Checksum of the bytes of a file after the first `skipped` bytes.
   subroutine sum_bytes(unit, skipped, bytes, checksum, status, reason)
      integer, intent(in) :: unit
      integer(ip), intent(in) :: skipped
      integer(lp), intent(in) :: bytes
      character(len=8), intent(out) :: checksum
      integer, intent(out) :: status
      character(len=*), intent(inout) :: reason
      type(crc32_t) :: crc
      integer(lp) :: words(n_words)
      integer(bp) :: rest(8)
      integer(lp) :: n, place

      crc = new_crc32()
      read (unit, pos=skipped + 1_ip, iostat=status, iomsg=reason)
      do place = 0_lp, bytes/8_lp - 1_lp, n_words
         n = min(int(n_words, lp), bytes/8_lp - place)
         if (status == 0) read (unit, iostat=status, iomsg=reason) words(:n)
         if (status == 0) call crc%add(words, 8_lp*n)
      end do
      n = modulo(bytes, 8_lp)
      if (n > 0_lp .and. status == 0) read (unit, iostat=status, iomsg=reason) rest(:n)
      if (status == 0) call crc%add([transfer(rest, 0_lp)], n)
      checksum = crc%text()
   end subroutine sum_bytes

end module polydem_file_checksum
