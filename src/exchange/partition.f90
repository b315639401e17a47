!> How space is divided among the processes of a team.
!>
!> All processes know the whole division and have it with the same bits: where a body goes depends on all positions
!> and weights, but not on which process moved which body before, since processes tell each other nothing but sums of
!> whole numbers and extremes.
module polydem_partition
   use polydem_kinds, only: dp, ip, wp
   use polydem_team, only: team_t
   implicit none
   private
   public :: partition_t

   !> A division of space; before the first call of `divide` all of it belongs to rank 0
   type, abstract :: partition_t
   contains
      procedure(divide), deferred :: divide
      procedure(owner_of), deferred :: owner_of
   end type partition_t

   abstract interface
      !> Divide space anew, so that every process gets about the same weight. All processes of the team must call this.
      subroutine divide(self, team, position, weight)
         import :: dp, partition_t, team_t, wp
         class(partition_t), intent(inout) :: self
         !> Processes
         class(team_t), intent(inout) :: team
         !> Positions of the bodies of this process, which may have none, (2, body) [m]
         real(wp), intent(in) :: position(:, :)
         !> Work for each of them, >= 0, in any unit; if all weights are 0 bodies are counted, (body)
         real(dp), intent(in) :: weight(:)
      end subroutine divide

      !> Rank of the process that owns a place: one of 0 to size - 1 for any place, also outside of all bodies
      pure integer(ip) function owner_of(self, position)
         import :: ip, partition_t, wp
         class(partition_t), intent(in) :: self
         !> Where, (2) [m]
         real(wp), intent(in) :: position(2)
      end function owner_of
   end interface

end module polydem_partition
