!> The columns of contacts in frames, besides the identifiers of both bodies: the list of their names, and their values
!> for a contact of the table, in the same order.
module polydem_contact_columns
   use polydem_bodies, only: bodies_t
   use polydem_contact_resultant, only: find_resultant
   use polydem_contacts, only: contact_force, contacts_t
   use polydem_kinds, only: dp, ip, wp
   use polydem_label, only: label_t
   implicit none
   private
   public :: contact_columns, values_of

   !> A column; its name is that of its data set in /contacts
   type, extends(label_t) :: contact_column_t
      !> Number of components: 1, or 2 of a vector
      integer :: width = 1
   end type contact_column_t

   !> All columns
   type(contact_column_t), parameter :: contact_columns(*) = [ &
      contact_column_t('area', 'm2', 'area of the overlap; with the conservative law its effective area'), &
      contact_column_t('point', 'm', 'point within both bodies where the force acts, in the world', 2), &
      contact_column_t('normal', '1', 'unit normal from the first body into the second', 2), &
      contact_column_t('length', 'm', 'length of the contact: the area over the depth'), &
      contact_column_t('force', 'N/m', 'force on the first body; the second feels the opposite', 2), &
      contact_column_t('couple', 'N', &
                       'torque on the first body besides that of the force; the second feels the opposite')]

contains

   !> Values of the columns of contact c, one after the other, in the order of the list
   pure function values_of(bodies, contacts, c) result(values)
      !> Bodies with turned vertices
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> Index of the contact
      integer(ip), intent(in) :: c
      real(dp) :: values(sum(contact_columns%width))
      real(wp) :: shift(2), couple

      call find_resultant(bodies, contacts, c, shift, couple)
      associate (row => contacts%row(c))
         values = real([ &
            row%area, &
            bodies%position(:, row%first) + (row%arm_first + shift), &
            -row%direction, &
            row%area/row%depth, &
            contact_force(contacts, c), &
            couple], dp)
      end associate
   end function values_of

end module polydem_contact_columns
