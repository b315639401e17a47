!> Terms of the contacts between fixed and free bodies, for the energy balance and for forces on walls.
module polydem_wall_terms
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t, load_block
   use polydem_contacts, only: contacts_t
   use polydem_force_sums, only: contact_terms_t, n_terms, term_of, terms_of_block
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: wall_terms_t, append_walls, join_walls, select_walls

   !> Terms of contacts 1..n with fixed bodies, in descending order; the arrays may be longer
   type :: wall_terms_t
      !> Number of contacts
      integer(ip) :: n = 0_ip
      !> Whether the elastic force has an energy (see `contacts_t`)
      logical :: energy_is_quadratic = .false.
      !> Slots of the fixed and of the free body of each contact, (2, n) or longer
      integer(ip), allocatable :: slots(:, :)
      !> Term of the fixed body of each contact (see `polydem_force_sums`), (n_terms, n) or longer
      real(wp), allocatable :: term(:, :)
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
         walls%n = walls%n + 1_ip
         associate (i => block%first(c), j => block%second(c))
            walls%slots(:, walls%n) = merge([i, j], [j, i], fixed(i))
            walls%term(:, walls%n) = term_of(terms, c, fixed(i))
         end associate
      end do
   end subroutine append_walls

   !> Make room for more contacts.
   pure subroutine reserve_walls(n, walls)
      !> Number of contacts to make room for
      integer(ip), intent(in) :: n
      type(wall_terms_t), intent(inout) :: walls
      integer(ip), allocatable :: slots(:, :)
      real(wp), allocatable :: term(:, :)

      if (.not. allocated(walls%slots)) allocate (walls%slots(2, 0), walls%term(n_terms, 0))
      if (n <= size(walls%slots, 2)) return
      allocate (slots(2, 2_ip*n), term(n_terms, 2_ip*n))
      slots(:, :walls%n) = walls%slots(:, :walls%n)
      term(:, :walls%n) = walls%term(:, :walls%n)
      call move_alloc(slots, walls%slots)
      call move_alloc(term, walls%term)
   end subroutine reserve_walls

   !> Join the contacts of several ranges of pairs.
   pure subroutine join_walls(ranges, walls)
      !> Those of each range, in ascending order of the ranges
      type(wall_terms_t), intent(in) :: ranges(:)
      !> All; whether there is an energy does not change
      type(wall_terms_t), intent(inout) :: walls
      integer :: r

      walls%n = 0_ip
      call reserve_walls(sum(ranges%n), walls)
      do r = size(ranges), 1, -1
         associate (n => ranges(r)%n, low => walls%n + 1_ip)
            if (n == 0_ip) cycle
            walls%slots(:, low:low + n - 1_ip) = ranges(r)%slots(:, :n)
            walls%term(:, low:low + n - 1_ip) = ranges(r)%term(:, :n)
            walls%n = walls%n + n
         end associate
      end do
   end subroutine join_walls

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

      walls%energy_is_quadratic = contacts%energy_is_quadratic
      walls%n = 0_ip
      do high = contacts%n, 1_ip, -block_size
         call load_block(bodies, contacts, high, block)
         call terms_of_block(block, terms)
         call append_walls(bodies%fixed, block, terms, walls)
      end do
   end subroutine select_walls

end module polydem_wall_terms
