!> Two bodies in given poses and the elastic forces between them, without a time step.
module posed_pair
   use table_forces, only: evaluate_law
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_contact_history, only: contact_history_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_find_contacts, only: find_contacts
   use polydem_force_law, only: force_law_t
   use polydem_law_factory, only: new_force_law
   use polydem_force_sums, only: assemble_forces, force_sums_t
   use polydem_kinds, only: ip, wp
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: pair_t, new_pair, press, young

   !> Young's modulus of every pair [N/m2]
   real(wp), parameter :: young = 1.0e7_wp

   !> Two bodies and their contact
   type :: pair_t
      !> The bodies; poses and velocities may be changed before `press`
      type(bodies_t) :: bodies
      !> Their contact, if there is one
      type(contacts_t) :: contacts
      type(contact_history_t) :: history
      type(force_sums_t) :: sums
      type(force_law_t) :: law
   end type pair_t

contains

   !> Create two bodies from their polygons.
   subroutine new_pair(law, first, second, pair, cohesion)
      !> Entry `law` of &forces
      character(len=*), intent(in) :: law
      !> Corners of each body, (2, corner) [m]
      real(wp), intent(in) :: first(:, :), second(:, :)
      !> The pair
      type(pair_t), intent(out) :: pair
      !> Attraction per length of a contact, 0 if absent [N/m2]
      real(wp), intent(in), optional :: cohesion
      type(body_list_t) :: list
      type(forces_settings_t) :: settings
      type(error_t), allocatable :: error

      call list%append(first)
      call list%append(second)
      call new_bodies(list, pair%bodies, error)
      settings%stiffness = young
      settings%law = law
      settings%damping = 'none'
      settings%friction = 'none'
      if (present(cohesion)) settings%cohesion = cohesion
      call new_force_law(settings, pair%bodies, pair%law)
      pair%contacts%measure = pair%law%overlap_measure
      pair%contacts%has_cohesion = pair%law%needs_cohesion
   end subroutine new_pair

   !> Compute the forces and torques of the present poses.
   subroutine press(pair)
      !> The pair
      type(pair_t), intent(inout) :: pair

      call turn_bodies(pair%bodies, [1_ip, 2_ip])
      call find_contacts(pair%bodies, 1_ip, [1_ip], [2_ip], pair%history, pair%contacts)
      call evaluate_law(pair%law, pair%bodies, 0.0_wp, pair%contacts, pair%history)
      call assemble_forces([0.0_wp, 0.0_wp], pair%contacts, pair%bodies, pair%sums)
   end subroutine press

end module posed_pair
