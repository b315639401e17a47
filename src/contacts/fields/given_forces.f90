!> Forces and torques that actions give to bodies, held until they are given others.
!>
!> They come from outside: their work counts as that of moving walls.
module polydem_given_forces
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_sort, only: ascending_order, place_in
   implicit none
   private
   public :: given_forces_t

   !> Forces on some bodies
   type :: given_forces_t
      private
      !> Identifiers of the bodies, ascending
      integer(ip), allocatable :: id(:)
      !> Forces along x and y [N/m] and torques [N], (3, body)
      real(wp), allocatable :: value(:, :)
   contains
      procedure :: set
      procedure :: find
   end type given_forces_t

contains

   !> Set the forces on some bodies, and keep those on others.
   subroutine set(self, id, value)
      class(given_forces_t), intent(inout) :: self
      !> Identifiers, each once
      integer(ip), intent(in) :: id(:)
      !> Forces and torques, (3, body)
      real(wp), intent(in) :: value(:, :)
      integer(ip), allocatable :: all_of_them(:), order(:)
      real(wp), allocatable :: values(:, :)
      integer(ip) :: k, slot
      logical :: is_new(size(id))

      if (.not. allocated(self%id)) allocate (self%id(0), self%value(3, 0))
      is_new = .true.
      do k = 1_ip, size(id, kind=ip)
         slot = place_in(self%id, id(k))
         if (slot > size(self%id)) cycle
         if (self%id(slot) /= id(k)) cycle
         is_new(k) = .false.
         self%value(:, slot) = value(:, k)
      end do
      if (.not. any(is_new)) return
      all_of_them = [self%id, pack(id, is_new)]
      values = reshape([self%value, pack(value, spread(is_new, 1, 3))], [3, size(all_of_them)])
      order = ascending_order(int(all_of_them, lp))
      self%id = all_of_them(order)
      self%value = values(:, order)
   end subroutine set

   !> Find the forces on some bodies; 0 for those that were given none.
   pure subroutine find(self, bodies, slots, force)
      class(given_forces_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies, ascending as their identifiers are
      integer(ip), intent(in) :: slots(:)
      !> Forces and torques, (3, body)
      real(wp), intent(out) :: force(:, :)
      integer(ip) :: j, k

      force(:, :size(slots)) = 0.0_wp
      if (size(slots) == 0) return
      j = place_in(self%id, bodies%id(slots(1)))
      do k = 1_ip, size(slots, kind=ip)
         do while (j <= size(self%id))
            if (self%id(j) >= bodies%id(slots(k))) exit
            j = j + 1_ip
         end do
         if (j > size(self%id)) return
         if (self%id(j) == bodies%id(slots(k))) force(:, k) = self%value(:, j)
      end do
   end subroutine find

end module polydem_given_forces
