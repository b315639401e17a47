!> The verification benchmarks: simulations compared with theory and publications.
!>
!> usage: verify [--quick] [NAME...]     all benchmarks or those named, such as B8
!>
!> --quick runs short versions. Benchmarks without a short version run only if they are named.
!>
!> The table is printed row by row and written to results/verify, as table.csv and table.md. The exit code is 1
!> if a row misses its tolerance, 2 if there is no such benchmark, 3 if the table cannot be written.
program verify
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use omp_lib, only: omp_set_num_threads
   use benchmarks, only: benchmark_names, long_names, run_benchmark
   use polydem_errors, only: error_t
   use polydem_line_writer, only: line_writer_t
   use polydem_kinds, only: ip
   use polydem_file_system, only: make_folder
   use polydem_posix_processes, only: c_exit
   use polydem_provenance, only: collect_provenance, provenance_t
   use polydem_strings, only: to_text
   use verification_table, only: table_t
   implicit none

   character(len=*), parameter :: folder = 'results/verify'
   type(table_t) :: table
   type(error_t), allocatable :: error
   logical :: chosen(size(benchmark_names)), thorough
   integer :: k

   call read_arguments(chosen, thorough)
   call omp_set_num_threads(1)  ! threads of small scenes wait for each other more often than they work
   do k = 1, size(benchmark_names)
      if (chosen(k)) call run_benchmark(trim(benchmark_names(k)), table, thorough)
   end do
   write (output_unit, '(i0, a)') table%n_missed, ' rows missed their tolerance'
   call make_folder(folder, error)
   call write_text(folder//'/table.csv', table%as_csv(), error)
   call write_text(folder//'/table.md', heading(thorough)//table%as_markdown(), error)
   flush (output_unit)
   if (allocated(error)) then
      write (error_unit, '(2a)') 'verify: ', error%message
      call c_exit(int(error%code, c_int))
   end if
   if (table%n_missed > 0) call c_exit(1_c_int)

contains

   !> Read the options and the names of the benchmarks from the command line.
   subroutine read_arguments(chosen, thorough)
      logical, intent(out) :: chosen(:)
      logical, intent(out) :: thorough
      character(len=32) :: word
      integer :: k, b

      thorough = .true.
      chosen = .false.
      do k = 1, command_argument_count()
         call get_command_argument(k, word)
         if (word == '--quick') then
            thorough = .false.
         else if (word == '-h' .or. word == '--help') then
            write (output_unit, '(a)') 'usage: verify [--quick] [NAME...]     all benchmarks or those named:'
            write (output_unit, '(*(1x, a))') (trim(benchmark_names(b)), b=1, size(benchmark_names))
            call c_exit(0_c_int)
         else if (any(benchmark_names == word)) then
            where (benchmark_names == word) chosen = .true.
         else
            write (error_unit, '(3a, *(1x, a))') 'verify: unknown benchmark ', trim(word), '; choose from', &
               (trim(benchmark_names(b)), b=1, size(benchmark_names))
            call c_exit(2_c_int)
         end if
      end do
      if (any(chosen)) return
      do k = 1, size(benchmark_names)
         chosen(k) = thorough .or. all(long_names /= benchmark_names(k))
      end do
   end subroutine read_arguments

   !> Version, machine and date of the run, for the table in Markdown
   function heading(thorough) result(text)
      logical, intent(in) :: thorough
      character(len=:), allocatable :: text
      character(len=*), parameter :: line_end = new_line('a')
      type(provenance_t) :: p

      call collect_provenance(p, '-', '', '', 0_ip)
      text = '# Verification'//line_end//line_end//trim(merge('Thorough', 'Quick   ', thorough))//' run of polydem '// &
         p%text_of('version')//' (git '//p%text_of('revision')//'), '//p%text_of('build_type')//', '// &
         p%text_of('precision')//' precision, '//p%text_of('compiler')//line_end//'on '//p%text_of('processor')// &
         ', '//to_text(p%threads)//' threads, '//p%text_of('started')//'.'//line_end//line_end
   end function heading

   subroutine write_text(path, text, error)
      character(len=*), intent(in) :: path, text
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: writer

      if (.not. allocated(error)) call writer%open(path, error)
      if (allocated(error)) return
      call writer%put(text)
      call writer%close(error)
   end subroutine write_text

end program verify
