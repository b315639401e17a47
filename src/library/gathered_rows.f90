!> The rows of all ranks of what each rank has a part of: bodies, their vertices, and contacts.
!>
!> Each row comes from the rank that owns it. All ranks get all rows, in the order of the frames of a result.
module polydem_gathered_rows
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ownership, only: order_bodies, order_pairs, order_vertices, owns_pair
   use polydem_row_distribution, only: row_distribution_t
   implicit none
   private
   public :: gather_rows, number_of_contacts

contains

   !> Replace the rows of this rank by those of all ranks; collective. Arrays that all ranks have stay as they are.
   subroutine gather_rows(comm, name, bodies, contacts, width, integers, reals)
      class(communicator_t), intent(inout) :: comm
      !> Name of the array
      character(len=*), intent(in) :: name
      type(bodies_t), intent(in) :: bodies
      !> Table of the contacts of this step
      type(contacts_t), intent(in) :: contacts
      !> Number of values per row
      integer(lp), intent(in) :: width
      !> The rows, one after the other; unallocated if they are real numbers, or if there is no such array
      integer(lp), allocatable, intent(inout) :: integers(:)
      !> Likewise, if they are whole numbers
      real(wp), allocatable, intent(inout) :: reals(:)
      type(row_distribution_t) :: rows
      integer(ip), allocatable :: counts(:)
      integer(lp), allocatable :: block(:, :)
      real(dp), allocatable :: real_block(:, :), all_reals(:)
      logical :: starts
      integer :: k

      if (.not. (allocated(integers) .or. allocated(reals))) return
      ! One rank has all rows in their order, but for contacts of bodies of several pieces.
      if (comm%size == 1_ip .and. (index(name, 'contacts/') /= 1 .or. bodies%pieces%most == 1_ip)) return
      starts = name == 'bodies/vertex_start'
      if (starts) integers = integers(2:) - integers(:size(integers) - 1)
      if (name == 'bodies/vertex' .or. name == 'bodies/piece') then
         call order_vertices(comm, bodies, rows)
      else if (index(name, 'bodies/') == 1) then
         call order_bodies(comm, bodies, rows)
      else if (index(name, 'contacts/') == 1) then
         call order_pairs(comm, bodies, contacts%row(:contacts%n)%first, contacts%row(:contacts%n)%second, rows)
      else
         return
      end if
      if (allocated(integers)) then
         call rows%to_blocks(comm, reshape(integers, [int(width), size(integers)/int(width)]), block)
         call comm%gather(reshape(block, [size(block)]), integers, counts)
      else
         call rows%to_blocks(comm, reshape(real(reals, dp), [int(width), size(reals)/int(width)]), real_block)
         call comm%gather(reshape(real_block, [size(real_block)]), all_reals, counts)
         reals = real(all_reals, wp)
      end if
      if (starts) then
         integers = [0_lp, integers]
         do k = 2, size(integers)
            integers(k) = integers(k) + integers(k - 1)
         end do
      end if
   end subroutine gather_rows

   !> Number of contacts in the tables of all ranks; collective
   integer(lp) function number_of_contacts(comm, bodies, contacts) result(n)
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      integer(lp) :: own(1)
      integer(ip) :: c

      own = 0_lp
      do c = 1_ip, contacts%n
         associate (row => contacts%row(c))
            if (owns_pair(bodies, row%first, row%second)) own = own + 1_lp
         end associate
      end do
      call comm%all_reduce_sum(own)
      n = own(1)
   end function number_of_contacts

end module polydem_gathered_rows
