!> Writes the series of a run as comma-separated values (series.csv), from the segments of its trajectory.
module polydem_series_csv
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_line_writer, only: line_writer_t
   use polydem_named_values, only: named_values_t
   use polydem_result_files, only: segment_path
   implicit none
   private
   public :: write_series_csv

   !> Bytes that no number exceeds, with the comma behind it
   integer, parameter :: longest_number = 32

contains

   !> Write all rows of the closed segments of a trajectory.
   subroutine write_series_csv(path, folder, last, row, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Result folder
      character(len=*), intent(in) :: folder
      !> Number of the last segment
      integer(ip), intent(in) :: last
      !> Columns of the series
      type(named_values_t), intent(in) :: row
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: file
      character(len=:), allocatable :: header
      integer(ip) :: number
      integer :: k

      if (allocated(error)) return
      call file%open(path, error)
      header = 'step,time [s]'
      if (allocated(row%label)) then
         do k = 1, size(row%label)
            header = header//','//trim(row%label(k)%name)//' ['//trim(row%label(k)%unit)//']'
         end do
      end if
      if (.not. allocated(error)) call file%put_line(header)
      do number = 1_ip, last
         if (.not. allocated(error)) call put_segment(segment_path(folder, number), row, file, error)
      end do
      call file%close(error)
   end subroutine write_series_csv

   !> Write the rows of a segment, if it has any.
   subroutine put_segment(path, row, file, error)
      character(len=*), intent(in) :: path
      type(named_values_t), intent(in) :: row
      type(line_writer_t), intent(inout) :: file
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: segment
      integer(lp), allocatable :: step(:)
      real(dp), allocatable :: column(:), value(:, :)
      character(len=:), allocatable :: line
      logical :: has_rows
      integer :: j, k, n

      call segment%open(path, error)
      if (allocated(error)) return
      has_rows = segment%has('/series/step', error)
      if (has_rows) then
         n = 1
         if (allocated(row%label)) n = n + size(row%label)
         call segment%read('/series/step', step, error)
         if (.not. allocated(error)) allocate (value(n, size(step)))
         do k = 1, n
            if (allocated(error)) exit
            if (k == 1) call segment%read('/series/time', column, error)
            if (k > 1) call segment%read('/series/'//trim(row%label(k - 1)%name), column, error)
            if (.not. allocated(error)) value(k, :) = column(:size(step))
         end do
         if (.not. allocated(error)) then
            allocate (character(len=longest_number*(n + 1)) :: line)
            do j = 1, size(step)
               write (line, '(i0, *(:, ",", g0))') step(j), value(:, j)
               call file%put_line(trim(line))
            end do
         end if
      end if
      call segment%close(error)
   end subroutine put_segment

end module polydem_series_csv
