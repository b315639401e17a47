!> Index from bodies to contacts: for each body the list of its contacts, in the order of the table of contacts.
module polydem_contact_incidence
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip
   implicit none
   private
   public :: incidence_t, index_contacts

   !> Contacts of each body
   type :: incidence_t
      !> Contacts start_first(s) .. start_first(s + 1) - 1 have body s as their first, (n + 1)
      integer(ip), allocatable :: start_first(:)
      !> Entries start_second(s) .. start_second(s + 1) - 1 of `contact` have body s as their second, (n + 1)
      integer(ip), allocatable :: start_second(:)
      !> Contacts ordered by their second body, then by their first
      integer(ip), allocatable :: contact(:)
   end type incidence_t

contains

   !> Build the index from bodies to contacts. Complexity: linear in bodies and contacts.
   subroutine index_contacts(n_bodies, contacts, incidence)
      !> Number of bodies
      integer(ip), intent(in) :: n_bodies
      !> Contacts in ascending order
      type(contacts_t), intent(in) :: contacts
      !> The index; its arrays grow if necessary
      type(incidence_t), intent(inout) :: incidence
      integer(ip) :: c, s

      call reserve(n_bodies, contacts%n, incidence)
      associate (start_1 => incidence%start_first, start_2 => incidence%start_second)
         start_1 = 0_ip
         start_2 = 0_ip
         do c = 1_ip, contacts%n
            start_1(contacts%row(c)%first) = start_1(contacts%row(c)%first) + 1_ip
            start_2(contacts%row(c)%second) = start_2(contacts%row(c)%second) + 1_ip
         end do
         call counts_to_ends(n_bodies, start_1)
         call counts_to_ends(n_bodies, start_2)
         do c = contacts%n, 1_ip, -1_ip
            s = contacts%row(c)%second
            start_1(contacts%row(c)%first) = start_1(contacts%row(c)%first) - 1_ip
            start_2(s) = start_2(s) - 1_ip
            incidence%contact(start_2(s)) = c
         end do
      end associate
   end subroutine index_contacts

   !> Make room for bodies and contacts.
   subroutine reserve(n_bodies, n_contacts, incidence)
      integer(ip), intent(in) :: n_bodies, n_contacts
      type(incidence_t), intent(inout) :: incidence

      if (.not. allocated(incidence%start_first)) then
         allocate (incidence%start_first(n_bodies + 1_ip), incidence%start_second(n_bodies + 1_ip))
         allocate (incidence%contact(0))
      end if
      if (size(incidence%contact) < n_contacts) then
         deallocate (incidence%contact)
         allocate (incidence%contact(n_contacts + n_contacts/4_ip))
      end if
   end subroutine reserve

   !> Turn the count of each body into the index behind its last entry.
   pure subroutine counts_to_ends(n, start)
      integer(ip), intent(in) :: n
      integer(ip), intent(inout) :: start(:)
      integer(ip) :: s, total

      total = 1_ip
      do s = 1_ip, n
         total = total + start(s)
         start(s) = total
      end do
      start(n + 1_ip) = total
   end subroutine counts_to_ends

end module polydem_contact_incidence
