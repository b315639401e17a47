!> Standard parts of a log: header, table of timings, counters, hash of the final state.
module polydem_log_tables
   use polydem_counters, only: counters_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_log, only: line_width, log_t
   use polydem_provenance, only: provenance_t
   use polydem_strings, only: decimal, printable, to_text
   use polydem_timers, only: n_stages, stage_names, timers_t
   implicit none
   private
   public :: write_header, write_timings, write_ranks, write_counters, write_hash

contains

   !> Write the header: program, machine, input and result folder.
   subroutine write_header(log, provenance, folder)
      type(log_t), intent(inout) :: log
      type(provenance_t), intent(in) :: provenance
      !> Folder of the result
      character(len=*), intent(in) :: folder

      associate (p => provenance)
         call write_wrapped(log, 'polydem '//p%text_of('version')//' (git '//p%text_of('revision')//'), '// &
                            p%text_of('build_type')//', '//p%text_of('precision')//' precision, '// &
                            p%text_of('compiler')//', HDF5 '//p%text_of('hdf5_version'))
         call write_wrapped(log, 'options    '//p%text_of('options'))
         call write_wrapped(log, 'machine    '//p%text_of('host')//', '//p%text_of('processor'))
         call write_wrapped(log, 'kernels    '//p%text_of('instruction_set'))
         call write_wrapped(log, 'caches     '//p%text_of('caches'))
         if (p%processes > 1_ip) call write_wrapped(log, 'processes  '//to_text(p%processes)//', by MPI, each with')
         call write_wrapped(log, 'threads    '//to_text(p%threads)//' on '//to_text(p%processors)// &
                            ' processors'//because(p%text_of('thread_choice')))
         call write_wrapped(log, 'input      '//printable(p%text_of('input_file'))//', seed '//to_text(p%seed))
         call write_wrapped(log, 'result     '//printable(folder))
         call write_wrapped(log, 'started    '//p%text_of('started'))
      end associate
   end subroutine write_header

   !> A reason in brackets; empty if there is none
   pure function because(reason) result(text)
      character(len=*), intent(in) :: reason
      character(len=:), allocatable :: text

      text = ''
      if (reason /= '') text = ' ('//reason//')'
   end function because

   !> Write the time of each stage, per step and in total, and the speed of the run. Stages that never ran are omitted.
   subroutine write_timings(log, timers, seconds, steps, bodies)
      type(log_t), intent(inout) :: log
      type(timers_t), intent(in) :: timers
      !> Elapsed time of the whole run [s]
      real(dp), intent(in) :: seconds
      !> Number of steps done
      integer(lp), intent(in) :: steps
      !> Number of bodies
      integer(ip), intent(in) :: bodies
      character(len=line_width) :: line
      character(len=14) :: name
      integer :: k

      call log%write_line('')
      write (line, '(a14,a12,3a14,a14,a10)') 'stage         ', 'steps', 'least [us]', 'mean [us]', &
         'most [us]', 'total [s]', 'share'
      call log%write_line(trim(line))
      do k = 1, n_stages
         if (timers%calls(k) == 0_lp) cycle
         name = stage_names(k)
         write (line, '(a14,i12,3f14.2,f14.3,f9.1,a)') name, timers%calls(k), &
            1.0e6_dp*timers%least(k), 1.0e6_dp*timers%total(k)/real(timers%calls(k), dp), &
            1.0e6_dp*timers%most(k), timers%total(k), share(timers%total(k), seconds), '%'
         call log%write_line(trim(line))
      end do
      call write_sum(log, 'other', seconds - sum(timers%total), seconds)
      call write_sum(log, 'all', seconds, seconds)
      if (seconds <= 0.0_dp .or. steps < 1_lp .or. bodies < 1_ip) return
      call log%write_line('')
      call log%write_line(to_text(steps)//' steps of '//to_text(bodies)//' bodies in '// &
                          decimal(seconds, 3)//' s: '//decimal(real(steps, dp)/seconds, 1)//' steps/s, '// &
                          decimal(1.0e6_dp*seconds/(real(steps, dp)*real(bodies, dp)), 4)// &
                          ' us per step and body')
   end subroutine write_timings

   !> Write the distribution of the time of each stage over ranks. The time of stage `decomposition`
   !> includes waiting times.
   subroutine write_ranks(log, total)
      type(log_t), intent(inout) :: log
      !> Total time, (stage, rank) [s]
      real(dp), intent(in) :: total(:, :)
      character(len=line_width) :: line
      character(len=14) :: name
      real(dp) :: mean
      integer :: k

      call log%write_line('')
      write (line, '(a14,4a14)') 'over ranks    ', 'least [s]', 'mean [s]', 'most [s]', 'most/mean'
      call log%write_line(trim(line))
      do k = 1, size(total, 1)
         mean = sum(total(k, :))/real(size(total, 2), dp)
         if (.not. mean > 0.0_dp) cycle
         name = stage_names(k)
         write (line, '(a14,3f14.3,f14.2)') name, minval(total(k, :)), mean, maxval(total(k, :)), &
            maxval(total(k, :))/mean
         call log%write_line(trim(line))
      end do
   end subroutine write_ranks

   !> Write one counter per line, and what it belongs to.
   subroutine write_counters(log, counters)
      type(log_t), intent(inout) :: log
      !> Exact counts
      type(counters_t), intent(in) :: counters
      character(len=line_width) :: line
      integer :: k

      if (.not. allocated(counters%name)) return
      call log%write_line('')
      do k = 1, size(counters%name)
         write (line, '(a,i20,2x,a)') counters%name(k), counters%value(k), counters%scope(k)
         call log%write_line(trim(line))
      end do
   end subroutine write_counters

   !> Write the hash of the final state. It is the last line of a log.
   subroutine write_hash(log, state_hash)
      type(log_t), intent(inout) :: log
      !> Hash of the final state, hexadecimal, as in the profile
      character(len=*), intent(in) :: state_hash

      call log%write_line('state hash: '//state_hash)
   end subroutine write_hash

   !> Write a row of the table of timings that has only a total and a share.
   subroutine write_sum(log, name, part, whole)
      type(log_t), intent(inout) :: log
      character(len=*), intent(in) :: name
      real(dp), intent(in) :: part, whole
      character(len=line_width) :: line
      character(len=14) :: padded

      padded = name
      write (line, '(a14,54x,f14.3,f9.1,a)') padded, part, share(part, whole), '%'
      call log%write_line(trim(line))
   end subroutine write_sum

   !> Share of a part in the whole [%]; 0 if the whole is not positive
   pure real(dp) function share(part, whole)
      real(dp), intent(in) :: part, whole

      share = 0.0_dp
      if (whole > 0.0_dp) share = 100.0_dp*part/whole
   end function share

   !> Write a text, broken at blanks into lines of at most `line_width` characters. Lines after the first are indented.
   subroutine write_wrapped(log, text)
      type(log_t), intent(inout) :: log
      character(len=*), intent(in) :: text
      character(len=*), parameter :: indent = '           '
      character(len=:), allocatable :: rest
      integer :: cut

      rest = text
      do while (len(rest) > line_width)
         cut = index(rest(:line_width + 1), ' ', back=.true.)
         if (cut <= len(indent) + 1) cut = line_width
         call log%write_line(trim(rest(:cut)))
         rest = indent//adjustl(rest(cut + 1:))
      end do
      call log%write_line(trim(rest))
   end subroutine write_wrapped

end module polydem_log_tables
