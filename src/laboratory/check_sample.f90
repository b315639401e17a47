!> Check that a sample on disk belongs to the present bench.
module polydem_check_sample
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hash, only: hexadecimal
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_provenance, only: provenance_t
   use polydem_sample_file, only: case_t
   use polydem_strings, only: quoted
   implicit none
   private
   public :: check_sample

contains

   !> Refuse a sample of another case, program or machine.
   subroutine check_sample(path, case, provenance, error)
      !> Path of the sample
      character(len=*), intent(in) :: path
      type(case_t), intent(in) :: case
      !> The present program and machine
      type(provenance_t), intent(in) :: provenance
      !> Allocated if they differ; names the entry
      type(error_t), allocatable, intent(inout) :: error
      character(len=15), parameter :: facts(10) = [character(len=15) :: 'version', 'revision', 'build_type', &
         'compiler', 'options', 'precision', 'processor', 'instruction_set', 'binding', 'wait_policy']
      type(hdf5_file_t) :: file
      integer :: k

      call file%open(path, error)
      if (allocated(error)) return
      call compare('/case/scene', case%scene)
      call compare('/case/mode', case%mode)
      call compare('/case/finder', case%finder)
      call compare('/case/trace', case%trace)
      call compare('/case/identity', hexadecimal(case%identity))
      call compare('/case/pair_hash', hexadecimal(case%pair_hash))
      do k = 1, size(facts)
         call compare('/provenance/'//trim(facts(k)), provenance%text_of(trim(facts(k))))
      end do
      call file%close(error)

   contains

      subroutine compare(name, expected)
         character(len=*), intent(in) :: name, expected
         character(len=:), allocatable :: found

         if (.not. allocated(error)) call file%read(name, found, error)
         if (allocated(error)) return
         if (found /= expected) call raise(error, input_error, path//': '//name//' is '//quoted(found)//', not '// &
            quoted(expected)//' as in this bench. Such samples cannot be compared: choose another folder with '// &
            '--set bench.folder=NAME, or remove the samples folder to measure again')
      end subroutine compare

   end subroutine check_sample

end module polydem_check_sample
