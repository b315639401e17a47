!> Which rows a process owns of bodies, of what belongs to a body, and of pairs of bodies, and their order.
!>
!> A process owns the free bodies that it moves; the first process owns the fixed ones, which all have. A pair of bodies
!> that two processes know belongs to the owner of its *leading* body: the first one, unless that is fixed.
module polydem_own_rows
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: ip, lp
   use polydem_row_blocks, only: row_blocks_t, row_key
   use polydem_team, only: team_t
   implicit none
   private
   public :: owns_body, owns_pair, lay_out_bodies, lay_out_parts, lay_out_pairs

contains

   !> Whether a process owns a body
   elemental logical function owns_body(leads, is_ghost, is_fixed)
      !> Whether the process is the first one
      logical, intent(in) :: leads
      !> Whether another process moves the body, and whether none does
      logical, intent(in) :: is_ghost, is_fixed

      owns_body = .not. is_ghost .and. (leads .or. .not. is_fixed)
   end function owns_body

   !> Whether this process owns a pair of bodies that are not both fixed
   pure logical function owns_pair(bodies, first, second)
      !> Bodies of this process
      type(bodies_t), intent(in) :: bodies
      !> Slots of the two, in ascending order
      integer(ip), intent(in) :: first, second

      owns_pair = .not. bodies%ghost(merge(second, first, bodies%fixed(first)))
   end function owns_pair

   !> Lay out columns over the bodies.
   subroutine lay_out_bodies(team, bodies, blocks)
      !> Processes
      class(team_t), intent(inout) :: team
      !> Bodies of this process
      type(bodies_t), intent(in) :: bodies
      !> Where rows go
      type(row_blocks_t), intent(inout) :: blocks
      integer(ip) :: s

      call lay_out_parts(team, bodies, [(s, s=1_ip, bodies%n)], blocks)
   end subroutine lay_out_bodies

   !> Lay out columns over things of which each belongs to a body, like boxes and vertices.
   subroutine lay_out_parts(team, bodies, body, blocks)
      !> Processes
      class(team_t), intent(inout) :: team
      !> Bodies of this process
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body of each thing, ascending; things of one body have the same order on all processes
      integer(ip), intent(in) :: body(:)
      !> Where rows go
      type(row_blocks_t), intent(inout) :: blocks
      integer(lp), allocatable :: key(:)
      integer(ip), allocatable :: slot(:)
      integer(ip) :: k, n

      allocate (key(size(body)), slot(size(body)))
      n = 0_ip
      do k = 1_ip, size(body, kind=ip)
         associate (s => body(k))
            if (.not. owns_body(team%leads(), bodies%ghost(s), bodies%fixed(s))) cycle
            n = n + 1_ip
            key(n) = row_key(bodies%row(s), k)
            slot(n) = k
         end associate
      end do
      call blocks%lay_out(team, bodies%n_all, size(body, kind=ip), key(:n), slot(:n))
   end subroutine lay_out_parts

   !> Lay out columns over pairs of bodies, like contacts. A pair of two fixed bodies must not be among them.
   subroutine lay_out_pairs(team, bodies, first, second, blocks)
      !> Processes
      class(team_t), intent(inout) :: team
      !> Bodies of this process
      type(bodies_t), intent(in) :: bodies
      !> Slots of the two bodies of each pair, in ascending order
      integer(ip), intent(in) :: first(:), second(:)
      !> Where rows go
      type(row_blocks_t), intent(inout) :: blocks
      integer(lp), allocatable :: key(:)
      integer(ip), allocatable :: slot(:)
      integer(ip) :: k, n

      allocate (key(size(first)), slot(size(first)))
      n = 0_ip
      do k = 1_ip, size(first, kind=ip)
         if (.not. owns_pair(bodies, first(k), second(k))) cycle
         n = n + 1_ip
         key(n) = row_key(bodies%row(first(k)), bodies%row(second(k)))
         slot(n) = k
      end do
      call blocks%lay_out(team, bodies%n_all, size(first, kind=ip), key(:n), slot(:n))
   end subroutine lay_out_pairs

end module polydem_own_rows
