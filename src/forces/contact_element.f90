!> Springs and dashpots of a contact, from which the stable time step is computed. The parts of a force law add theirs.
module polydem_contact_element
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: contact_element_t, face_tilt_stiffness

   !> Springs and dashpots of one contact. An *expected contact* is not in the table of contacts; it is derived from the
   !> shape of a free body and has no forces
   type :: contact_element_t
      !> Index in the table of contacts; 0: expected contact
      integer(ip) :: contact = 0_ip
      !> Slot of the body of an expected contact, else 0
      integer(ip) :: body = 0_ip
      !> Ratio L/l of the length of the contact to the characteristic length; the elastic part sets that of an expected
      !> contact
      real(wp) :: ratio = 0.0_wp
      !> Sum of the reciprocal masses of both bodies, and its reciprocal, the normal effective mass [m/kg, kg/m]
      real(wp) :: normal_mobility = 0.0_wp, normal_mass = 0.0_wp
      !> Effective mass against slip at the force point [kg/m]
      real(wp) :: tangential_mass = 0.0_wp
      !> Sum of the reciprocal moments of inertia of the free bodies [1/(kg m)]; 0 for an expected contact
      real(wp) :: rotational_mobility = 0.0_wp
      !> Square of the greatest radius of the body of an expected contact [m2]
      real(wp) :: radius_square = 0.0_wp
      !> Stiffness against approach and against slip [N/m2], and against tilts [N]
      real(wp) :: normal_stiffness = 0.0_wp, tangential_stiffness = 0.0_wp, tilt_stiffness = 0.0_wp
      !> Dashpot against approach and against slip [N s/m2], and against tilts [N s]
      real(wp) :: normal_dashpot = 0.0_wp, tangential_dashpot = 0.0_wp, tilt_dashpot = 0.0_wp
   end type contact_element_t

contains

   !> Stiffness of a face against tilts, E L/l L^2/12 [N]
   pure real(wp) function face_tilt_stiffness(stiffness, contacts, c)
      !> Young's modulus in two dimensions E [N/m2]
      real(wp), intent(in) :: stiffness
      !> Contacts with their lengths
      type(contacts_t), intent(in) :: contacts
      !> Index in the table of contacts
      integer(ip), intent(in) :: c

      face_tilt_stiffness = stiffness*contacts%length(c)**3*contacts%inverse_length(c)/12.0_wp
   end function face_tilt_stiffness

end module polydem_contact_element
