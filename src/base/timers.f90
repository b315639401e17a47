!> Elapsed time per stage of the time step.
!>
!> Each stage has the same name as its timer, its namelist group and its entry in `/profile/stage` of results.
module polydem_timers
   use polydem_clock, only: wall_seconds
   use polydem_kinds, only: dp, ip, lp
   implicit none
   private
   public :: timers_t, block_clock_t, n_stages, stage_names
   public :: stage_boxes, stage_neighbours, stage_overlap, stage_forces, stage_integrate
   public :: stage_decomposition, stage_output

   !> Indices of the stages
   integer, parameter :: stage_boxes = 1
   integer, parameter :: stage_neighbours = 2
   integer, parameter :: stage_overlap = 3
   integer, parameter :: stage_forces = 4
   integer, parameter :: stage_integrate = 5
   integer, parameter :: stage_decomposition = 6
   integer, parameter :: stage_output = 7
   !> Number of timed stages
   integer, parameter :: n_stages = 7
   !> Names of the stages, in the order of the constants above
   character(len=*), parameter :: stage_names(n_stages) = &
      [character(len=13) :: 'boxes', 'neighbours', 'overlap', 'forces', 'integrate', 'decomposition', 'output']

   !> Stopwatches, one per stage; a stage that does not run is not timed
   type :: timers_t
      !> Number of steps in which each stage ran
      integer(lp) :: calls(n_stages) = 0_lp
      !> Seconds spent in each stage
      real(dp) :: total(n_stages) = 0.0_dp
      !> Shortest time of each stage in one step [s]
      real(dp) :: least(n_stages) = huge(1.0_dp)
      !> Longest time of each stage in one step [s]
      real(dp) :: most(n_stages) = 0.0_dp
      !> Time of each stage in the current step [s]; negative if it has not run
      real(dp), private :: current(n_stages) = -1.0_dp
      !> Start of the current lap [s]
      real(dp), private :: began = 0.0_dp
   contains
      procedure :: start
      procedure :: lap
      procedure :: divide_lap
      procedure :: end_step
      procedure :: add_to_total
   end type timers_t

   !> Clock of a pass over blocks that does two things with each block, while the block is in the cache: it divides the
   !> time of the pass between the two. Reading the time for every block would take too long; one of eight is timed.
   type :: block_clock_t
      private
      !> Number of blocks so far
      integer(ip) :: n_blocks = 0_ip
      !> Whether the present block is timed
      logical :: is_timed = .false.
      !> Start of the present part of the block [s]
      real(dp) :: began = 0.0_dp
      !> Time of each part in the timed blocks [s]
      real(dp) :: seconds(2) = 0.0_dp
   contains
      procedure :: begin_block
      procedure :: end_part
   end type block_clock_t

   !> One of so many blocks is timed
   integer(ip), parameter :: timed_blocks = 8_ip

contains

   !> Start the first lap.
   subroutine start(self)
      class(timers_t), intent(inout) :: self

      self%began = wall_seconds()
   end subroutine start

   !> Add the time since `start` or the last `lap` to a stage. A stage may have several laps in a step.
   subroutine lap(self, stage)
      class(timers_t), intent(inout) :: self
      !> stage_boxes, ..., stage_output
      integer, intent(in) :: stage

      self%current(stage) = max(self%current(stage), 0.0_dp) + next_lap(self)
   end subroutine lap

   !> Add the time since the last lap to two stages that alternate from block to block.
   subroutine divide_lap(self, stage, other, clock)
      class(timers_t), intent(inout) :: self
      !> Stages of the first and of the second part of each block
      integer, intent(in) :: stage, other
      !> Clock of the blocks
      type(block_clock_t), intent(in) :: clock
      real(dp) :: seconds, share

      seconds = next_lap(self)
      share = 0.5_dp
      if (sum(clock%seconds) > 0.0_dp) share = clock%seconds(1)/sum(clock%seconds)
      self%current(stage) = max(self%current(stage), 0.0_dp) + share*seconds
      self%current(other) = max(self%current(other), 0.0_dp) + (1.0_dp - share)*seconds
   end subroutine divide_lap

   !> Begin the first part of a block.
   subroutine begin_block(self)
      class(block_clock_t), intent(inout) :: self

      self%is_timed = mod(self%n_blocks, timed_blocks) == 0_ip
      self%n_blocks = self%n_blocks + 1_ip
      if (self%is_timed) self%began = wall_seconds()
   end subroutine begin_block

   !> End a part of a block.
   subroutine end_part(self, part)
      class(block_clock_t), intent(inout) :: self
      !> 1 or 2
      integer, intent(in) :: part
      real(dp) :: now

      if (.not. self%is_timed) return
      now = wall_seconds()
      self%seconds(part) = self%seconds(part) + (now - self%began)
      self%began = now
   end subroutine end_part

   !> End the step: add its times to the totals, and update the shortest and longest times per step.
   subroutine end_step(self)
      class(timers_t), intent(inout) :: self
      integer :: k

      do k = 1, n_stages
         if (self%current(k) < 0.0_dp) cycle
         self%calls(k) = self%calls(k) + 1_lp
         self%total(k) = self%total(k) + self%current(k)
         self%least(k) = min(self%least(k), self%current(k))
         self%most(k) = max(self%most(k), self%current(k))
         self%current(k) = -1.0_dp
      end do
   end subroutine end_step

   !> Add the time since `start` or the last `lap` to the total of a stage after the step has ended. The number of calls
   !> and the times per step do not change. This is for occasional work that itself needs the times of the step.
   subroutine add_to_total(self, stage)
      class(timers_t), intent(inout) :: self
      !> stage_boxes, ..., stage_output
      integer, intent(in) :: stage

      self%total(stage) = self%total(stage) + next_lap(self)
   end subroutine add_to_total

   !> Time since the last lap [s]. A new lap begins.
   real(dp) function next_lap(self)
      type(timers_t), intent(inout) :: self
      real(dp) :: now

      now = wall_seconds()
      next_lap = now - self%began
      self%began = now
   end function next_lap

end module polydem_timers
