!> Reference lists of pairs in an HDF5 file, so a bench computes them once.
module polydem_reference_file
   use polydem_atomic_file, only: begin_file, complete_file
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hash, only: hexadecimal
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: bp, ip
   use polydem_provenance, only: provenance_t, write_provenance
   use polydem_reference, only: reference_t
   implicit none
   private
   public :: write_reference, read_reference

contains

   !> Write reference lists; all steps must be known.
   subroutine write_reference(path, reference, provenance, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      type(reference_t), intent(in) :: reference
      !> Provenance of the file
      type(provenance_t), intent(in) :: provenance
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      call begin_file(file, path, error)
      if (allocated(error)) return
      call write_provenance(file, 'expected lists of pairs by polydem', provenance, error)
      call file%write('/pairs', reference%pairs, error, '1', 'number of pairs of each step')
      call file%write('/pair_hash', reference%hash, error, '1', 'sum modulo 2^64 of the hashes of the pairs')
      call file%write('/by_all_pairs', merge(1_bp, 0_bp, reference%by_oracle), error, '1', &
                      '1: all pairs were compared at this step')
      call file%write('/other', reference%other, error, '1', 'source of the lists of the other steps')
      call file%write('/start', hexadecimal(reference%start), error, '1', &
                      'hash of all recorded bounds, or of the initial state')
      call file%write('/finish', hexadecimal(reference%finish), error, '1', &
                      'hash of the last state; 0 if there is none')
      call complete_file(file, path, error)
   end subroutine write_reference

   !> Read reference lists, and check that they belong to the given boxes or state.
   subroutine read_reference(path, reference, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> The lists; their hash `start` and the number of steps are given
      type(reference_t), intent(inout) :: reference
      !> Allocated if the file cannot be read, or belongs to other boxes or steps
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      call file%open(path, error)
      if (allocated(error)) return
      call read_lists(path, file, reference, error)
      call file%close(error)
   end subroutine read_reference

   !> Read and check the data sets of an open file.
   subroutine read_lists(path, file, reference, error)
      character(len=*), intent(in) :: path
      type(hdf5_file_t), intent(in) :: file
      type(reference_t), intent(inout) :: reference
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text
      integer(ip), allocatable :: flags(:)

      call file%read('/start', text, error)
      if (.not. allocated(error)) call file%read('/pairs', reference%pairs, error)
      if (.not. allocated(error)) call file%read('/pair_hash', reference%hash, error)
      if (.not. allocated(error)) call file%read('/by_all_pairs', flags, error)
      if (.not. allocated(error)) call file%read('/other', reference%other, error)
      if (allocated(error)) return
      if (text /= hexadecimal(reference%start) .or. &
          any([size(reference%pairs), size(reference%hash), size(flags)] /= size(reference%by_oracle))) then
         call raise(error, input_error, path//': belongs to other boxes or to another number of steps; remove it '// &
                    'and the samples of its scene, or choose another folder with --set bench.folder=NAME')
         return
      end if
      call file%read('/finish', text, error)
      if (allocated(error)) return
      read (text, '(z16)') reference%finish
      reference%by_oracle = flags /= 0_ip
      reference%has_number = .true.
      reference%has_hash = .true.
   end subroutine read_lists

end module polydem_reference_file
