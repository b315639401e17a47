!> Times and counts of every step of a run, written in blocks.
!>
!>     steps/step      (steps): number of the time step
!>     steps/stage     (steps, stages): seconds of each stage, steps/stage_name
!>     steps/phase     (steps, phases): seconds of each phase of the finder, steps/phase_name
!>     steps/count     (steps, counts): the finder's work in the step, or its present state, steps/count_name
!>     steps/pairs     (steps): pairs of bodies whose boxes overlap
!>     steps/contacts  (steps): contacts
!>     provenance      where it comes from
module polydem_step_file
   use polydem_complete_file, only: begin_file, complete_file
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_provenance, only: provenance_t, write_provenance
   use polydem_segment, only: schema_version
   implicit none
   private
   public :: step_file_t, step_row_t

   !> Steps of a block
   integer(ip), parameter :: block_size = 1024_ip

   !> What is known of one step
   type :: step_row_t
      !> Number of the time step
      integer(lp) :: step
      !> Seconds of each stage
      real(dp), allocatable :: stage(:)
      !> Seconds of each phase of the finder
      real(dp), allocatable :: phase(:)
      !> Counts of the finder
      integer(lp), allocatable :: count(:)
      !> Pairs and contacts
      integer(ip) :: pairs, contacts
   end type step_row_t

   !> A file of steps that is being written
   type :: step_file_t
      !> Whether there is an open file
      logical :: is_open = .false.
      !> The file
      type(hdf5_file_t), private :: file
      !> Its name once it is complete
      character(len=:), allocatable, private :: path
      !> Steps that are not written yet
      integer(ip), private :: n = 0_ip
      !> Their numbers
      integer(lp), allocatable, private :: step(:)
      !> Their times, (stages, step) and (phases, step) [s]
      real(dp), allocatable, private :: stage(:, :), phase(:, :)
      !> Their counts, (counts, step)
      integer(lp), allocatable, private :: count(:, :)
      !> Their pairs and contacts
      integer(ip), allocatable, private :: pairs(:), contacts(:)
   contains
      procedure :: open => open_steps
      procedure :: add
      procedure :: close => close_steps
   end type step_file_t

contains

   !> Begin a file.
   subroutine open_steps(self, path, stage_names, phase_names, count_names, provenance, error)
      class(step_file_t), intent(inout) :: self
      !> Name of the file once it is complete
      character(len=*), intent(in) :: path
      !> Names of stages, phases and counts
      character(len=*), intent(in) :: stage_names(:), phase_names(:), count_names(:)
      !> Where the file comes from
      type(provenance_t), intent(in) :: provenance
      !> Allocated on failure
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
         call file%write_attribute('/', 'content', 'steps of a run by polydem', error)
         call file%write_attribute('/', 'schema_version', schema_version, error)
         call file%write('/steps/stage_name', stage_names, error, '1', 'stages of the time step')
         call file%write('/steps/phase_name', phase_names, error, '1', 'phases of the neighbour finder')
         call file%write('/steps/count_name', count_names, error, '1', 'what the neighbour finder counts')
      end associate
      if (.not. allocated(error)) call write_provenance(provenance, self%file, error)
      if (allocated(error)) call close_steps(self, error)
   end subroutine open_steps

   !> Add a step; after a failure the file is given up.
   subroutine add(self, row, error)
      class(step_file_t), intent(inout) :: self
      !> What is known of it
      type(step_row_t), intent(in) :: row
      !> Allocated on failure
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

   !> Write what is left and complete the file.
   subroutine close_steps(self, error)
      class(step_file_t), intent(inout) :: self
      !> Why the file cannot be completed
      type(error_t), allocatable, intent(inout) :: error

      if (.not. self%is_open) return
      self%is_open = .false.
      if (.not. allocated(error)) call write_block(self, error)
      call complete_file(self%file, self%path, error)
   end subroutine close_steps

   subroutine write_block(self, error)
      type(step_file_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error

      associate (file => self%file, n => self%n)
         call file%append_rows('/steps/step', self%step(:n), error, '1', 'number of the time step')
         call file%append_rows('/steps/stage', self%stage(:, :n), error, 's', 'time of each stage')
         call file%append_rows('/steps/phase', self%phase(:, :n), error, 's', 'time of each phase of the finder')
         call file%append_rows('/steps/count', self%count(:, :n), error, '1', &
                               'work of the finder in the step, or its state after it')
         call file%append_rows('/steps/pairs', self%pairs(:n), error, '1', 'pairs of bodies whose boxes overlap')
         call file%append_rows('/steps/contacts', self%contacts(:n), error, '1', 'contacts')
      end associate
      self%n = 0_ip
   end subroutine write_block

end module polydem_step_file
