!> Finds all contacts of a step at once, as a table.
module polydem_find_contacts
   use omp_lib, only: omp_get_max_threads
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: contact_block_t, is_degenerate
   use polydem_contact_history, only: contact_history_t
   use polydem_contact_rows, only: append_rows, contact_rows_t, gather_rows, start_rows
   use polydem_contacts, only: contacts_t
   use polydem_fill_block, only: fill_block
   use polydem_kinds, only: dp, ip
   use polydem_overlap_measure, only: overlap_measure_t
   use polydem_pair_ranges, only: divide_pairs, most_ranges
   implicit none
   private
   public :: find_contacts

contains

   !> Find the contacts of this step, in the order of the pairs. The result does not depend on the number of threads.
   subroutine find_contacts(bodies, n_pairs, first, second, history, contacts)
      !> Bodies with rotated polygons
      type(bodies_t), intent(in) :: bodies
      !> Number of pairs
      integer(ip), intent(in) :: n_pairs
      !> Lower slot of each pair, (n_pairs) or longer
      integer(ip), intent(in) :: first(:)
      !> Higher slot of each pair, (n_pairs) or longer
      integer(ip), intent(in) :: second(:)
      !> Contact history of the pairs: `features` is updated, and the other columns are cleared for pairs whose polygons
      !> do not overlap; any column may be absent
      type(contact_history_t), intent(inout) :: history
      !> Contacts; `measure` must be set. The columns that the forces fill are not set
      type(contacts_t), intent(inout) :: contacts
      type(contact_rows_t) :: rows(most_ranges)
      integer(ip) :: ends(0:most_ranges)
      integer(ip) :: c, n_ranges, r
      real(dp), allocatable :: equal_parts(:)

      n_ranges = min(int(omp_get_max_threads(), ip), most_ranges)
      call divide_pairs(n_pairs, first, bodies%pieces, n_ranges, equal_parts, ends)
      !$omp parallel do if (n_ranges > 1_ip) schedule(static, 1) default(none) private(r) &
      !$omp    shared(bodies, first, second, history, contacts, rows, ends, n_ranges)
      do r = 1_ip, n_ranges
         call start_rows(0_ip, rows(r))
         call find_in_range(bodies, first, second, contacts%measure, ends(r - 1_ip:r), history, rows(r))
      end do
      !$omp end parallel do
      call gather_rows(rows(:n_ranges), contacts)
      contacts%n_degenerate = 0_ip
      do c = 1_ip, contacts%n
         if (is_degenerate(contacts%row(c))) contacts%n_degenerate = contacts%n_degenerate + 1_ip
      end do
   end subroutine find_contacts

   !> Find the contacts of a range of pairs.
   subroutine find_in_range(bodies, first, second, measure, ends, history, rows)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: first(:), second(:)
      type(overlap_measure_t), intent(in) :: measure
      !> Index of the last pair before the range, and of its last pair
      integer(ip), intent(in) :: ends(2)
      type(contact_history_t), intent(inout) :: history
      type(contact_rows_t), intent(inout) :: rows
      type(contact_block_t) :: block
      integer(ip) :: next, tested

      next = ends(2)
      tested = next + 1_ip
      do while (next > ends(1))
         call fill_block(bodies, first, second, measure, ends(1) + 1_ip, next, tested, history, block)
         call append_rows(block, rows, with_forces=.false.)
      end do
   end subroutine find_in_range

end module polydem_find_contacts
