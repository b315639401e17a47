!> Forces on fixed bodies in a run on several ranks, each with a part of the contacts.
module polydem_wall_forces
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_force_sums, only: n_terms, set_force
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_keys, only: first_of, pair_key
   use polydem_sort, only: ascending_order
   use polydem_wall_terms, only: wall_terms_t
   implicit none
   private
   public :: complete_wall_forces

contains

   !> Complete the forces and torques on fixed bodies on the root rank, which writes them. Collective.
   !>
   !> All terms are sent to the root rank and summed in descending order of the pairs of pieces. This is the order of
   !> `force_sums`: the sums have the same bits as in a run on one rank. In such a run they are complete already.
   subroutine complete_wall_forces(comm, first, walls, bodies)
      class(communicator_t), intent(inout) :: comm
      !> Lower piece of each pair of the pair list
      integer(ip), intent(in) :: first(:)
      !> Contacts of the bodies of this rank with fixed bodies
      type(wall_terms_t), intent(in) :: walls
      !> Bodies of this rank; on the root rank `force` and `torque` of fixed bodies change
      type(bodies_t), intent(inout) :: bodies
      integer(lp), allocatable :: key(:, :), all_keys(:, :)
      real(wp), allocatable :: terms(:, :), all_terms(:, :)
      integer(ip), allocatable :: counts(:), from(:)

      if (comm%size == 1_ip) return
      call list_terms(bodies, first, walls, key, terms)
      allocate (counts(0:comm%size - 1_ip))
      counts = 0_ip
      counts(0) = size(key, 2, kind=ip)
      call comm%all_to_all(key, counts, all_keys, from)
      call comm%all_to_all(terms, counts, all_terms, from)
      if (comm%is_root()) call sum_terms(all_keys, all_terms, bodies)
   end subroutine complete_wall_forces

   !> List the terms of the forces on fixed bodies. Their partners are free bodies of this rank.
   subroutine list_terms(bodies, first, walls, key, terms)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: first(:)
      type(wall_terms_t), intent(in) :: walls
      !> Global index of the fixed body, and from 1 the number of its piece if this is the lower one of the pair, else
      !> 0, in one word; global index of the partner, (2, term)
      integer(lp), allocatable, intent(out) :: key(:, :)
      !> Terms of the fixed bodies, (n_terms, term)
      real(wp), allocatable, intent(out) :: terms(:, :)
      integer(ip) :: c, number

      allocate (key(2, walls%n), terms(n_terms, walls%n))
      do c = 1_ip, walls%n
         associate (s => walls%slots(1, c), partner => walls%slots(2, c))
            number = 0_ip
            if (s < partner) number = first(walls%pair(c)) - bodies%pieces%first_of(s) + 1_ip
            key(:, c) = [pair_key(bodies%global_index(s), number), int(bodies%global_index(partner), lp)]
         end associate
         terms(:, c) = walls%term(:, c)
      end do
   end subroutine list_terms

   !> Sum the terms of each fixed body in descending order of keys. Terms with the same keys, of the pieces of one free
   !> body, come from one rank in the order of its sums, which they keep.
   subroutine sum_terms(keys, terms, bodies)
      integer(lp), intent(in) :: keys(:, :)
      real(wp), intent(in) :: terms(:, :)
      type(bodies_t), intent(inout) :: bodies
      integer(ip), allocatable :: order(:)
      real(wp) :: total(n_terms)
      integer(ip) :: k, s

      order = ascending_order(-keys(2, :))
      order = order(ascending_order(-keys(1, order)))
      k = 1_ip
      do s = bodies%n, 1_ip, -1_ip
         if (.not. bodies%fixed(s)) cycle
         total = 0.0_wp
         do while (k <= size(order))
            if (first_of(keys(1, order(k))) /= bodies%global_index(s)) exit
            total = total + terms(:, order(k))
            k = k + 1_ip
         end do
         call set_force(total, s, bodies)
      end do
   end subroutine sum_terms

end module polydem_wall_forces
