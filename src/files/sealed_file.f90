!> Files with a seal, which tells whether every bit is as it was written.
!>
!> The seal is a line of text in the first bytes of the file, which HDF5 leaves to its users (a *user block*; `head -1`
!> shows it). It states how many bytes follow and what their hash is. So a file that was cut or in which bits
!> flipped is found before anybody, HDF5 among them, relies on what it says.
!>
!> The hash is that of the hashes of slices, which threads share. Files without a seal have one as well, that of all
!> their bytes, for whoever writes it down elsewhere.
module polydem_sealed_file
   use, intrinsic :: iso_fortran_env, only: file_storage_size
   use polydem_errors, only: error_t, io_error, raise
   use polydem_hash, only: hexadecimal, mix_word
   use polydem_kinds, only: bp, ip, lp
   use polydem_paths, only: write_start
   use polydem_strings, only: to_text
   implicit none
   private
   public :: seal_length, seal_file, check_seal, hash_file

   !> Length of the seal [B]; the least that HDF5 allows
   integer(ip), parameter :: seal_length = 512_ip
   !> Words of 8 bytes in a slice
   integer(ip), parameter :: slice = 8192_ip
   !> Slices that are read at once
   integer(ip), parameter :: n_slices = 64_ip

contains

   !> Write the seal into the first bytes of a closed file, bring it to disk, and compare it with what is read back.
   subroutine seal_file(path, error)
      !> Path of the file, whose first `seal_length` bytes are free for the seal
      character(len=*), intent(in) :: path
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      character(len=256) :: reason
      character(len=:), allocatable :: problem
      character(len=seal_length) :: seal
      integer :: unit, status

      open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
            iostat=status, iomsg=reason)
      if (status == 0) then
         call make_seal(unit, seal, status, reason)
         close (unit)
      end if
      if (status /= 0) then
         call raise(error, io_error, path//': cannot be sealed: '//trim(reason))
         return
      end if
      call write_start(path, seal, error)
      if (allocated(error)) return
      call check_seal(path, problem)
      if (allocated(problem)) call raise(error, io_error, path//': was sealed, but when it was read back '//problem)
   end subroutine seal_file

   !> Compare a file with its seal.
   subroutine check_seal(path, problem)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> What is wrong with it; not allocated if every bit is as it was sealed
      character(len=:), allocatable, intent(out) :: problem
      character(len=256) :: reason
      character(len=seal_length) :: seal, expected
      integer :: unit, status

      open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
            iostat=status, iomsg=reason)
      if (status /= 0) then
         problem = 'it cannot be opened: '//trim(reason)
         return
      end if
      read (unit, iostat=status, iomsg=reason) seal
      if (status == 0) call make_seal(unit, expected, status, reason)
      close (unit)
      if (status /= 0) then
         problem = 'it cannot be read: '//trim(reason)
      else if (seal /= expected) then
         problem = 'it is not what was written, but was cut or changed'
      end if
   end subroutine check_seal

   !> Length and hash of a whole file.
   subroutine hash_file(path, bytes, hash, problem)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Its length [B]
      integer(lp), intent(out) :: bytes
      !> Hash of all its bytes
      integer(lp), intent(out) :: hash
      !> Why it cannot be read; not allocated if it was
      character(len=:), allocatable, intent(out) :: problem
      character(len=256) :: reason
      integer :: unit, status

      bytes = 0_lp
      hash = 0_lp
      open (newunit=unit, file=path, access='stream', form='unformatted', action='read', status='old', &
            iostat=status, iomsg=reason)
      if (status == 0) then
         inquire (unit=unit, size=bytes, iostat=status, iomsg=reason)
         bytes = max(0_lp, bytes*int(file_storage_size/8, lp))
         if (status == 0) call hash_bytes(unit, 0_ip, bytes, hash, status, reason)
         close (unit)
      end if
      if (status /= 0) problem = 'it cannot be read: '//trim(reason)
   end subroutine hash_file

   !> The seal that fits the bytes behind it.
   subroutine make_seal(unit, seal, status, reason)
      integer, intent(in) :: unit
      character(len=seal_length), intent(out) :: seal
      integer, intent(out) :: status
      character(len=*), intent(inout) :: reason
      integer(lp) :: bytes, hash

      inquire (unit=unit, size=bytes, iostat=status, iomsg=reason)
      bytes = bytes*int(file_storage_size/8, lp) - int(seal_length, lp)
      if (status == 0) call hash_bytes(unit, seal_length, max(0_lp, bytes), hash, status, reason)
      if (status /= 0) return
      seal = 'polydem: '//to_text(bytes)//' bytes follow, hash '//hexadecimal(hash)
      seal(seal_length:) = new_line('a')
   end subroutine make_seal

   !> Hash of so many bytes behind the first ones, which are left out.
   subroutine hash_bytes(unit, left_out, bytes, hash, status, reason)
      integer, intent(in) :: unit
      integer(ip), intent(in) :: left_out
      integer(lp), intent(in) :: bytes
      integer(lp), intent(out) :: hash
      integer, intent(out) :: status
      character(len=*), intent(inout) :: reason
      integer(lp), allocatable :: words(:)
      integer(lp) :: partial(n_slices), left
      integer(bp) :: rest(8)
      integer(ip) :: k, n

      hash = bytes
      status = 0
      allocate (words(slice*n_slices))
      read (unit, pos=left_out + 1_ip, iostat=status, iomsg=reason)
      left = bytes/8_lp
      do while (left > 0_lp .and. status == 0)
         n = int(min(left, size(words, kind=lp)), ip)
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
         left = left - int(n, lp)
      end do
      rest = 0_bp
      n = int(modulo(bytes, 8_lp), ip)
      if (n > 0_ip .and. status == 0) read (unit, iostat=status, iomsg=reason) rest(:n)
      hash = mix_word(hash, transfer(rest, hash))
   end subroutine hash_bytes

   pure integer(lp) function hash_words(words)
      integer(lp), intent(in) :: words(:)
      integer(ip) :: k

      hash_words = size(words, kind=lp)
      do k = 1_ip, size(words, kind=ip)
         hash_words = mix_word(hash_words, words(k))
      end do
   end function hash_words

end module polydem_sealed_file
