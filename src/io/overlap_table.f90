!> Table of deep contacts at the start, as comma-separated values (overlaps.csv).
module polydem_overlap_table
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_contact_depth, only: depth_share
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_global_order, only: global_order_t
   use polydem_kinds, only: dp, ip, wp
   use polydem_line_writer, only: line_writer_t
   use polydem_ownership, only: order_pairs
   use polydem_strings, only: to_text
   implicit none
   private
   public :: write_overlap_table

contains

   !> Write a table of all contacts whose relative depth exceeds a limit. The root rank writes it. Collective.
   subroutine write_overlap_table(path, bodies, contacts, thickness, limit, error, comm)
      !> Path of the file
      character(len=*), intent(in) :: path
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> Thickness of each body, (slot) [m]
      real(wp), intent(in) :: thickness(:)
      !> Limit of the depth as a fraction of the thickness of the thinner body
      real(wp), intent(in) :: limit
      !> Allocated on failure; the same on all ranks
      type(error_t), allocatable, intent(inout) :: error
      class(communicator_t), intent(inout) :: comm
      type(line_writer_t) :: file
      type(global_order_t) :: rows
      real(dp), allocatable :: values(:, :), block(:, :), of_rank(:)
      integer(ip), allocatable :: deep(:)
      integer(ip) :: c, k, rank

      deep = pack([(c, c=1_ip, contacts%n)], [(depth_share(contacts, thickness, c) > limit, c=1_ip, contacts%n)])
      allocate (values(7, size(deep)))
      do k = 1_ip, size(deep, kind=ip)
         c = deep(k)
         associate (i => contacts%first(c), j => contacts%second(c))
            values(:, k) = real([real(bodies%id(i), wp), real(bodies%id(j), wp), &
                                 bodies%position(:, i) + contacts%arm_first(:, c), contacts%area(c), &
                                 contacts%area(c)/contacts%length(c), depth_share(contacts, thickness, c)], dp)
         end associate
      end do
      call order_pairs(comm, bodies, contacts%first(deep), contacts%second(deep), rows)
      call rows%to_blocks(comm, values, block)
      if (comm%is_root()) call file%open(path, error)
      call comm%all_reduce_error(error)
      if (allocated(error)) return
      if (comm%is_root()) &
         call file%put_line('first,second,x [m],y [m],area [m2],depth [m],depth/thinner body')
      ! One block at a time, as no rank has memory for all of them.
      do rank = 0_ip, comm%size - 1_ip
         call gather_rows(comm, 7*int(merge(rows%n, 0_ip, rank == comm%rank)), block, of_rank)
         if (comm%is_root()) call put_rows(file, size(of_rank)/7, of_rank)
      end do
      if (comm%is_root()) call file%close(error)
      call comm%all_reduce_error(error)
   end subroutine write_overlap_table

   !> Gather the rows of all ranks; collective.
   subroutine gather_rows(comm, n, values, of_rank)
      class(communicator_t), intent(inout) :: comm
      !> Number of values that this rank gives
      integer, intent(in) :: n
      real(dp), intent(in) :: values(n)
      real(dp), allocatable, intent(out) :: of_rank(:)
      integer(ip), allocatable :: counts(:)

      call comm%gather(values, of_rank, counts)
   end subroutine gather_rows

   !> Write the rows of a block.
   subroutine put_rows(file, n, block)
      type(line_writer_t), intent(inout) :: file
      !> Number of rows
      integer, intent(in) :: n
      !> Identifiers, position, area, depth, and depth over thickness, (7, row)
      real(dp), intent(in) :: block(7, n)
      integer :: k

      do k = 1, n
         associate (row => real(block(:, k), wp))
            call file%put_line(to_text(nint(block(1, k), ip))//','//to_text(nint(block(2, k), ip))//','// &
                               to_text(row(3), 9)//','//to_text(row(4), 9)//','//to_text(row(5))//','// &
                               to_text(row(6))//','//to_text(row(7)))
         end associate
      end do
   end subroutine put_rows

end module polydem_overlap_table
