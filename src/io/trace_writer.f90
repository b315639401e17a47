!> Records the bounding boxes of consecutive steps in a trace file. Any neighbour finder can replay a trace.
!>
!>     aabb        (steps, boxes, 4): xmin, ymin, xmax, ymax of each box
!>     step        (steps): number of the time step
!>     npairs      (steps): number of pairs of bodies whose boxes overlap
!>     pair_hash   (steps): sum modulo 2^64 of the hashes of these pairs
!>     is_wall     (boxes): 1 if the body of the box is fixed
!>     reach       (boxes): greatest half side of the box at any angle of its body
!>     body        (boxes): body of each box, from 1; only if a body has several boxes
!>     provenance  origin of the file
!>     dt          attribute of the file: time between steps [s]
module polydem_trace_writer
   use polydem_atomic_file, only: begin_file, complete_file, discard_file
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t, one_row
   use polydem_kinds, only: bp, dp, ip, lp, wp
   use polydem_provenance, only: provenance_t, write_provenance
   implicit none
   private
   public :: trace_writer_t

   !> A trace, open for writing
   type :: trace_writer_t
      !> Number of steps written so far
      integer(ip) :: n_steps = 0_ip
      !> Whether the file is open
      logical :: is_open = .false.
      !> The file
      type(hdf5_file_t), private :: file
      !> Final path of the file
      character(len=:), allocatable, private :: path
   contains
      procedure :: open => open_trace
      procedure :: add
      procedure :: close => close_trace
   end type trace_writer_t

contains

   !> Create the file of a trace.
   subroutine open_trace(self, path, body, fixed, reach, dt, provenance, error)
      class(trace_writer_t), intent(inout) :: self
      !> Final path of the file
      character(len=*), intent(in) :: path
      !> Slot of the body of each box, ascending, (boxes)
      integer(ip), intent(in) :: body(:)
      !> Whether the body of each box is fixed, (boxes)
      logical, intent(in) :: fixed(:)
      !> Greatest half side of each box at any angle, (boxes) [m]
      real(wp), intent(in) :: reach(:)
      !> Time between steps [s]
      real(wp), intent(in) :: dt
      type(provenance_t), intent(in) :: provenance
      type(error_t), allocatable, intent(inout) :: error

      self%path = path
      self%n_steps = 0_ip
      call begin_file(self%file, path, error, compressed=.true.)
      if (allocated(error)) return
      self%is_open = .true.
      associate (file => self%file)
         call write_provenance(file, 'trace of boxes by polydem', provenance, error)
         call file%write_attribute('/', 'dt', real(dt, dp), error)
         call file%write('/is_wall', merge(1_bp, 0_bp, fixed), error, '1', '1: the body of the box is fixed')
         call file%write('/reach', real(reach, dp), error, 'm', 'greatest half side of the box at any angle')
         if (body(size(body)) /= size(body)) then
            call file%write('/body', body, error, '1', 'body of each box, counted from 1')
         end if
      end associate
      if (allocated(error)) call close_trace(self, error)
   end subroutine open_trace

   !> Add a step. After a failure the file is removed and closed.
   subroutine add(self, step, bounds, n_pairs, hash, error)
      class(trace_writer_t), intent(inout) :: self
      !> Number of the time step
      integer(lp), intent(in) :: step
      !> Bounds of the boxes, (4, boxes) [m]
      real(wp), intent(in) :: bounds(:, :)
      !> Number of pairs
      integer(ip), intent(in) :: n_pairs
      !> Sum of the hashes of the pairs
      integer(lp), intent(in) :: hash
      type(error_t), allocatable, intent(inout) :: error

      call self%file%write('/aabb', real(bounds, dp), error, 'm', 'xmin, ymin, xmax, ymax of each box', rows=one_row)
      call self%file%write('/step', step, error, '1', 'number of the time step', rows=one_row)
      call self%file%write('/npairs', n_pairs, error, '1', 'pairs of bodies whose boxes overlap', rows=one_row)
      call self%file%write('/pair_hash', hash, error, '1', 'sum modulo 2^64 of the hashes of these pairs', rows=one_row)
      self%n_steps = self%n_steps + 1_ip
      if (allocated(error)) call close_trace(self, error)
   end subroutine add

   !> Complete the file. A file without steps is removed instead.
   subroutine close_trace(self, error)
      class(trace_writer_t), intent(inout) :: self
      !> On entry an earlier error, if any; on return the reason why there is no complete file
      type(error_t), allocatable, intent(inout) :: error

      if (.not. self%is_open) return
      self%is_open = .false.
      if (self%n_steps == 0_ip .and. .not. allocated(error)) then
         call discard_file(self%file, self%path, error)
      else
         call complete_file(self%file, self%path, error)
      end if
   end subroutine close_trace

end module polydem_trace_writer
