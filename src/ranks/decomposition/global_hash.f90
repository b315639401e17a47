!> Hashes of all bodies of a run, independent of the number of ranks.
module polydem_global_hash
   use polydem_bodies, only: bodies_t, image_word, state_words
   use polydem_communicator, only: communicator_t
   use polydem_row_distribution, only: row_distribution_t
   use polydem_hash, only: mix_word
   use polydem_kinds, only: dp, ip, lp
   use polydem_ownership, only: order_bodies, order_vertices
   implicit none
   private
   public :: hash_all_bodies, hash_scene

contains

   !> Compute the hash of all bodies: the value of `state_hash` on a rank that had all of them. Collective.
   subroutine hash_all_bodies(comm, bodies, hash)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> The hash, equal on all ranks
      integer(lp), intent(out) :: hash

      call hash_states(comm, bodies, .false., hash)
   end subroutine hash_all_bodies

   !> Compute the hash of the states of all bodies, with or without the velocities of fixed ones.
   subroutine hash_states(comm, bodies, walls_rest, hash)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Whether fixed bodies are taken to be at rest
      logical, intent(in) :: walls_rest
      integer(lp), intent(out) :: hash
      type(row_distribution_t) :: blocks
      integer(lp), allocatable :: words(:, :), block(:, :)
      integer(ip) :: k

      allocate (words(7, bodies%n))
      do k = 1_ip, bodies%n
         words(:, k) = state_words(bodies, k)
         if (walls_rest .and. bodies%fixed(k)) words(5:7, k) = 0_lp
      end do
      call order_bodies(comm, bodies, blocks)
      call blocks%to_blocks(comm, words, block)
      hash = int(bodies%n_all, lp)
      call mix_blocks(comm, block, hash)
      if (.not. allocated(bodies%image)) return
      call blocks%to_blocks(comm, reshape([(image_word(bodies, k), k=1_ip, bodies%n)], [1_ip, bodies%n]), block)
      call mix_blocks(comm, block, hash)
   end subroutine hash_states

   !> Compute the hash of the initial bodies: their state, and their constant properties (fixed or free, mass, inertia,
   !> shape, material), and their periodic cell. Velocities of walls do not count: motions of a run may change while it
   !> goes on. Collective.
   subroutine hash_scene(comm, bodies, hash)
      class(communicator_t), intent(inout) :: comm
      !> Bodies of this rank at time 0
      type(bodies_t), intent(in) :: bodies
      !> The hash, equal on all ranks
      integer(lp), intent(out) :: hash
      type(row_distribution_t) :: blocks
      integer(lp), allocatable :: words(:, :), block(:, :), counts_of_ranks(:)
      integer(ip), allocatable :: counts(:)
      integer(ip) :: k

      call hash_states(comm, bodies, .true., hash)
      allocate (words(4, bodies%n))
      words(1, :) = merge(1_lp, 0_lp, bodies%fixed)
      do k = 1_ip, bodies%n
         words(2:3, k) = transfer(real([bodies%mass(k), bodies%inertia(k)], dp), 0_lp, 2)
      end do
      words(4, :) = int(bodies%pieces%vertex_start(2:) - bodies%pieces%vertex_start(:bodies%n), lp)
      call order_bodies(comm, bodies, blocks)
      call blocks%to_blocks(comm, words, block)
      ! The start of the vertices of the next body takes the place of the number of vertices.
      call comm%gather([sum(block(4, :))], counts_of_ranks, counts)
      do k = 1_ip, blocks%n
         if (k == 1_ip) block(4, 1) = block(4, 1) + 1_lp + sum(counts_of_ranks(:comm%rank))
         if (k > 1_ip) block(4, k) = block(4, k) + block(4, k - 1_ip)
      end do
      call mix_blocks(comm, block, hash)
      deallocate (words)
      allocate (words(2, size(bodies%pieces%vertex, 2)))
      do k = 1_ip, size(words, 2, kind=ip)
         words(:, k) = transfer(real(bodies%pieces%vertex(:, k), dp), 0_lp, 2)
      end do
      call order_vertices(comm, bodies, blocks)
      call blocks%to_blocks(comm, words, block)
      call mix_blocks(comm, block, hash)
      if (bodies%pieces%most > 1_ip) then
         call blocks%to_blocks(comm, reshape(int(bodies%pieces%number, lp), [1, size(bodies%pieces%number)]), block)
         call mix_blocks(comm, block, hash)
      end if
      if (allocated(bodies%material)) then
         call order_bodies(comm, bodies, blocks)
         call blocks%to_blocks(comm, reshape(int(bodies%material, lp), [1, size(bodies%material)]), block)
         call mix_blocks(comm, block, hash)
      end if
      if (.not. bodies%cell%is_periodic) return
      do k = 1_ip, 2_ip
         hash = mix_word(hash, transfer(real(bodies%cell%low(k), dp), 0_lp))
         hash = mix_word(hash, transfer(real(bodies%cell%size(k), dp), 0_lp))
      end do
   end subroutine hash_scene

   !> Continue a hash with the rows of all blocks. Each rank continues the hash of the ranks below it. Collective.
   subroutine mix_blocks(comm, block, hash)
      class(communicator_t), intent(inout) :: comm
      !> The block of this rank, (word, row)
      integer(lp), intent(in) :: block(:, :)
      !> The hash, equal on all ranks
      integer(lp), intent(inout) :: hash
      integer(lp) :: relay(1)
      integer :: i, k

      relay = hash
      call comm%receive_from_previous(relay)
      do k = 1, size(block, 2)
         do i = 1, size(block, 1)
            relay = mix_word(relay(1), block(i, k))
         end do
      end do
      call comm%send_to_next(relay)
      if (comm%rank < comm%size - 1_ip) relay = 0_lp
      call comm%all_reduce_sum(relay)
      hash = relay(1)
   end subroutine mix_blocks

end module polydem_global_hash
