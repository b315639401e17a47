!> A contact as an element of the stable step: springs and dashpots, to which the parts of a force law add.
module polydem_contact_element
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: contact_element_t, face_tilt_stiffness

   !> Springs and dashpots of one contact, or of one that is expected from the shape of a free body
   type :: contact_element_t
      !> Place in the table of contacts; 0: only expected, so that no forces are known
      integer(ip) :: contact = 0_ip
      !> Slot of the body if the contact is only expected, else 0
      integer(ip) :: body = 0_ip
      !> Length of the contact over the characteristic length, L/l; of an expected one the elastic part sets it
      real(wp) :: ratio = 0.0_wp
      !> Sum of the reciprocal masses of both bodies, and its reciprocal, the normal effective mass [m/kg, kg/m]
      real(wp) :: normal_mobility = 0.0_wp, normal_mass = 0.0_wp
      !> Effective mass against slip at the force point [kg/m]
      real(wp) :: tangential_mass = 0.0_wp
      !> Sum of the reciprocal moments of inertia of the free bodies [1/(kg m)]; 0 if only expected
      real(wp) :: rotational_mobility = 0.0_wp
      !> Square of the greatest radius of the body if the contact is only expected [m2]
      real(wp) :: radius_square = 0.0_wp
      !> Stiffness against approach and against slip [N/m2], and against tilts [N]
      real(wp) :: normal_stiffness = 0.0_wp, tangential_stiffness = 0.0_wp, tilt_stiffness = 0.0_wp
      !> Dashpot against approach and against slip [N s/m2], and against tilts [N s]
      real(wp) :: normal_dashpot = 0.0_wp, tangential_dashpot = 0.0_wp, tilt_dashpot = 0.0_wp
   end type contact_element_t

contains

   !> Stiffness of a contact against tilts, as if it was a face, E L/l L^2/12 [N]
   pure real(wp) function face_tilt_stiffness(stiffness, contacts, c)
      !> Young's modulus in two dimensions E [N/m2]
      real(wp), intent(in) :: stiffness
      !> Contacts with their lengths
      type(contacts_t), intent(in) :: contacts
      !> Place in the table
      integer(ip), intent(in) :: c

      face_tilt_stiffness = stiffness*contacts%length(c)**3*contacts%inverse_length(c)/12.0_wp
   end function face_tilt_stiffness

end module polydem_contact_element
