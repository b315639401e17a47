!> Domain: the part of space of one rank, and the criterion for the next redistribution of bodies.
!>
!> A partition of space assigns each body to a rank. The halo of a rank contains the bodies of other ranks whose padded
!> boxes overlap the padded boxes of its own bodies; the padding is a margin. The halo is sufficient as long as each box
!> is within its padded box recorded at the last redistribution, or within the zone of its rank. The zone is an area
!> that no body of another rank can enter. If a box is in neither, the next redistribution takes place in the middle of
!> the step, after the prediction and before the search for pairs: no pair can be missed.
!>
!> In a periodic cell one rank alone redistributes, too: then the images of boxes are chosen again
!> (`polydem_box_images`), for which the same margin gives room. A pair across the border is two boxes that meet through
!> a copy of one of them. Either box is within its padded box, or in the zone, which meets no copy of any padded box.
!>
!> A redistribution also takes place after a thousand steps without one, since the work of the ranks is compared then.
module polydem_domain
   use polydem_bodies, only: bodies_t
   use polydem_cell, only: cell_t
   use polydem_communicator, only: communicator_t
   use polydem_halo, only: halo_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_partition, only: partition_t
   use polydem_rank_bounds, only: rank_bounds_t
   use polydem_settings, only: decomposition_settings_t
   implicit none
   private
   public :: domain_t, new_domain

   !> Domain of one rank
   type :: domain_t
      !> Group &decomposition
      type(decomposition_settings_t) :: settings
      !> Partition of space; not allocated without a zone
      type(partition_t), allocatable :: partition
      !> Bounding rectangles of the bodies of the other ranks
      type(rank_bounds_t) :: rank_bounds
      !> Halo: copies of bodies of other ranks
      type(halo_t) :: halo
      !> Distance that a box may move before the next redistribution [m]
      real(wp) :: margin = 0.0_wp
      !> Greatest margin that a periodic cell allows [m]
      real(wp) :: most = huge(1.0_wp)
      !> Width and height of the periodic cell, 0 along an axis that is not periodic [m]
      real(wp) :: period(2) = 0.0_wp
      !> Part of the margin that is left to the growth of a stress-controlled cell; the other one is left to the boxes
      real(wp) :: growth = 0.0_wp
      !> Median diameter of the free bodies of the run [m]
      real(wp) :: median_diameter = 0.0_wp
      !> Number of halo bodies and images of all ranks per body of the run
      real(wp) :: halo_share = 0.0_wp
      !> Padded boxes recorded at the last redistribution, (4, box) [m]
      real(wp), allocatable :: reference(:, :)
      !> Step of the last redistribution; -1 before the first
      integer(lp) :: last_step = -1_lp
      !> Step of the last partition of space; -1 before the first
      integer(lp) :: partition_step = -1_lp
      !> Computing time of this rank up to the last partition of space [s]
      real(dp) :: partition_seconds = 0.0_dp
      !> Number of redistributions; of partitions of space; of bodies that migrated to this rank; of halo bodies, summed
      !> over steps
      integer(lp) :: redistributions = 0_lp, divisions = 0_lp, arrivals = 0_lp, halo_steps = 0_lp
      !> Part of the first redistribution: number of bodies that migrated to this rank, of messages of this rank, and of
      !> their bytes
      integer(lp) :: first_migrations = 0_lp, first_messages = 0_lp, first_bytes = 0_lp
      !> Number of messages of this rank in the halo exchanges of all steps, and of their bytes
      integer(lp) :: step_messages = 0_lp, step_bytes = 0_lp
   contains
      procedure :: has_zone
      procedure :: has_halo
      procedure :: must_redistribute
      procedure :: choose_margin
      procedure :: set_reference
      procedure :: forget_halo
      procedure :: follow_cell
      procedure :: is_off
      procedure :: shrink_zone
      procedure :: adapt_margin
      procedure :: send_border
      procedure :: count_halo
   end type domain_t

   !> Bounds of the margin at the start, and of later margins, in median diameters
   real(wp), parameter :: first_margin = 0.15_wp, greatest_first = 2.0_wp
   real(wp), parameter :: least_margin = 0.02_wp, greatest_margin = 8.0_wp
   !> Steps until the fastest body leaves the margin at the start
   real(wp), parameter :: first_interval = 100.0_wp
   !> Cost of a redistribution with its new pair list in steps, and of a halo body in bodies (measured: 5 to
   !> 8, and about a half)
   real(wp), parameter :: redistribution_cost = 6.0_wp, halo_body_cost = 0.5_wp
   !> Greatest number of steps between redistributions, unless the work is not balanced
   integer(lp), parameter :: longest_interval = 1000_lp
   !> Greatest factor by which the margin changes in a redistribution
   real(wp), parameter :: greatest_change = 3.0_wp
   !> Greatest margin over the side of a periodic cell. Bodies reach at most a quarter of the side, so all padded boxes
   !> together are shorter than two sides, and only the next copies of a box can meet them
   real(wp), parameter :: share_of_cell = 0.125_wp
   !> Part of the margin that is left to the growth of a cell
   real(wp), parameter :: share_of_growth = 0.25_wp

