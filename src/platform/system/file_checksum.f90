!> Checksums of files: they detect truncated files and changed bits.
!>
!> The checksum is a line of text in the first bytes of the file, which HDF5 reserves for its users (the *user block*;
!> `head -1` shows it). It contains the number of bytes that follow and their hash. It is verified before HDF5 reads the
!> file.
!>
!> The hash combines the hashes of slices of the file, which threads compute in parallel. `hash_file` hashes all bytes
!> of a file without such a line, for callers that store the hash elsewhere.
module polydem_file_checksum
   use, intrinsic :: iso_fortran_env, only: iostat_end
   use polydem_errors, only: error_t, io_error, raise, raise_unread
   use polydem_file_system, only: find_length, overwrite_start
   use polydem_hash, only: hexadecimal, mix_word
   use polydem_kinds, only: bp, ip, lp
   use polydem_strings, only: to_text
   implicit none
   private
   public :: checksum_length, append_checksum, verify_checksum, hash_file

   !> Length of the checksum line [B], the smallest user block that HDF5 allows
   integer(ip), parameter :: checksum_length = 512_ip
   !> Number of 8-byte words per slice
   integer(ip), parameter :: slice = 8192_ip
   !> Number of slices that are read at once
   integer(ip), parameter :: n_slices = 64_ip

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

   !> Length and hash of a whole file.
   subroutine hash_file(path, bytes, hash, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Length of the file [B]
      integer(lp), intent(out) :: bytes
      !> Hash of all bytes
      integer(lp), intent(out) :: hash
      !> Allocated if the file cannot be read
      type(error_t), allocatable, intent(inout) :: error
      character(len=256) :: reason
      integer :: unit, status

      bytes = 0_lp
      hash = 0_lp
      open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
            iostat=status, iomsg=reason)
      if (status == 0) then
         call find_length(unit, bytes, status, reason)
         if (status == 0) call hash_bytes(unit, 0_ip, bytes, hash, status, reason)
         close (unit)
      end if
      if (status /= 0) call raise_unread(error, path, reason)
   end subroutine hash_file

   !> Checksum line of the bytes that follow it.
   subroutine make_checksum(unit, checksum_line, status, reason)
      integer, intent(in) :: unit
      character(len=checksum_length), intent(out) :: checksum_line
      integer, intent(out) :: status
      character(len=*), intent(inout) :: reason
      integer(lp) :: bytes, hash

      call find_length(unit, bytes, status, reason)
      bytes = bytes - int(checksum_length, lp)
      if (status == 0) call hash_bytes(unit, checksum_length, max(0_lp, bytes), hash, status, reason)
      if (status /= 0) return
      checksum_line = 'polydem: '//to_text(bytes)//' bytes follow, hash '//hexadecimal(hash)
      checksum_line(checksum_length:) = new_line('a')
   end subroutine make_checksum

   !> Hash of the bytes of a file after the first `skipped` bytes.
   subroutine hash_bytes(unit, skipped, bytes, hash, status, reason)
      integer, intent(in) :: unit
      integer(ip), intent(in) :: skipped
      integer(lp), intent(in) :: bytes
      integer(lp), intent(out) :: hash
      integer, intent(out) :: status
      character(len=*), intent(inout) :: reason
      integer(lp), allocatable :: words(:)
      integer(lp) :: partial(n_slices), remaining
      integer(bp) :: rest(8)
      integer(ip) :: k, n

      hash = bytes
      status = 0
      allocate (words(slice*n_slices))
      read (unit, pos=skipped + 1_ip, iostat=status, iomsg=reason)
      remaining = bytes/8_lp
      do while (remaining > 0_lp .and. status == 0)
         n = int(min(remaining, size(words, kind=lp)), ip)
         read (unit, iostat=status, iomsg=reason) words(:n)
         if (status /= 0) return
         !$omp parallel do if (n > slice) schedule(static) default(none) shared(n, words, partial) private(k)
         do k = 1_ip, (n + slice - 1_ip)/slice
            partial(k) = hash_words(words((k - 1_ip)*slice + 1_ip:min(k*slice, n)))
         end do
         !$omp end parallel do
         do k = 1_ip, (n + slice - 1_ip)/slice
            hash = mix_word(hash, partial(k))
         end do
         remaining = remaining - int(n, lp)
      end do
      rest = 0_bp
      n = int(modulo(bytes, 8_lp), ip)
      if (n > 0_ip .and. status == 0) read (unit, iostat=status, iomsg=reason) rest(:n)
      hash = mix_word(hash, transfer(rest, hash))
   end subroutine hash_bytes

   !> Hash of one slice
   pure integer(lp) function hash_words(words)
      integer(lp), intent(in) :: words(:)
      integer(ip) :: k

      hash_words = size(words, kind=lp)
      do k = 1_ip, size(words, kind=ip)
         hash_words = mix_word(hash_words, words(k))
      end do
   end function hash_words

end module polydem_file_checksum
