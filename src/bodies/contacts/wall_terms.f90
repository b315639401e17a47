!> Terms of the contacts between fixed and free bodies, for the energy balance and for forces on walls.
module polydem_wall_terms
   use polydem_bodies, only: bodies_t
   use polydem_bodies_in_cell, only: path_of
   use polydem_cell, only: copies_along_y
   use polydem_contact_block, only: block_size, contact_block_t
   use polydem_contacts, only: contacts_t, load_block
   use polydem_force_sums, only: contact_terms_t, n_terms, of_normal, of_tangential, sum_torque, sum_x, sum_y, &
      term_of, terms_of_block
   use polydem_kinds, only: ip, wp
   use polydem_term_list, only: append_term, reserve_terms, term_list_t
   implicit none
   private
   public :: wall_terms_t, append_walls, append_border, join_walls, select_walls, force_about

   !> Terms of the fixed bodies of contacts, in descending order of the contacts. The partners are the free bodies
   type, extends(term_list_t) :: wall_terms_t
      !> Whether the elastic force has an energy (see `contacts_t`)
      logical :: energy_is_known = .false.
      !> Index of each contact in the pair list, (n) or longer
      integer(ip), allocatable :: pair(:)
      !> In a sheared cell the terms of bodies in contacts across the upper border, with the copies of their partners
      type(term_list_t) :: border
   end type wall_terms_t

contains

   !> Append the contacts of a block with fixed bodies to a list.
   pure subroutine append_walls(fixed, block, terms, walls)
      !> Whether each body is fixed
      logical, intent(in), contiguous :: fixed(:)
      type(contact_block_t), intent(in) :: block
      type(contact_terms_t), intent(in) :: terms
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(inout) :: walls
      integer(ip) :: found(block_size + 1_ip), c, k, n

      n = 0_ip
      do c = 1_ip, block%n
         found(n + 1_ip) = c
         n = n + merge(1_ip, 0_ip, fixed(block%first(c)) .or. fixed(block%second(c)))
      end do
      if (n == 0_ip) return
      call reserve_walls(walls%n + n, walls)
      do k = 1_ip, n
         c = found(k)
         walls%pair(walls%n + 1_ip) = block%pair(c)
         associate (i => block%first(c), j => block%second(c))
            call append_term(merge([i, j], [j, i], fixed(i)), term_of(terms, c, fixed(i)), walls%term_list_t)
         end associate
      end do
   end subroutine append_walls

   !> Make room for terms and their pairs.
   pure subroutine reserve_walls(n, walls)
      !> Number of terms in all
      integer(ip), intent(in) :: n
      type(wall_terms_t), intent(inout) :: walls
      integer(ip), allocatable :: pair(:)

      call reserve_terms(n, walls%term_list_t)
      if (.not. allocated(walls%pair)) allocate (walls%pair(0))
      if (n <= size(walls%pair)) return
      allocate (pair(size(walls%slots, 2)))
      pair(:walls%n) = walls%pair(:walls%n)
      call move_alloc(pair, walls%pair)
   end subroutine reserve_walls

   !> Append the contacts of a block across the upper or lower border of a sheared cell to a list.
   pure subroutine append_border(bodies, block, terms, border)
      type(bodies_t), intent(in) :: bodies
      type(contact_block_t), intent(in) :: block
      type(contact_terms_t), intent(in) :: terms
      !> Terms of the upper body of each contact in the cell, whose partner is a copy from below it
      type(term_list_t), intent(inout) :: border
      real(wp) :: copies
      integer(ip) :: c

      do c = 1_ip, block%n
         associate (i => block%first(c), j => block%second(c))
            copies = copies_along_y(bodies%cell, bodies%position(2, j) - bodies%position(2, i))
            if (.not. abs(copies) > 0.0_wp) cycle
            call reserve_terms(border%n + 1_ip, border)
            call append_term(merge([i, j], [j, i], copies > 0.0_wp), term_of(terms, c, copies > 0.0_wp), border)
         end associate
      end do
   end subroutine append_border

   !> Join the contacts of several ranges of pairs.
   pure subroutine join_walls(ranges, walls)
      !> Those of each range, in ascending order of the ranges
      type(wall_terms_t), intent(in) :: ranges(:)
      !> All; whether there is an energy does not change
      type(wall_terms_t), intent(inout) :: walls
      integer :: r

      walls%n = 0_ip
      walls%border%n = 0_ip
      call reserve_walls(sum(ranges%n), walls)
      do r = size(ranges), 1, -1
         if (ranges(r)%n > 0_ip) walls%pair(walls%n + 1_ip:walls%n + ranges(r)%n) = ranges(r)%pair(:ranges(r)%n)
         call append_list(ranges(r)%term_list_t, walls%term_list_t)
         if (ranges(r)%border%n == 0_ip) cycle
         call reserve_terms(walls%border%n + ranges(r)%border%n, walls%border)
         call append_list(ranges(r)%border, walls%border)
      end do
   end subroutine join_walls

   !> Append a list to another one that has room for it.
   pure subroutine append_list(list, all_of_them)
      type(term_list_t), intent(in) :: list
      type(term_list_t), intent(inout) :: all_of_them

      associate (n => list%n, low => all_of_them%n + 1_ip)
         if (n == 0_ip) return
         all_of_them%slots(:, low:low + n - 1_ip) = list%slots(:, :n)
         all_of_them%term(:, low:low + n - 1_ip) = list%term(:, :n)
         all_of_them%n = all_of_them%n + n
      end associate
   end subroutine append_list

   !> Force of a contact on a fixed body along x and y [N/m], and its torque about a point [N]. The body is on its path
   !> through the copies of a periodic cell.
   pure function force_about(point, bodies, s, term) result(force)
      !> The point, (2) [m]
      real(wp), intent(in) :: point(2)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the fixed body
      integer(ip), intent(in) :: s
      !> Its term in the contact
      real(wp), intent(in) :: term(n_terms)
      real(wp) :: force(3), arm(2)

      arm = path_of(bodies, s) - point
      force(1) = term(sum_x(of_normal)) + term(sum_x(of_tangential))
      force(2) = term(sum_y(of_normal)) + term(sum_y(of_tangential))
      force(3) = (arm(1)*force(2) - arm(2)*force(1)) &
                 + (term(sum_torque(of_normal)) + term(sum_torque(of_tangential)))
   end function force_about

   !> Select the contacts with fixed bodies from a table.
   subroutine select_walls(bodies, contacts, walls)
      type(bodies_t), intent(in) :: bodies
      !> All contacts
      type(contacts_t), intent(in) :: contacts
      !> Those with fixed bodies
      type(wall_terms_t), intent(inout) :: walls
      type(contact_block_t) :: block
      type(contact_terms_t) :: terms
      integer(ip) :: high

      walls%energy_is_known = contacts%energy_is_known
      walls%n = 0_ip
      do high = contacts%n, 1_ip, -block_size
         call load_block(bodies, contacts, high, block)
         call terms_of_block(block, terms)
         call append_walls(bodies%fixed, block, terms, walls)
      end do
   end subroutine select_walls

end module polydem_wall_terms
