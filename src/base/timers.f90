!> Seconds per stage of the time step.
!>
!> The same words name the folders of src, the namelist groups, the timers and `/profile/stage` in results.
module polydem_timers
   use polydem_clock, only: wall_seconds
   use polydem_kinds, only: dp, lp
   implicit none
   private
   public :: timers_t, n_stages, stage_names
   public :: stage_boxes, stage_neighbours, stage_overlap, stage_forces, stage_integrate, stage_exchange, stage_output

   integer, parameter :: stage_boxes = 1
   integer, parameter :: stage_neighbours = 2
   integer, parameter :: stage_overlap = 3
   integer, parameter :: stage_forces = 4
   integer, parameter :: stage_integrate = 5
   integer, parameter :: stage_exchange = 6
   integer, parameter :: stage_output = 7
   !> Number of timed stages
   integer, parameter :: n_stages = 7
   !> Names of the stages, in the order of the constants above
   character(len=*), parameter :: stage_names(n_stages) = &
      [character(len=10) :: 'boxes', 'neighbours', 'overlap', 'forces', 'integrate', 'exchange', 'output']

   !> Stop watches, one per stage; a stage that does not run costs nothing
   type :: timers_t
      !> Number of steps in which each stage ran
      integer(lp) :: calls(n_stages) = 0_lp
      !> Seconds spent in each stage
      real(dp) :: total(n_stages) = 0.0_dp
      !> Least time of each stage in one step [s]
      real(dp) :: least(n_stages) = huge(1.0_dp)
      !> Greatest time of each stage in one step [s]
      real(dp) :: most(n_stages) = 0.0_dp
      !> Time of each stage in the step under way [s]; negative: it did not run
      real(dp), private :: current(n_stages) = -1.0_dp
      !> When the running stage began [s]
      real(dp), private :: began = 0.0_dp
   contains
      procedure :: start
      procedure :: lap
      procedure :: end_step
      procedure :: add_rest
   end type timers_t

contains

   !> Begin to time.
   subroutine start(self)
      class(timers_t), intent(inout) :: self

      self%began = wall_seconds()
   end subroutine start

   !> Book the time since `start` or the last `lap` under a stage; a stage may have several laps in a step.
   subroutine lap(self, stage)
      class(timers_t), intent(inout) :: self
      !> stage_boxes, ..., stage_output
      integer, intent(in) :: stage
      real(dp) :: now

      now = wall_seconds()
      self%current(stage) = max(self%current(stage), 0.0_dp) + (now - self%began)
      self%began = now
   end subroutine lap

   !> Close the step: sums, least and greatest times are taken over steps.
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

   !> Book the time since `start` or the last `lap` under a stage of a step that is closed. It counts in the total
   !> alone: it is for what is done now and then, and must itself have the times of the step.
   subroutine add_rest(self, stage)
      class(timers_t), intent(inout) :: self
      !> stage_boxes, ..., stage_output
      integer, intent(in) :: stage
      real(dp) :: now

      now = wall_seconds()
      self%total(stage) = self%total(stage) + (now - self%began)
      self%began = now
   end subroutine add_rest

end module polydem_timers
