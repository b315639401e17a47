!> Reads a packing: bodies from the last frame of a trajectory, or from a bodies file.
module polydem_trajectory_reader
   use polydem_bodies, only: bodies_t
   use polydem_bodies_reader, only: read_bodies_file
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: is_folder
   use polydem_frame_reader, only: list_frame
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, lp, wp
   use polydem_result_files, only: last_segment
   implicit none
   private
   public :: read_packing

contains

   !> Read the bodies of a packing.
   subroutine read_packing(path, bodies, error)
      !> Result folder, segment of a trajectory, or bodies file
      character(len=*), intent(in) :: path
      !> Bodies, with angle 0
      type(bodies_t), intent(out) :: bodies
      !> Names the path and the defect
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: file_path
      type(hdf5_file_t) :: file
      type(body_list_t) :: list
      real(dp), allocatable :: times(:)
      logical :: is_segment

      file_path = path
      if (is_folder(path, error)) file_path = last_segment(path, error)
      if (allocated(error)) return
      if (file_path == '') then
         call raise(error, input_error, path//' contains no closed segment of a trajectory. Check that its run has '// &
                    'ended')
         return
      end if
      call file%open(file_path, error)
      if (allocated(error)) return
      is_segment = file%has('frames', error)
      if (is_segment) call file%read('/frames/time', times, error)
      call file%close(error)
      if (allocated(error)) return
      if (is_segment) then
         call list_frame(file_path, size(times, kind=lp) - 1_lp, list, error)
      else
         call read_bodies_file(file_path, 1.0_wp, list, error)
      end if
      if (.not. allocated(error)) call new_bodies(list, bodies, error)
   end subroutine read_packing

end module polydem_trajectory_reader
