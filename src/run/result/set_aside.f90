!> Replacement of a result by `--force`: the result folder NAME is renamed to NAME.1, or the next number that is free,
!> with everything in it. The run then starts in a new folder. Nothing is removed, and one atomic call separates the
!> states before and after.
module polydem_set_aside
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: folder_of, make_folder, rename_file, sync_file
   use polydem_folder_lock, only: folder_lock_t
   use polydem_folders, only: canonical_path, link_exists
   use polydem_kinds, only: ip
   use polydem_strings, only: to_text
   implicit none
   private
   public :: set_aside

contains

   !> Rename a result folder, and make and lock a new one of the same name. A link to a folder stays; its target is
   !> renamed.
   subroutine set_aside(folder, inputs, shares, lock, note, error)
      !> Result folder
      character(len=*), intent(in) :: folder
      !> Paths of the input files of the run, blank-padded; empty and non-existent paths are ignored
      character(len=*), intent(in) :: inputs(:)
      !> Whether other ranks of the run share its lock
      logical, intent(in) :: shares
      !> On entry the lock of the result folder, on return that of the new folder
      type(folder_lock_t), intent(inout) :: lock
      !> Sentence for the log: where the result is
      character(len=:), allocatable, intent(inout) :: note
      !> Allocated if the folder stays as it is, or if there is no new one
      type(error_t), allocatable, intent(inout) :: error
      type(folder_lock_t) :: former
      character(len=:), allocatable :: path, aside, ignored
      integer(ip) :: k

      path = canonical_path(folder, error)
      call check_inputs(folder, path, inputs, error)
      if (allocated(error)) return
      do k = 1_ip, huge(k) - 1_ip
         aside = path//'.'//to_text(k)
         if (.not. link_exists(aside, error)) exit
      end do
      if (.not. allocated(error)) call rename_file(path, aside, error)
      if (allocated(error)) return
      note = 'former     result of '//folder//' is in '//aside
      former = lock
      lock = folder_lock_t()
      call make_folder(path, error)
      if (.not. allocated(error)) call sync_file(folder_of(path), error)
      if (.not. allocated(error)) call lock%acquire(folder, ignored, error, shares)
      call former%release(aside)
      if (allocated(error)) error%message = error%message//'. The former result is in '//aside
   end subroutine set_aside

   !> Refuse to rename a folder that holds an input of the run, or the working directory, to which paths refer.
   subroutine check_inputs(folder, path, inputs, error)
      character(len=*), intent(in) :: folder
      !> Canonical path of the folder
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: inputs(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (is_inside('.')) call raise(error, input_error, '--force would rename '//folder//', which holds the '// &
                                     'working directory. Call the program elsewhere, or choose another folder '// &
                                     'with --set output.folder=NAME')
      do k = 1, size(inputs)
         if (inputs(k) == '') cycle
         if (is_inside(trim(inputs(k)))) call raise(error, input_error, '--force would rename '//folder// &
            ', which holds '//trim(inputs(k))//', an input of this run. Choose another folder with --set '// &
            'output.folder=NAME, or copy the input first')
      end do

   contains

      !> Whether a path is the folder or lies in it
      logical function is_inside(input)
         character(len=*), intent(in) :: input

         is_inside = index(canonical_path(input, error)//'/', path//'/') == 1
      end function is_inside

   end subroutine check_inputs

end module polydem_set_aside
