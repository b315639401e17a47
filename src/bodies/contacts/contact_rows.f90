!> Contacts that one thread has collected from its blocks, and their union in one table.
!>
!> Threads run over ranges of pairs in descending order. The table is in ascending order.
module polydem_contact_rows
   use polydem_contact_block, only: contact_block_t, store_contact, store_forces
   use polydem_contacts, only: contacts_t, grow_contacts, reserve_contacts
   use polydem_kinds, only: ip, min_parallel_size
   use polydem_pair_ranges, only: most_ranges
   implicit none
   private
   public :: contact_rows_t, start_rows, append_rows, gather_rows, release_rows

   !> Contacts of one thread
   type :: contact_rows_t
      !> The contacts, in descending order
      type(contacts_t) :: contacts
   end type contact_rows_t

contains

   !> Empty the rows.
   pure subroutine start_rows(expected, rows)
      !> Number of contacts to make room for; more may follow
      integer(ip), intent(in) :: expected
      type(contact_rows_t), intent(inout) :: rows

      rows%contacts%n = 0_ip
      if (expected > 0_ip) call reserve_contacts(rows%contacts, expected)
   end subroutine start_rows

   !> Append contacts of a block.
   subroutine append_rows(block, rows, with_forces, chosen)
      type(contact_block_t), intent(in) :: block
      type(contact_rows_t), intent(inout) :: rows
      !> Whether the block has forces
      logical, intent(in) :: with_forces
      !> Contacts to append, (block%n) or longer; default: all
      logical, intent(in), optional :: chosen(:)
      integer(ip) :: b

      associate (table => rows%contacts)
         call grow_contacts(table, table%n + block%n)
         do b = 1_ip, block%n
            if (present(chosen)) then
               if (.not. chosen(b)) cycle
            end if
            table%n = table%n + 1_ip
            call store_contact(block, b, table%row(table%n))
            if (with_forces) call store_forces(block, b, table%row(table%n))
         end do
      end associate
   end subroutine append_rows

   !> Join the rows of all threads in one table.
   subroutine gather_rows(rows, contacts)
      !> Rows of the ranges, in ascending order of the ranges, at most `most_ranges`
      type(contact_rows_t), intent(in) :: rows(:)
      !> The table; its columns are replaced
      type(contacts_t), intent(inout) :: contacts
      integer(ip) :: base(0:most_ranges), c
      integer :: r

      base(0) = 0_ip
      do r = 1, size(rows)
         base(r) = base(r - 1) + rows(r)%contacts%n
      end do
      contacts%n = base(size(rows))
      call reserve_contacts(contacts, contacts%n)
      if (contacts%n == 0_ip) return
      !$omp parallel do schedule(static, 1) if (contacts%n > min_parallel_size) default(none) &
      !$omp    shared(rows, contacts, base) private(r, c)
      do r = 1, size(rows)
         do c = 1_ip, rows(r)%contacts%n
            contacts%row(base(r) + 1_ip - c) = rows(r)%contacts%row(c)
         end do
      end do
      !$omp end parallel do
   end subroutine gather_rows

   !> Give the memory of rows back.
   pure subroutine release_rows(rows)
      type(contact_rows_t), intent(inout) :: rows(:)
      type(contact_rows_t) :: empty
      integer :: r

      do r = 1, size(rows)
         rows(r) = empty
      end do
   end subroutine release_rows

end module polydem_contact_rows
