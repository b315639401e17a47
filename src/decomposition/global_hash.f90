!> Hash of the state of all bodies of a run, independent of the number of ranks.
module polydem_global_hash
   use polydem_bodies, only: bodies_t, state_words
   use polydem_communicator, only: communicator_t
   use polydem_global_order, only: global_order_t
   use polydem_hash, only: mix_word
   use polydem_kinds, only: ip, lp
   use polydem_ownership, only: order_bodies
   implicit none
   private
   public :: hash_all_bodies

contains

   !> Compute the hash of all bodies: the value of `state_hash` on a rank that had all of them. Collective.
   subroutine hash_all_bodies(comm, bodies, hash)
      !> Ranks
      class(communicator_t), intent(inout) :: comm
      !> Bodies of this rank
      type(bodies_t), intent(in) :: bodies
      !> The hash, equal on all ranks
      integer(lp), intent(out) :: hash
      type(global_order_t) :: blocks
      integer(lp), allocatable :: words(:, :), block(:, :)
      integer(lp) :: relay(1)
      integer(ip) :: k
      integer :: i

      allocate (words(7, bodies%n))
      do k = 1_ip, bodies%n
         words(:, k) = state_words(bodies, k)
      end do
      call order_bodies(comm, bodies, blocks)
      call blocks%to_blocks(comm, words, block)
      ! Each rank continues the hash of the ranks below it.
      relay = int(bodies%n_all, lp)
      call comm%receive_from_previous(relay)
      do k = 1_ip, blocks%n
         do i = 1, size(block, 1)
            relay = mix_word(relay(1), block(i, k))
         end do
      end do
      call comm%send_to_next(relay)
      if (comm%rank < comm%size - 1_ip) relay = 0_lp
      call comm%all_reduce_sum(relay)
      hash = relay(1)
   end subroutine hash_all_bodies

end module polydem_global_hash
