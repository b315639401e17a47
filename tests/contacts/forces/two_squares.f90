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
      contacts%row(1)%pair = 1_ip
      contacts%row(1)%first = 1_ip
      contacts%row(1)%second = 2_ip
      contacts%row(1)%area = width*depth
      contacts%row(1)%rate = width
      contacts%row(1)%normal = [0.0_wp, width]
      contacts%row(1)%moment = 0.0_wp
      contacts%row(1)%arm_first = [0.0_wp, arm]
      contacts%row(1)%arm_second = [0.0_wp, -arm]
      contacts%row(1)%direction = [0.0_wp, -1.0_wp]
      contacts%row(1)%length = width
      contacts%row(1)%length_square = width**2 + depth**2
      contacts%row(1)%lever = 0.0_wp
      contacts%row(1)%elastic = 0.0_wp
      contacts%row(1)%normal_force = 0.0_wp
      contacts%row(1)%tangential_force = 0.0_wp
      call add_column(history, history_kind_t('tangential', 'N/m', ''), 1_ip)
      call add_column(history, history_kind_t('area', 'm2', ''), 1_ip)
   end subroutine make_contact

end module two_squares
