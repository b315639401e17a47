!> Two equal squares in a face contact, for tests of force parts.
module two_squares
   use polydem_bodies, only: bodies_t
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_contact_history, only: contact_history_t, history_kind_t, add_column
   use polydem_contacts, only: contacts_t, reserve_contacts
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: make_contact, width, depth, mass, at_tangential, at_area

   !> Side of the squares [m]
   real(wp), parameter :: width = 0.01_wp
   !> Depth of the contact [m]
   real(wp), parameter :: depth = 1.0e-6_wp
   !> Mass of each [kg/m]
   real(wp), parameter :: mass = 2500.0_wp*width**2

   !> Columns of the contact history
   integer, parameter :: at_tangential = 1, at_area = 2

contains

   !> The second square is above the first. The first approaches at 1 m/s and slides at 2 m/s to the right.
   subroutine make_contact(bodies, contacts, history)
      !> Two squares
      type(bodies_t), intent(out) :: bodies
      !> One contact
      type(contacts_t), intent(out) :: contacts
      !> Columns for one pair
      type(contact_history_t), intent(out) :: history
      type(body_list_t) :: list
      type(error_t), allocatable :: error
      real(wp) :: square(2, 4), arm

      square = width*reshape([-0.5_wp, -0.5_wp, 0.5_wp, -0.5_wp, 0.5_wp, 0.5_wp, -0.5_wp, 0.5_wp], [2, 4])
      call list%append(square, velocity=[2.0_wp, 1.0_wp])
      square(2, :) = square(2, :) + (width - depth)
      call list%append(square)
      call new_bodies(list, bodies, error)
      call reserve_contacts(contacts, 1_ip)
      arm = 0.5_wp*(width - depth)
      contacts%n = 1_ip
      contacts%pair(1) = 1_ip
      contacts%first(1) = 1_ip
      contacts%second(1) = 2_ip
      contacts%area(1) = width*depth
      contacts%rate(1) = width
      contacts%normal(:, 1) = [0.0_wp, width]
      contacts%moment(:, 1) = 0.0_wp
      contacts%arm_first(:, 1) = [0.0_wp, arm]
      contacts%arm_second(:, 1) = [0.0_wp, -arm]
      contacts%direction(:, 1) = [0.0_wp, -1.0_wp]
      contacts%length(1) = width
      contacts%length_square(1) = width**2 + depth**2
      contacts%lever(1) = 0.0_wp
      contacts%elastic(1) = 0.0_wp
      contacts%normal_force(1) = 0.0_wp
      contacts%tangential_force(1) = 0.0_wp
      call add_column(history, history_kind_t('tangential', 'N/m', ''), 1_ip)
      call add_column(history, history_kind_t('area', 'm2', ''), 1_ip)
   end subroutine make_contact

end module two_squares
