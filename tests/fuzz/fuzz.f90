!> Spoilt input by the thousand in one process: fuzz KIND FOLDER FIRST LAST, from an empty working directory.
!>
!> FOLDER holds the inputs of the repository. The number of a case alone decides what it is, so that
!> `fuzz KIND FOLDER K K` repeats case K. For whoever watches, the file `case` holds the number of the case being
!> tried, and the file `maps` says which addresses belong to which library. Ends with code 1 if a reader broke its
!> promise; a crash is a broken promise, too.
program fuzz
   use, intrinsic :: iso_fortran_env, only: error_unit
   use fuzz_cases, only: spoilt_file, try_bodies, try_bytes, try_checkpoint, try_namelist, try_override, try_scene, &
      try_segment, try_trace, write_sound_file
   use hostile_fields, only: field_t
   use hostile_file, only: count_open_objects, start_hdf5
   use spoilt_checkpoint, only: sound_checkpoint
   use polydem_clock, only: wall_seconds
   use polydem_errors, only: error_t, input_error, io_error, run_error
   use polydem_kinds, only: dp, ip
   use polydem_random, only: new_random, random_t
   use polydem_strings, only: text_t
   use polydem_text_file, only: read_text_file
   implicit none

   character(len=16), parameter :: namelists(*) = [character(len=16) :: 'stack.nml', 'drum.nml', 'gas.nml', &
      'heap.nml', 'hopper.nml', 'incline.nml', 'bed.nml', 'bench_scenes.nml']
   type(text_t) :: sound(size(namelists))
   type(field_t), allocatable :: checkpoint(:)
   type(random_t) :: random
   type(error_t), allocatable :: error
   character(len=1024) :: words(4)
   character(len=:), allocatable :: bytes
   real(dp) :: began, longest
   integer(ip) :: first, k, last, n_read, slowest
   integer :: i, n_open, unit

   do i = 1, 4
      call get_command_argument(i, words(i))
   end do
   read (words(3:4), *) first, last
   call start_hdf5()
   call copy_maps()
   call prepare()
   n_open = count_open_objects()
   open (newunit=unit, file='case', access='stream', form='unformatted', action='write', status='replace')
   n_read = 0_ip
   slowest = first
   longest = 0.0_dp
   do k = first, last
      write (unit, pos=1) k
      flush (unit)
      random = new_random(k)
      if (allocated(error)) deallocate (error)
      began = wall_seconds()
      call try_case(trim(words(1)))
      if (wall_seconds() - began > longest) then
         longest = wall_seconds() - began
         slowest = k
      end if
      call judge()
   end do
   close (unit, status='delete')
   write (error_unit, '(2a,i0,a,i0,a,f0.2,a,i0)') trim(words(1)), ': ', last - first + 1_ip, ' cases, ', n_read, &
      ' of them read, the slowest in ', longest, ' s: ', slowest

contains

   subroutine copy_maps()
      character(len=512) :: line
      integer :: from, status, to

      open (newunit=from, file='/proc/self/maps', action='read', status='old', iostat=status)
      if (status /= 0) return
      open (newunit=to, file='maps', action='write', status='replace')
      do
         read (from, '(a)', iostat=status) line
         if (status /= 0) exit
         write (to, '(a)') trim(line)
      end do
      close (from)
      close (to)
   end subroutine copy_maps

   !> What the cases are made from
   subroutine prepare()
      integer :: n

      random = new_random(0_ip)
      if (words(1) == 'checkpoint') checkpoint = sound_checkpoint()
      n = index(words(1), '_bytes')
      if (n > 0) then
         call write_sound_file(words(1) (:n - 1), 'sound.h5', random)
         call read_text_file('sound.h5', bytes, error)
      end if
      do n = 1, size(namelists)
         if (.not. allocated(error)) call read_text_file(trim(words(2))//'/'//namelists(n), sound(n)%text, error)
      end do
      if (allocated(error)) error stop 'fuzz: the sound input cannot be read'
   end subroutine prepare

   subroutine try_case(kind_of_case)
      character(len=*), intent(in) :: kind_of_case
      integer(ip) :: which

      which = random%whole(1_ip, size(namelists, kind=ip))
      select case (kind_of_case)
      case ('namelist')
         call try_namelist(random, sound(which)%text, error)
      case ('override')
         call try_override(random, sound(1)%text, error)
      case ('scene')
         call try_scene(random, sound(min(which, 7_ip))%text, error)
      case ('bodies')
         call try_bodies(random, error)
      case ('trace')
         call try_trace(random, error)
      case ('checkpoint')
         call try_checkpoint(random, checkpoint, error)
      case ('packing', 'result')
         call try_segment(kind_of_case, random, error)
      case ('bodies_bytes', 'trace_bytes', 'checkpoint_bytes', 'packing_bytes', 'result_bytes')
         call try_bytes(kind_of_case(:index(kind_of_case, '_') - 1), random, bytes, error)
      case default
         error stop 'fuzz: there is no such kind of cases'
      end select
   end subroutine try_case

   !> A refusal has a code and a message that names the input or a body, and nothing of HDF5 stays open.
   subroutine judge()
      if (count_open_objects() /= n_open) call complain('an object of HDF5 was left open')
      if (.not. allocated(error)) then
         n_read = n_read + 1_ip
      else if (all([input_error, io_error, run_error] /= error%code) .or. len(error%message) < 20) then
         call complain('a refusal without code or message: '//error%message)
      else if (all([index(error%message, spoilt_file), index(error%message, '.nml'), index(error%message, '--set '), &
                    index(error%message, 'body ')] == 0) .and. error%code /= run_error) then
         call complain('a refusal that does not name its input: '//error%message)
      end if
   end subroutine judge

   subroutine complain(text)
      character(len=*), intent(in) :: text

      write (error_unit, '(a)') 'broken promise: '//text
      error stop 1
   end subroutine complain

end program fuzz
