!> Table of deep contacts at the start, as comma-separated values (overlaps.csv).
module polydem_overlap_table
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_contact_depth, only: depth_share
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_row_distribution, only: row_distribution_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_line_writer, only: line_writer_t
   use polydem_ownership, only: order_pairs
   use polydem_strings, only: text_t, to_text
   implicit none
   private
   public :: write_overlap_table

   !> Binary exponents below this one have decimal exponents of two digits
   integer, parameter :: greatest_exponent = 328
   !> Rows that are gathered at a time
   integer(ip), parameter :: piece = 32000_ip
   !> Rows that a thread writes to a text at a time
   integer, parameter :: slice = 500
   !> Bytes that no row exceeds
   integer, parameter :: longest_row = 128

contains

   !> Write a table of all contacts whose relative depth exceeds a limit. The root rank writes it. Collective.
   subroutine write_overlap_table(path, bodies, contacts, thinner, limit, error, comm)
      !> Path of the file
      character(len=*), intent(in) :: path
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> Thickness of the thinner piece of each contact, (contact) [m]
      real(wp), intent(in) :: thinner(:)
      !> Limit of the depth as a fraction of it
      real(wp), intent(in) :: limit
      !> Allocated on failure; the same on all ranks
      type(error_t), allocatable, intent(inout) :: error
      class(communicator_t), intent(inout) :: comm
      type(line_writer_t) :: file
      real(dp), allocatable :: block(:, :), of_rank(:)
      integer(lp) :: most(1)
      integer(ip) :: low, n, rank

      call collect_rows(bodies, contacts, thinner, limit, comm, block)
      if (comm%is_root()) call file%open(path, error)
      call comm%all_reduce_error(error)
      if (allocated(error)) return
      if (comm%is_root()) &
         call file%put_line('first,second,x [m],y [m],area [m2],depth [m],depth/thinner body')
      ! A piece of a block at a time, as no rank has memory for all of them.
      most = size(block, 2, lp)
      call comm%all_reduce_max(most)
      do rank = 0_ip, comm%size - 1_ip
         do low = 1_ip, int(most(1), ip), piece
            n = merge(max(0_ip, min(piece, size(block, 2, ip) - low + 1_ip)), 0_ip, rank == comm%rank)
            call gather_rows(comm, 7*int(n), block(:, low:low + n - 1_ip), of_rank)
            if (comm%is_root()) call put_rows(file, size(of_rank)/7, of_rank)
         end do
      end do
      if (comm%is_root()) call file%close(error)
      call comm%all_reduce_error(error)
   end subroutine write_overlap_table

   !> Collect the rows of this rank: blocks of ranks are consecutive parts of the table. Collective.
   subroutine collect_rows(bodies, contacts, thinner, limit, comm, block)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      real(wp), intent(in) :: thinner(:), limit
      class(communicator_t), intent(inout) :: comm
      !> Identifiers, position, area, depth, and depth over thickness, (7, row)
      real(dp), allocatable, intent(out) :: block(:, :)
      type(row_distribution_t) :: rows
      real(dp), allocatable :: values(:, :)
      logical, allocatable :: is_deep(:)
      integer(ip), allocatable :: deep(:)
      integer(ip) :: c, k

      allocate (is_deep(contacts%n))
      do c = 1_ip, contacts%n
         is_deep(c) = depth_share(contacts, thinner, c) > limit
      end do
      allocate (deep(count(is_deep)), values(7, count(is_deep)))
      k = 0_ip
      do c = 1_ip, contacts%n
         if (.not. is_deep(c)) cycle
         k = k + 1_ip
         deep(k) = c
         associate (i => contacts%row(c)%first, j => contacts%row(c)%second)
            values(:, k) = real([real(bodies%id(i), wp), real(bodies%id(j), wp), &
                                 bodies%position(:, i) + contacts%row(c)%arm_first, contacts%row(c)%area, &
                                 contacts%row(c)%depth, depth_share(contacts, thinner, c)], dp)
         end associate
      end do
      call order_pairs(comm, bodies, contacts%row(deep)%first, contacts%row(deep)%second, rows)
      call rows%to_blocks(comm, values, block)
   end subroutine collect_rows

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

   !> Write some rows. Their numbers take most of the time, so the threads share them.
   subroutine put_rows(file, n, block)
      type(line_writer_t), intent(inout) :: file
      !> Number of rows
      integer, intent(in) :: n
      !> Identifiers, position, area, depth, and depth over thickness, (7, row)
      real(dp), intent(in) :: block(7, n)
      type(text_t) :: rows((n + slice - 1)/slice)
      integer :: k

      !$omp parallel do if (n > slice) schedule(static) default(none) shared(n, block, rows) private(k)
      do k = 1, size(rows)
         call write_rows(block(:, (k - 1)*slice + 1:min(k*slice, n)), rows(k)%text)
      end do
      !$omp end parallel do
      do k = 1, size(rows)
         call file%put(rows(k)%text)
      end do
   end subroutine put_rows

   !> Write some rows to a text.
   subroutine write_rows(block, rows)
      !> Values of each row, as above, (7, row)
      real(dp), intent(in) :: block(:, :)
      !> The text
      character(len=:), allocatable, intent(out) :: rows
      character(len=:), allocatable :: text
      integer :: k, length

      allocate (character(len=size(block, 2)*longest_row) :: text)
      length = 0
      do k = 1, size(block, 2)
         call append_row(nint(block(:2, k), ip), real(block(3:, k), wp), text, length)
      end do
      rows = text(:length)
   end subroutine write_rows

   !> Append a row to a text, with its numbers as `to_text` writes them. Usual numbers are written together: a table may
   !> have millions of rows.
   subroutine append_row(identifiers, values, text, length)
      !> Identifiers of the two bodies
      integer(ip), intent(in) :: identifiers(2)
      !> Position, area, depth, and depth over thickness
      real(wp), intent(in) :: values(5)
      !> The text and its length, with room for the row
      character(len=*), intent(inout) :: text
      integer, intent(inout) :: length
      character(len=longest_row) :: row
      integer :: k

      if (all(abs(exponent(values)) < greatest_exponent)) then
         write (row, '(i0, ",", i0, 2(",", es15.8e2), 3(",", es12.5e2))') identifiers, values
      else
         row = to_text(identifiers(1))//','//to_text(identifiers(2))//','//to_text(values(1), 9)//','// &
            to_text(values(2), 9)//','//to_text(values(3))//','//to_text(values(4))//','//to_text(values(5))
      end if
      do k = 1, len_trim(row)
         if (row(k:k) == ' ') cycle
         length = length + 1
         text(length:length) = row(k:k)
      end do
      length = length + 1
      text(length:length) = new_line('a')
   end subroutine append_row

end module polydem_overlap_table
