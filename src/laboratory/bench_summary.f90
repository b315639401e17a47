!> The results of a bench as a table on the screen, from its samples on disk.
module polydem_bench_summary
   use polydem_bench_settings, only: bench_settings_t
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip
   use polydem_log, only: log_t
   use polydem_sample_file, only: case_t, sample_path
   use polydem_step_clock, only: median
   implicit none
   private
   public :: write_summary

contains

   !> Write the median and least time per box and step over the repeats, for every case of a scene.
   subroutine write_summary(settings, scene, n_boxes, folder, log, error)
      type(bench_settings_t), intent(in) :: settings
      !> Name of the scene
      character(len=*), intent(in) :: scene
      !> Number of boxes of the scene
      integer(ip), intent(in) :: n_boxes
      !> Folder of the samples
      character(len=*), intent(in) :: folder
      !> Log on the screen
      type(log_t), intent(inout) :: log
      !> Allocated if a sample cannot be read
      type(error_t), allocatable, intent(inout) :: error
      character(len=110) :: line
      character(len=24) :: name
      real(dp) :: times(settings%repeats), first_step
      type(case_t) :: case
      integer :: f, r, t

      name = scene
      write (line, '(a24,i10,a)') name, n_boxes, ' boxes; ns per box and step, first step left out'
      call log%write_line(trim(line))
      write (line, '(a24,a10,4a12)') 'finder                  ', 'threads', 'repeats', 'median', 'least', 'first step'
      call log%write_line(trim(line))
      case%scene = scene
      do f = 1, size(settings%finders)
         do t = 1, size(settings%threads)
            case%finder = settings%finders(f)%text
            case%threads = settings%threads(t)
            do r = 1, settings%repeats
               case%repeat = int(r, ip)
               call read_time(sample_path(folder, case), case%threads == 1_ip, n_boxes, times(r), first_step, error)
               if (allocated(error)) return
            end do
            name = case%finder
            write (line, '(a24,i10,i12,3f12.2)') name, case%threads, settings%repeats, median(times), &
               minval(times), first_step
            call log%write_line(trim(line))
         end do
      end do
      call log%write_line('')
   end subroutine write_summary

   !> Mean time per box and step [ns] without the first step, unless it is the only one
   pure real(dp) function ns_per_box(seconds, n_boxes)
      !> Time of each step [s]
      real(dp), intent(in) :: seconds(:)
      !> Number of boxes
      integer(ip), intent(in) :: n_boxes
      integer :: first

      first = min(2, size(seconds))
      ns_per_box = 1.0e9_dp*sum(seconds(first:))/real(size(seconds) - first + 1, dp)/real(n_boxes, dp)
   end function ns_per_box

   !> Read the time per box and step of a sample, and that of its first step [ns].
   subroutine read_time(path, one_thread, n_boxes, time, first_time, error)
      character(len=*), intent(in) :: path
      logical, intent(in) :: one_thread
      integer(ip), intent(in) :: n_boxes
      real(dp), intent(out) :: time, first_time
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file
      real(dp), allocatable :: seconds(:)

      time = 0.0_dp
      first_time = 0.0_dp
      call file%open(path, error)
      if (allocated(error)) return
      if (one_thread) call file%read('/steps/processor', seconds, error)
      if (.not. one_thread) call file%read('/steps/elapsed', seconds, error)
      call file%close(error)
      if (allocated(error)) return
      time = ns_per_box(seconds, n_boxes)
      first_time = ns_per_box(seconds(:1), n_boxes)
   end subroutine read_time

end module polydem_bench_summary
