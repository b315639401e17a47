!> Springs and dashpots of a contact, from which the stable time step is computed. The parts of a force law add theirs.
module polydem_linearised_contact
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: linearised_contact_t, face_tilt_stiffness

   !> Springs and dashpots of one contact. An *expected contact* is not in the table of contacts; it is derived from the
   !> shape of a free body and has no forces
   type :: linearised_contact_t
      !> Whether the contact is expected
      logical :: is_expected = .false.
      !> Numbers of the materials of both bodies
      integer(ip) :: materials(2) = 0_ip
      !> Ratio L/l of the length of the contact to the characteristic length; the elastic part sets that of an expected
      !> contact
      real(wp) :: ratio = 0.0_wp
      !> Area [m2], length L [m] and reciprocal characteristic length 1/l [1/m]; of an expected contact the greatest
      !> length, else 0
      real(wp) :: area = 0.0_wp, length = 0.0_wp, inverse_length = 0.0_wp
      !> Elastic repulsion, and normal force without cohesion [N/m]; 0 for an expected contact
      real(wp) :: elastic = 0.0_wp, repulsion = 0.0_wp
      !> Expected contact: greatest ratio of its length to twice its distance from the centre, square of the length over
      !> the area of the body, and square of the greatest radius of the body [m2]
      real(wp) :: edge_ratio = 0.0_wp, square_ratio = 0.0_wp, radius_square = 0.0_wp
      !> Speed of approach [m/s] and depth, area over length [m], of an expected contact
      real(wp) :: speed = 0.0_wp, depth = 0.0_wp
      !> Moment of inertia of that body [kg m]
      real(wp) :: inertia = 0.0_wp
      !> Sum of the reciprocal masses of both bodies, and its reciprocal, the normal effective mass [m/kg, kg/m]
      real(wp) :: normal_mobility = 0.0_wp, normal_mass = 0.0_wp
      !> Reciprocal square of a length of the bodies, (1/I1 + 1/I2)/(6 (1/m1 + 1/m2)): that of the side of a square
      !> [1/m2]
      real(wp) :: inverse_square = 0.0_wp
      !> Effective mass against slip at the force point [kg/m]
      real(wp) :: tangential_mass = 0.0_wp
      !> Sum of the reciprocal moments of inertia of the free bodies [1/(kg m)]; 0 for an expected contact
      real(wp) :: rotational_mobility = 0.0_wp
      !> Upper bounds of the reduced radius of the bodies [m] and of their reduced moment of inertia about the contact
      !> [kg m], for a couple against rolling
      real(wp) :: rolling_radius = 0.0_wp, rolling_inertia = 0.0_wp
      !> Stiffness against approach and against slip [N/m2], and against tilts [N]
      real(wp) :: normal_stiffness = 0.0_wp, tangential_stiffness = 0.0_wp, tilt_stiffness = 0.0_wp
      !> Dashpot against approach and against slip [N s/m2], and against tilts [N s]
      real(wp) :: normal_dashpot = 0.0_wp, tangential_dashpot = 0.0_wp, tilt_dashpot = 0.0_wp
   end type linearised_contact_t

contains

   !> Stiffness of a face against tilts, E L/l L^2/12 [N]
   pure real(wp) function face_tilt_stiffness(stiffness, element)
      !> Young's modulus in two dimensions E [N/m2]
      real(wp), intent(in) :: stiffness
      !> The contact with its length
      type(linearised_contact_t), intent(in) :: element

      face_tilt_stiffness = stiffness*element%length**3*element%inverse_length/12.0_wp
   end function face_tilt_stiffness

end module polydem_linearised_contact