contains

   !> Start a domain. In a run on several ranks, or in a periodic cell, the first redistribution is in the first step.
   subroutine new_domain(domain, settings, median_diameter, comm, cell)
      type(domain_t), intent(out) :: domain
      type(decomposition_settings_t), intent(in) :: settings
      !> Median diameter of the free bodies of the run [m]
      real(wp), intent(in) :: median_diameter
      class(communicator_t), intent(in) :: comm
      !> Periodic cell; absent: the plane
      type(cell_t), intent(in), optional :: cell

      domain%settings = settings
      domain%median_diameter = median_diameter
      domain%margin = settings%margin
      if (settings%margin <= 0.0_wp) domain%margin = first_margin*median_diameter
      if (present(cell)) then
         if (allocated(cell%load)) domain%growth = share_of_growth
         call domain%follow_cell(cell)
      end if
      if (comm%size > 1_ip .or. any(domain%period > 0.0_wp)) allocate (domain%partition)
   end subroutine new_domain

   !> Whether bodies that leave the zone of this rank are redistributed: there are other ranks, or the cell is periodic.
   pure logical function has_zone(self)
      class(domain_t), intent(in) :: self

      has_zone = allocated(self%partition)
   end function has_zone

   !> Whether this rank has a halo: from the first redistribution on, even if no body is in it.
   pure logical function has_halo(self)
      class(domain_t), intent(in) :: self

      has_halo = allocated(self%halo%border)
   end function has_halo

   !> Whether a redistribution is necessary: a box of a body of this rank is outside both the zone and its padded box
   !> recorded at the last one, the last one was long ago, or there was none yet with these bodies.
   pure logical function must_redistribute(self, step, has_left)
      class(domain_t), intent(in) :: self
      !> The present step
      integer(lp), intent(in) :: step
      !> Whether a box is outside both its padded box and the zone
      logical, intent(in) :: has_left

      must_redistribute = self%has_zone()
      if (.not. allocated(self%reference)) return
      must_redistribute = has_left .or. &
         (self%settings%balance /= 'off' .and. step - self%last_step >= longest_interval)
   end function must_redistribute

   !> Choose the margin of the first redistribution, unless the settings give one.
   subroutine choose_margin(self, move)
      class(domain_t), intent(inout) :: self
      !> Greatest displacement of a body of any rank in the next step [m]
      real(wp), intent(in) :: move

      if (self%settings%margin > 0.0_wp) return
      self%margin = min(max(first_interval*move, first_margin*self%median_diameter), &
                        greatest_first*self%median_diameter, self%most)
   end subroutine choose_margin

   !> Record the padded boxes of a redistribution.
   subroutine set_reference(self, bounds, step)
      class(domain_t), intent(inout) :: self
      !> xmin, ymin, xmax, ymax of the boxes, (4, box) [m]
      real(wp), intent(in) :: bounds(:, :)
      !> The step
      integer(lp), intent(in) :: step

      if (allocated(self%reference)) deallocate (self%reference)
      allocate (self%reference(4, size(bounds, 2)))
      self%reference(1:2, :) = bounds(1:2, :) - (1.0_wp - self%growth)*self%margin
      self%reference(3:4, :) = bounds(3:4, :) + (1.0_wp - self%growth)*self%margin
      self%last_step = step
   end subroutine set_reference

   !> Take the size of the cell, with which the next redistribution finds the copies of boxes.
   pure subroutine follow_cell(self, cell)
      class(domain_t), intent(inout) :: self
      type(cell_t), intent(in) :: cell

      self%period = cell%size
      if (.not. cell%is_periodic) return
      self%most = share_of_cell*minval(cell%size, cell%size > 0.0_wp)
      self%margin = min(self%margin, self%most)
   end subroutine follow_cell

   !> Whether the size of the cell differs from that of the last redistribution by more than the margin allows
   pure logical function is_off(self, cell)
      class(domain_t), intent(in) :: self
      type(cell_t), intent(in) :: cell

      is_off = .false.
      if (self%growth > 0.0_wp) is_off = any(abs(cell%size - self%period) > self%growth*self%margin)
   end function is_off

   !> Shrink the zone of this rank by what the copies of bodies may move with a stress-controlled cell.
   pure subroutine shrink_zone(self)
      class(domain_t), intent(inout) :: self

      if (self%growth > 0.0_wp) self%rank_bounds%zone = self%rank_bounds%zone &
         + self%growth*self%margin*[1.0_wp, 1.0_wp, -1.0_wp, -1.0_wp]
   end subroutine shrink_zone

   !> Forget the halo and the padded boxes, since the bodies are others: the next step redistributes them.
   subroutine forget_halo(self)
      class(domain_t), intent(inout) :: self

      self%halo = halo_t()
      if (allocated(self%reference)) deallocate (self%reference)
   end subroutine forget_halo

   !> Choose the margin, unless the settings give one, or the bodies are others. With a wide margin redistributions are
   !> rare, but the halo is large. The interval between redistributions is proportional to the margin. The halo is about
   !> a median diameter and two margins wide. The sum of both costs is least where redistributions cost as much as that
   !> part of the halo which is due to the margin.
   subroutine adapt_margin(self, step)
      class(domain_t), intent(inout) :: self
      !> Step of the redistribution that begins. It and `halo_share` are equal on all ranks, and so is the margin
      integer(lp), intent(in) :: step
      real(wp) :: cost_of_redistributions, cost_of_margin, factor

      if (self%settings%margin > 0.0_wp .or. self%last_step < 0_lp .or. .not. allocated(self%reference)) return
      cost_of_redistributions = redistribution_cost/real(max(1_lp, step - self%last_step), wp)
      cost_of_margin = halo_body_cost*self%halo_share*2.0_wp*self%margin/(self%median_diameter + 2.0_wp*self%margin)
      factor = greatest_change
      if (cost_of_margin*greatest_change**2 > cost_of_redistributions) &
         factor = max(1.0_wp/greatest_change, sqrt(cost_of_redistributions/cost_of_margin))
      self%margin = max(least_margin*self%median_diameter, min(factor*self%margin, &
         greatest_margin*self%median_diameter, self%most))
   end subroutine adapt_margin

   !> Begin the halo exchange of a step: send the bodies of the border.
   subroutine send_border(self, comm, bodies)
      class(domain_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies

      self%step_messages = self%step_messages - comm%messages
      self%step_bytes = self%step_bytes - comm%bytes
      call self%halo%send_border(comm, bodies)
      self%step_messages = self%step_messages + comm%messages
      self%step_bytes = self%step_bytes + comm%bytes
   end subroutine send_border

   !> Count the halo bodies of a step.
   pure subroutine count_halo(self)
      class(domain_t), intent(inout) :: self

      if (self%has_halo()) self%halo_steps = self%halo_steps + int(size(self%halo%slots), lp)
   end subroutine count_halo

end module polydem_domain
