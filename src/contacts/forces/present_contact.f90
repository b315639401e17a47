!> The springs and dashpots of a contact of the table, and the mobilities of its two bodies at the contact point.
module polydem_present_contact
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: contact_t
   use polydem_force_law, only: force_law_t
   use polydem_kinds, only: ip, wp
   use polydem_linearised_contact, only: linearised_contact_t
   implicit none
   private
   public :: describe_contact

contains

   !> Describe a contact.
   subroutine describe_contact(law, bodies, contact, element, mobility, lever)
      type(force_law_t), intent(in) :: law
      type(bodies_t), intent(in) :: bodies
      !> The contact with its forces
      type(contact_t), intent(in) :: contact
      !> Its springs and dashpots
      type(linearised_contact_t), intent(out) :: element
      !> Mobilities of the first and the second body: normal, tangential, mixed [m/kg], rotational [1/(kg m)]; 0 of a
      !> fixed body
      real(wp), intent(out) :: mobility(4, 2)
      !> Levers of the normal and the tangential force about the centre of each body [m]
      real(wp), intent(out) :: lever(2, 2)
      real(wp) :: alone(4), rolling(2)

      mobility = 0.0_wp
      lever = 0.0_wp
      rolling = 0.0_wp
      call add_body(contact%first, contact%arm_first, 1)
      call add_body(contact%second, contact%arm_second, 2)
      alone = mobility(:, 1) + mobility(:, 2)
      if (allocated(bodies%material)) element%materials = bodies%material([contact%first, contact%second])
      element%area = contact%area
      element%length = contact%length
      element%inverse_length = contact%inverse_length
      element%ratio = element%length*element%inverse_length
      element%elastic = contact%elastic
      element%repulsion = contact%normal_force
      element%normal_mobility = bodies%inverse_mass(contact%first) + bodies%inverse_mass(contact%second)
      element%normal_mass = 1.0_wp/element%normal_mobility
      element%inverse_square = alone(4)/(6.0_wp*element%normal_mobility)
      element%tangential_mass = 1.0_wp/alone(2)
      element%rotational_mobility = alone(4)
      element%rolling_radius = 1.0_wp/rolling(1)
      element%rolling_inertia = 1.0_wp/rolling(2)
      call law%stiffen(element)

   contains

      !> Add the mobilities of one body.
      subroutine add_body(s, arm, k)
         integer(ip), intent(in) :: s
         real(wp), intent(in) :: arm(2)
         !> 1 for the first body, 2 for the second
         integer, intent(in) :: k
         real(wp) :: along, across

         if (bodies%fixed(s)) return
         across = arm(1)*contact%direction(2) - arm(2)*contact%direction(1) + contact%lever
         along = arm(1)*contact%direction(1) + arm(2)*contact%direction(2)
         lever(:, k) = [across, along]
         mobility(:2, k) = bodies%inverse_mass(s) + [across*across, along*along]*bodies%inverse_inertia(s)
         mobility(3:, k) = [along*across, 1.0_wp]*bodies%inverse_inertia(s)
         rolling = rolling + [1.0_wp/bodies%radius(s), &
                              1.0_wp/(bodies%inertia(s) + bodies%mass(s)*bodies%radius(s)**2)]
      end subroutine add_body

   end subroutine describe_contact

end module polydem_present_contact
