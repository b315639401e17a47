!> A process on its own: whatever it tells comes back to itself.
module polydem_lone_team
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_team, only: route_t, team_t
   implicit none
   private
   public :: lone_team_t

   !> A team of one
   type, extends(team_t) :: lone_team_t
   contains
      procedure :: add_up => keep_longs
      procedure :: maximise_longs => keep_longs
      procedure :: maximise_doubles
      procedure :: share_longs => keep_longs
      procedure :: gather_longs
      procedure :: trade_longs
      procedure :: pass
      procedure :: take_over => keep_longs
      procedure :: hand_on => keep_longs
      procedure :: leave
   end type lone_team_t

contains

   !> Sums, greatest numbers and numbers of the leader are those of the only process.
   subroutine keep_longs(self, values)
      class(lone_team_t), intent(inout) :: self
      !> They stay as they are
      integer(lp), intent(inout), contiguous :: values(:)

      associate (nobody => self%size, same => values)
      end associate
   end subroutine keep_longs

   !> The greatest numbers are those of the only process.
   subroutine maximise_doubles(self, values)
      class(lone_team_t), intent(inout) :: self
      !> They stay as they are
      real(dp), intent(inout), contiguous :: values(:)

      associate (nobody => self%size, same => values)
      end associate
   end subroutine maximise_doubles

   !> All lists are the only one.
   subroutine gather_longs(self, mine, all_of_them, counts)
      class(lone_team_t), intent(inout) :: self
      !> The only list
      integer(lp), intent(in), contiguous :: mine(:)
      !> A copy
      integer(lp), allocatable, intent(out) :: all_of_them(:)
      !> Its length, (0:0)
      integer(ip), allocatable, intent(out) :: counts(:)

      all_of_them = mine
      allocate (counts(0:self%size - 1_ip))
      counts = size(mine, kind=ip)
   end subroutine gather_longs

   !> Rows stay where they are.
   subroutine trade_longs(self, rows, counts, received, counts_received)
      class(lone_team_t), intent(inout) :: self
      !> Rows
      integer(lp), intent(in), contiguous :: rows(:, :)
      !> Their number, (0:0)
      integer(ip), intent(in) :: counts(0:)
      !> A copy
      integer(lp), allocatable, intent(out) :: received(:, :)
      !> Their number, (0:0)
      integer(ip), allocatable, intent(out) :: counts_received(:)

      received = rows
      allocate (counts_received(0:self%size - 1_ip))
      counts_received = counts
   end subroutine trade_longs

   !> There is nobody to pass anything to.
   subroutine pass(self, route, sent, received)
      class(lone_team_t), intent(inout) :: self
      !> A route to nobody
      type(route_t), intent(in) :: route
      !> No rows
      real(wp), intent(in), contiguous, target :: sent(:, :)
      !> No rows
      real(wp), intent(inout), contiguous, target :: received(:, :)

      associate (nobody => self%size, nowhere => route, nothing => sent, same => received)
      end associate
   end subroutine pass

   !> There is nobody to leave.
   subroutine leave(self)
      class(lone_team_t), intent(inout) :: self

      associate (nobody => self%size)
      end associate
   end subroutine leave

end module polydem_lone_team
