!> Forces on fixed bodies in a run on several ranks, each with a part of the contacts.
module polydem_wall_forces
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_contacts, only: contacts_t
   use polydem_global_order, only: row_key
   use polydem_kinds, only: ip, lp, wp
   use polydem_sort, only: sort_keys
   implicit none
   private
   public :: complete_wall_forces

contains

   !> Complete the forces and torques on fixed bodies on the root rank, which writes them. Collective.
   !>
   !> All terms are sent to the root rank and summed in ascending order of the partner. This is the order of
   !> `assemble_forces`: the sums have the same bits as in a run on one rank. In such a run they are complete already.
   subroutine complete_wall_forces(comm, bodies, contacts)
      !> Ranks
      class(communicator_t), intent(inout) :: comm
      !> Bodies of this rank; on the root rank `force` and `torque` of fixed bodies change
      type(bodies_t), intent(inout) :: bodies
      !> Contacts of this rank with their forces
      type(contacts_t), intent(in) :: contacts
      integer(lp), allocatable :: key(:, :), all_keys(:, :)
      real(wp), allocatable :: terms(:, :), all_terms(:, :)
      integer(ip), allocatable :: counts(:), from(:)

      if (comm%size == 1_ip) return
      call list_terms(bodies, contacts, key, terms)
      allocate (counts(0:comm%size - 1_ip))
      counts = 0_ip
      counts(0) = size(key, 2, kind=ip)
      call comm%all_to_all(key, counts, all_keys, from)
      call comm%all_to_all(terms, counts, all_terms, from)
      if (comm%is_root()) call sum_terms(all_keys(1, :), all_terms, bodies)
   end subroutine complete_wall_forces

   !> List the terms of the forces on fixed bodies. Their partners are free bodies of this rank.
   subroutine list_terms(bodies, contacts, key, terms)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> Global indices of the fixed body and of its partner in one word, (1, term)
      integer(lp), allocatable, intent(out) :: key(:, :)
      !> Force along x and y [N/m], torque of the forces [N], additional torque [N], (4, term)
      real(wp), allocatable, intent(out) :: terms(:, :)
      integer(ip) :: c, k, n

      n = 0_ip
      do c = 1_ip, contacts%n
         if (bodies%fixed(contacts%first(c)) .or. bodies%fixed(contacts%second(c))) n = n + 1_ip
      end do
      allocate (key(1, n), terms(4, n))
      k = 0_ip
      do c = 1_ip, contacts%n
         associate (i => contacts%first(c), j => contacts%second(c))
            if (bodies%fixed(i)) then
               k = k + 1_ip
               key(1, k) = row_key(bodies%global_index(i), bodies%global_index(j))
               terms(:, k) = terms_of(contacts, c, contacts%arm_first(:, c))
            else if (bodies%fixed(j)) then
               k = k + 1_ip
               key(1, k) = row_key(bodies%global_index(j), bodies%global_index(i))
               terms(:, k) = -terms_of(contacts, c, contacts%arm_second(:, c))
            end if
         end associate
      end do
   end subroutine list_terms

   !> Force of a contact on its first body, and its torques about a point, by the expressions of `assemble_forces`
   pure function terms_of(contacts, c, arm) result(terms)
      type(contacts_t), intent(in) :: contacts
      integer(ip), intent(in) :: c
      !> Centroid of the overlap relative to the point [m]
      real(wp), intent(in) :: arm(2)
      real(wp) :: terms(4)

      terms(1:2) = contacts%force(:, c)
      terms(3) = arm(1)*contacts%force(2, c) - arm(2)*contacts%force(1, c) + contacts%lever(c)*contacts%normal_force(c)
      terms(4) = 0.0_wp
      if (contacts%has_twist) terms(4) = contacts%twist(c)
   end function terms_of

   !> Sum the terms of each fixed body in ascending order of keys.
   subroutine sum_terms(keys, terms, bodies)
      integer(lp), intent(in) :: keys(:)
      real(wp), intent(in) :: terms(:, :)
      type(bodies_t), intent(inout) :: bodies
      integer(lp), allocatable :: sorted(:), spare_keys(:)
      integer(ip), allocatable :: place(:), spare(:)
      real(wp) :: force(2), torque
      integer(ip) :: k, n, s

      n = size(keys, kind=ip)
      allocate (sorted(n), spare_keys(n), place(n), spare(n))
      sorted = keys
      place = [(k, k=1_ip, n)]
      call sort_keys(n, sorted, place, spare_keys, spare)
      k = 1_ip
      do s = 1_ip, bodies%n
         if (.not. bodies%fixed(s)) cycle
         force = 0.0_wp
         torque = 0.0_wp
         do while (k <= n)
            if (shiftr(sorted(k), 32) /= int(bodies%global_index(s), lp)) exit
            associate (term => terms(:, place(k)))
               force = force + term(1:2)
               torque = (torque + term(3)) + term(4)
            end associate
            k = k + 1_ip
         end do
         bodies%force(:, s) = force
         bodies%torque(s) = torque
      end do
   end subroutine sum_terms

end module polydem_wall_forces
