!> Timings and counts of every step of a run (steps.h5), written in blocks of steps.
!>
!>     steps/step      (steps): number of the time step
!>     steps/stage     (steps, stages): seconds of each stage, steps/stage_name
!>     steps/phase     (steps, phases): seconds of each phase of the finder, steps/phase_name
!>     steps/count     (steps, counts): finder statistics of the step, or state of the finder after it, steps/count_name
!>     steps/pairs     (steps): pairs of bodies whose boxes overlap
!>     steps/contacts  (steps): contacts
!>     provenance      origin of the file
module polydem_step_writer
   use polydem_atomic_file, only: begin_file, complete_file
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t, many_rows
   use polydem_kinds, only: dp, ip, lp
   use polydem_provenance, only: provenance_t, write_provenance
   implicit none
   private
   public :: step_writer_t, step_row_t

   !> Number of steps in a block
   integer(ip), parameter :: block_size = 1024_ip

   !> Record of one step
   type :: step_row_t
      !> Number of the time step
      integer(lp) :: step
      !> Time of each stage, (stage) [s]
      real(dp), allocatable :: stage(:)
      !> Time of each phase of the finder, (phase) [s]
      real(dp), allocatable :: phase(:)
      !> Finder statistics, (count)
      integer(lp), allocatable :: count(:)
      !> Numbers of pairs and contacts
      integer(ip) :: pairs, contacts
   end type step_row_t

   !> A file of steps, open for writing
   type :: step_writer_t
      !> Whether the file is open
      logical :: is_open = .false.
      !> The file
      type(hdf5_file_t), private :: file
      !> Final path of the file
      character(len=:), allocatable, private :: path
      !> Number of buffered steps
      integer(ip), private :: n = 0_ip
      !> Numbers of the buffered steps, (step)
      integer(lp), allocatable, private :: step(:)
      !> Times of the buffered steps, (stages, step) and (phases, step) [s]
      real(dp), allocatable, private :: stage(:, :), phase(:, :)
      !> Finder statistics of the buffered steps, (counts, step)
      integer(lp), allocatable, private :: count(:, :)
      !> Numbers of pairs and contacts of the buffered steps, (step)
      integer(ip), allocatable, private :: pairs(:), contacts(:)
   contains
      procedure :: open => open_steps
      procedure :: add
      procedure :: close => close_steps
   end type step_writer_t

contains

   !> Create the file.
   subroutine open_steps(self, path, stage_names, phase_names, count_names, provenance, error)
      class(step_writer_t), intent(inout) :: self
      !> Final path of the file
      character(len=*), intent(in) :: path
      !> Names of the stages, of the phases of the finder and of its statistics
      character(len=*), intent(in) :: stage_names(:), phase_names(:), count_names(:)
      type(provenance_t), intent(in) :: provenance
      type(error_t), allocatable, intent(inout) :: error

      self%path = path
      self%n = 0_ip
      allocate (self%step(block_size), self%pairs(block_size), self%contacts(block_size))
      allocate (self%stage(size(stage_names), block_size), self%phase(size(phase_names), block_size))
      allocate (self%count(size(count_names), block_size))
      call begin_file(self%file, path, error)
      if (allocated(error)) return
      self%is_open = .true.
      associate (file => self%file)
         call write_provenance(file, 'steps of a run by polydem', provenance, error)
         call file%write('/steps/stage_name', stage_names, error, '1', 'stages of the time step')
         call file%write('/steps/phase_name', phase_names, error, '1', 'phases of the neighbour finder')
         call file%write('/steps/count_name', count_names, error, '1', 'statistics of the neighbour finder')
      end associate
      if (allocated(error)) call close_steps(self, error)
   end subroutine open_steps

   !> Add a step. After a failure the file is removed and closed.
   subroutine add(self, row, error)
      class(step_writer_t), intent(inout) :: self
      type(step_row_t), intent(in) :: row
      type(error_t), allocatable, intent(inout) :: error

      self%n = self%n + 1_ip
      self%step(self%n) = row%step
      self%stage(:, self%n) = row%stage
      self%phase(:, self%n) = row%phase
      self%count(:, self%n) = row%count
      self%pairs(self%n) = row%pairs
      self%contacts(self%n) = row%contacts
      if (self%n == block_size) call write_block(self, error)
      if (allocated(error)) call close_steps(self, error)
   end subroutine add

   !> Write the buffered steps and complete the file.
   subroutine close_steps(self, error)
      class(step_writer_t), intent(inout) :: self
      !> On entry an earlier error, if any; on return the reason why there is no complete file
      type(error_t), allocatable, intent(inout) :: error

      if (.not. self%is_open) return
      self%is_open = .false.
      if (.not. allocated(error)) call write_block(self, error)
      call complete_file(self%file, self%path, error)
   end subroutine close_steps

   !> Write the buffered steps and empty the buffer.
   subroutine write_block(self, error)
      type(step_writer_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error

      associate (file => self%file, n => self%n)
         call file%write('/steps/step', self%step(:n), error, '1', 'number of the time step', rows=many_rows)
         call file%write('/steps/stage', self%stage(:, :n), error, 's', 'time of each stage', rows=many_rows)
         call file%write('/steps/phase', self%phase(:, :n), error, 's', 'time of each phase of the finder', &
                         rows=many_rows)
         call file%write('/steps/count', self%count(:, :n), error, '1', &
                         'statistics of the finder in the step, or its state after it', rows=many_rows)
         call file%write('/steps/pairs', self%pairs(:n), error, '1', 'pairs of bodies whose boxes overlap', &
                         rows=many_rows)
         call file%write('/steps/contacts', self%contacts(:n), error, '1', 'contacts', rows=many_rows)
      end associate
      self%n = 0_ip
   end subroutine write_block

end module polydem_step_writer
