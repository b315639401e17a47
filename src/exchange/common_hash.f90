!> Hash of the state of all bodies of a run, whoever moves them.
module polydem_common_hash
   use polydem_bodies, only: bodies_t, state_words
   use polydem_hash, only: mix_word
   use polydem_kinds, only: ip, lp
   use polydem_own_rows, only: lay_out_bodies
   use polydem_row_blocks, only: row_blocks_t
   use polydem_team, only: team_t
   implicit none
   private
   public :: hash_all_bodies

contains

   !> The `state_hash` of a process that had all bodies, for any number of processes; collective.
   subroutine hash_all_bodies(team, bodies, hash)
      !> Processes
      class(team_t), intent(inout) :: team
      !> Bodies of this process
      type(bodies_t), intent(in) :: bodies
      !> The hash, the same on all processes
      integer(lp), intent(out) :: hash
      type(row_blocks_t) :: blocks
      integer(lp), allocatable :: words(:, :), block(:, :)
      integer(lp) :: relay(1)
      integer(ip) :: k
      integer :: i

      allocate (words(7, bodies%n))
      do k = 1_ip, bodies%n
         words(:, k) = state_words(bodies, k)
      end do
      call lay_out_bodies(team, bodies, blocks)
      call blocks%bring(team, words, block)
      ! Every process goes on from the hash of those before it.
      relay = int(bodies%n_all, lp)
      call team%take_over(relay)
      do k = 1_ip, blocks%n
         do i = 1, size(block, 1)
            relay = mix_word(relay(1), block(i, k))
         end do
      end do
      call team%hand_on(relay)
      if (team%rank < team%size - 1_ip) relay = 0_lp
      call team%add_up(relay)
      hash = relay(1)
   end subroutine hash_all_bodies

end module polydem_common_hash
