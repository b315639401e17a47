!> Reference lists of pairs in an HDF5 file, so a bench computes them once.
module polydem_reference_file
   use polydem_atomic_file, only: begin_file, complete_file
   use polydem_errors, only: error_t, input_error, raise
   use polydem_hash, only: hexadecimal
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: bp, ip, lp
   use polydem_provenance, only: provenance_t, write_provenance
   use polydem_reference, only: new_reference, reference_t
   implicit none
   private
   public :: write_reference, read_reference

contains

   !> Write reference lists; all steps must be known.
   subroutine write_reference(path, reference, start, finish, provenance, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      type(reference_t), intent(in) :: reference
      !> Hash of all recorded bounds, or of the initial state
      integer(lp), intent(in) :: start
      !> Hash of the last state; 0 if there is none
      integer(lp), intent(in) :: finish
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
      call file%write('/start', hexadecimal(start), error, '1', 'hash of all recorded bounds, or of the initial state')
      call file%write('/finish', hexadecimal(finish), error, '1', 'hash of the last state; 0 if there is none')
      call complete_file(file, path, error)
   end subroutine write_reference

   !> Read reference lists, and check that they belong to the given boxes or state.
   subroutine read_reference(path, n_steps, start, reference, finish, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Number of steps
      integer(ip), intent(in) :: n_steps
      !> Hash of all recorded bounds, or of the initial state
      integer(lp), intent(in) :: start
      type(reference_t), intent(out) :: reference
      !> Hash of the last state; 0 if there is none
      integer(lp), intent(out) :: finish
      !> Allocated if the file cannot be read, or belongs to other boxes or steps
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      finish = 0_lp
      call new_reference(reference, n_steps)
      call file%open(path, error)
      if (allocated(error)) return
      call read_lists(path, file, n_steps, start, reference, finish, error)
      call file%close(error)
   end subroutine read_reference

   !> Read and check the data sets of an open file.
   subroutine read_lists(path, file, n_steps, start, reference, finish, error)
      character(len=*), intent(in) :: path
      type(hdf5_file_t), intent(in) :: file
      integer(ip), intent(in) :: n_steps
      integer(lp), intent(in) :: start
      type(reference_t), intent(inout) :: reference
      integer(lp), intent(out) :: finish
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text
      integer(ip), allocatable :: flags(:)

      finish = 0_lp
      call file%read('/start', text, error)
      if (.not. allocated(error)) call file%read('/pairs', reference%pairs, error)
      if (.not. allocated(error)) call file%read('/pair_hash', reference%hash, error)
      if (.not. allocated(error)) call file%read('/by_all_pairs', flags, error)
      if (.not. allocated(error)) call file%read('/other', reference%other, error)
      if (allocated(error)) return
      if (text /= hexadecimal(start) .or. &
          any([size(reference%pairs), size(reference%hash), size(flags)] /= n_steps)) then
         call raise(error, input_error, path//': belongs to other boxes or to another number of steps; remove it '// &
                    'and the samples of its scene, or choose another folder with --set bench.folder=NAME')
         return
      end if
      call file%read('/finish', text, error)
      if (allocated(error)) return
      read (text, '(z16)') finish
      reference%by_oracle = flags /= 0_ip
      reference%has_number = .true.
      reference%has_hash = .true.
   end subroutine read_lists

end module polydem_reference_file
