!> Forces on fixed bodies when several processes know only a part of the contacts each.
module polydem_wall_forces
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_row_blocks, only: row_key
   use polydem_sort, only: sort_keys
   use polydem_team, only: team_t
   implicit none
   private
   public :: complete_wall_forces

contains

   !> Complete the forces and torques on fixed bodies on the first process, where they are written from.
   !>
   !> The terms are brought there and summed in ascending order of the partner, as `assemble_forces` does, so that the
   !> sums have the bits that they have if one process knows all contacts; then it has summed them already.
   subroutine complete_wall_forces(team, bodies, contacts)
      !> Processes
      class(team_t), intent(inout) :: team
      !> Bodies of this process; on the first one `force` and `torque` of the fixed ones change
      type(bodies_t), intent(inout) :: bodies
      !> Contacts of this process with their forces
      type(contacts_t), intent(in) :: contacts
      integer(lp), allocatable :: key(:, :), all_keys(:, :)
      real(wp), allocatable :: terms(:, :), all_terms(:, :)
      integer(ip), allocatable :: counts(:), from(:)

      if (team%size == 1_ip) return
      call list_terms(bodies, contacts, key, terms)
      allocate (counts(0:team%size - 1_ip))
      counts = 0_ip
      counts(0) = size(key, 2, kind=ip)
      call team%trade(key, counts, all_keys, from)
      call team%trade(terms, counts, all_terms, from)
      if (team%leads()) call sum_terms(all_keys(1, :), all_terms, bodies)
   end subroutine complete_wall_forces

   !> List what contacts with fixed bodies add to their forces. Their partners are free bodies of this process.
   subroutine list_terms(bodies, contacts, key, terms)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> Rows of the fixed body and of its partner
      integer(lp), allocatable, intent(out) :: key(:, :)
      !> Force along x and y, torque of the forces, torque of its own, (4, term)
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
               key(1, k) = row_key(bodies%row(i), bodies%row(j))
               terms(:, k) = terms_of(contacts, c, contacts%arm_first(:, c))
            else if (bodies%fixed(j)) then
               k = k + 1_ip
               key(1, k) = row_key(bodies%row(j), bodies%row(i))
               terms(:, k) = -terms_of(contacts, c, contacts%arm_second(:, c))
            end if
         end associate
      end do
   end subroutine list_terms

   !> Force of a contact on its first body, and its torques about a point, in the words of `assemble_forces`
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

   !> Sum terms in ascending order of keys.
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
            if (shiftr(sorted(k), 32) /= int(bodies%row(s), lp)) exit
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
