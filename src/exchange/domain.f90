!> The part of space that a process looks after, and when it has to be found anew.
!>
!> Bodies are handed out by a division of space. Every process also has the bodies whose boxes, grown by a margin,
!> meet its own ones; so all is well until a box of its own bodies leaves its grown box of then. All this is settled
!> anew in the middle of a step, between predicting and finding pairs, so that nothing can happen unseen.
module polydem_domain
   use polydem_errors, only: error_t
   use polydem_ghosts, only: ghosts_t
   use polydem_kinds, only: dp, ip, lp, wp, worth_threads
   use polydem_partition, only: partition_t
   use polydem_partition_factory, only: new_partition
   use polydem_regions, only: regions_t
   use polydem_settings, only: exchange_settings_t
   use polydem_team, only: team_t
   implicit none
   private
   public :: domain_t, new_domain

   !> What a process knows of its own place among others
   type :: domain_t
      !> Group &exchange
      type(exchange_settings_t) :: settings
      !> Division of space; unallocated for a process on its own
      class(partition_t), allocatable :: partition
      !> Where the bodies of others are
      type(regions_t) :: regions
      !> Bodies of others that are here
      type(ghosts_t) :: ghosts
      !> How far boxes may go before all is settled anew [m]
      real(wp) :: margin = 0.0_wp
      !> Median diameter of the free bodies of the run [m]
      real(wp) :: grain = 0.0_wp
      !> Ghosts of all processes per body of the run
      real(wp) :: ghost_share = 0.0_wp
      !> Boxes grown by the margin when all was settled, (4, box) [m]
      real(wp), allocatable :: reference(:, :)
      !> Step in which that was
      integer(lp) :: last_step = -1_lp
      !> Step in which space was divided last
      integer(lp) :: division_step = -1_lp
      !> Time of work up to then [s]
      real(dp) :: division_seconds = 0.0_dp
      !> How often all was settled, space divided; bodies that came from other processes; ghosts, summed over steps
      integer(lp) :: settlements = 0_lp, divisions = 0_lp, arrivals = 0_lp, ghost_steps = 0_lp
      !> What of that came when all was settled for the first time: bodies, messages of this process, their bytes
      integer(lp) :: first_arrivals = 0_lp, first_messages = 0_lp, first_bytes = 0_lp
      !> Messages of this process, and their bytes, that let ghosts follow in every step
      integer(lp) :: step_messages = 0_lp, step_bytes = 0_lp
   contains
      procedure :: must_settle
      procedure :: set_reference
      procedure :: adapt_margin
   end type domain_t

   !> First margin in grains, and bounds of later ones
   real(wp), parameter :: first_margin = 0.15_wp, least_margin = 0.02_wp, greatest_margin = 2.0_wp
   !> What a settlement costs, in steps, and a ghost, in bodies (measured; see postproc/verdicts/scale)
   real(wp), parameter :: settlement_cost = 4.0_wp, ghost_cost = 0.5_wp
   !> Greatest change of the margin in a settlement
   real(wp), parameter :: greatest_change = 3.0_wp

contains

   !> Begin with a process that looks after everything it has; one of several settles in the first step.
   subroutine new_domain(domain, settings, grain, team, error)
      !> The domain
      type(domain_t), intent(out) :: domain
      !> Group &exchange
      type(exchange_settings_t), intent(in) :: settings
      !> Median diameter of the free bodies of the run [m]
      real(wp), intent(in) :: grain
      !> Processes
      class(team_t), intent(in) :: team
      !> Allocated if there is no such division
      type(error_t), allocatable, intent(inout) :: error

      domain%settings = settings
      domain%grain = grain
      domain%margin = settings%margin
      if (settings%margin <= 0.0_wp) domain%margin = first_margin*grain
      if (team%size > 1_ip) call new_partition(domain%partition, settings%cut, error)
   end subroutine new_domain

   !> Whether a box of a body of this process has left its reference; true also before the first settlement.
   logical function must_settle(self, bounds, passive)
      class(domain_t), intent(in) :: self
      !> xmin, ymin, xmax, ymax of the boxes in the middle of a step, (4, box) [m]
      real(wp), intent(in) :: bounds(:, :)
      !> Whether the body of a box is fixed or a ghost, (box)
      logical, intent(in) :: passive(:)
      integer(ip) :: b
      logical :: inside

      must_settle = allocated(self%partition) .and. .not. allocated(self%reference)
      if (.not. allocated(self%reference)) return
      inside = .true.
      !$omp parallel do if (size(passive) > worth_threads) schedule(static) default(none) &
      !$omp    shared(self, bounds, passive) private(b) reduction(.and.:inside)
      do b = 1_ip, size(passive, kind=ip)
         if (passive(b)) cycle
         inside = inside .and. all(bounds(1:2, b) >= self%reference(1:2, b)) &
            .and. all(bounds(3:4, b) <= self%reference(3:4, b))
      end do
      !$omp end parallel do
      must_settle = .not. inside
   end function must_settle

   !> Remember where boxes were when all was settled.
   subroutine set_reference(self, bounds, step)
      class(domain_t), intent(inout) :: self
      !> xmin, ymin, xmax, ymax of the boxes, (4, box) [m]
      real(wp), intent(in) :: bounds(:, :)
      !> The step
      integer(lp), intent(in) :: step

      if (allocated(self%reference)) deallocate (self%reference)
      allocate (self%reference(4, size(bounds, 2)))
      self%reference(1:2, :) = bounds(1:2, :) - self%margin
      self%reference(3:4, :) = bounds(3:4, :) + self%margin
      self%last_step = step
   end subroutine set_reference

   !> Choose the margin, unless one is given, so that settlements cost as much as ghosts do: a wide one makes
   !> settlements rare, but ghosts many. Their interval grows with the margin, and so does the number of ghosts.
   subroutine adapt_margin(self, step)
      class(domain_t), intent(inout) :: self
      !> Step of the settlement that begins; all processes know it and `ghost_share`, so that all have the same margin
      integer(lp), intent(in) :: step
      real(wp) :: settling, following, factor

      if (self%settings%margin > 0.0_wp .or. self%last_step < 0_lp) return
      settling = settlement_cost/real(max(1_lp, step - self%last_step), wp)
      following = ghost_cost*self%ghost_share
      factor = greatest_change
      if (following*greatest_change**2 > settling) factor = max(1.0_wp/greatest_change, sqrt(settling/following))
      self%margin = max(least_margin*self%grain, min(factor*self%margin, greatest_margin*self%grain))
   end subroutine adapt_margin

end module polydem_domain
