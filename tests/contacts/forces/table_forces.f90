!> Forces of a table of contacts: the blocks of the table pass one part, or a whole law.
module table_forces
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: block_size, contact_block_t, copy_motion, store_forces
   use polydem_contact_history, only: contact_history_t
   use polydem_contacts, only: contacts_t, load_block
   use polydem_force_law, only: force_law_t
   use polydem_force_part, only: force_part_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: add_to_table, evaluate_law

contains

   !> Add a part to the forces of a table of contacts.
   subroutine add_to_table(part, bodies, dt, contacts, history, dashpot)
      class(force_part_t), intent(in) :: part
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s]
      real(wp), intent(in) :: dt
      type(contacts_t), intent(inout) :: contacts
      type(contact_history_t), intent(inout) :: history
      !> Normal dashpot of all contacts, for a part that needs it [N s/m2]
      real(wp), intent(in), optional :: dashpot

      call walk(bodies, dt, contacts, history, part=part, dashpot=dashpot)
   end subroutine add_to_table

   !> Compute the forces of a table of contacts.
   subroutine evaluate_law(law, bodies, dt, contacts, history)
      type(force_law_t), intent(in) :: law
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s]
      real(wp), intent(in) :: dt
      !> Contacts; the columns from `inverse_length` on are set
      type(contacts_t), intent(inout) :: contacts
      type(contact_history_t), intent(inout) :: history

      contacts%energy_is_known = law%energy_is_known
      call walk(bodies, dt, contacts, history, law=law)
   end subroutine evaluate_law

   !> Let the blocks of a table pass a law or a part.
   subroutine walk(bodies, dt, contacts, history, law, part, dashpot)
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: dt
      type(contacts_t), intent(inout) :: contacts
      type(contact_history_t), intent(inout) :: history
      type(force_law_t), intent(in), optional :: law
      class(force_part_t), intent(in), optional :: part
      real(wp), intent(in), optional :: dashpot
      type(contact_block_t) :: block
      integer(ip) :: b, high

      do high = contacts%n, 1_ip, -block_size
         call load_block(bodies, contacts, high, block)
         call copy_motion(bodies, block)
         block%shared_force = 0.0_wp
         block%shared_dashpot = 0.0_wp
         if (present(dashpot)) block%dashpot = dashpot
         if (present(law)) call law%apply(bodies, dt, block, history)
         if (present(part)) call part%add(bodies, dt, block, history)
         do b = 1_ip, block%n
            call store_forces(block, b, contacts%row(high - b + 1_ip))
         end do
      end do
   end subroutine walk

end module table_forces
