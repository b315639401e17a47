!> Works of damping and friction on each body, of which the balance has the sums.
module polydem_body_works
   use polydem_bodies, only: bodies_t
   use polydem_body_contributions, only: add_walls
   use polydem_energy_balance, only: accumulate_all, energy_balance_t
   use polydem_force_sums, only: force_sums_t
   use polydem_kinds, only: ip, wp
   use polydem_wall_terms, only: wall_terms_t
   implicit none
   private
   public :: find_body_works

contains

   !> Find the works on all bodies of this rank since the start, or since a body entered. A free body has those of its
   !> contacts with fixed bodies, too; a contact between free bodies gives each of them what its own motion did. Their
   !> sums over all bodies, and those that have left, are `damping_work` and `friction_work` of the balance.
   subroutine find_body_works(sums, dt, gravity, forces, walls, bodies)
      !> Running sums of the balance
      type(energy_balance_t), intent(in) :: sums
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Sums of the forces on each body
      type(force_sums_t), intent(in) :: forces
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: walls
      !> Bodies at the end of a step; `work` is set
      type(bodies_t), intent(inout) :: bodies
      type(energy_balance_t) :: now

      ! The last rates have half their weight.
      now = sums
      if (sums%is_current) then
         call accumulate_all(now, -0.5_wp, gravity, bodies, forces)
         call add_walls(bodies, walls, -0.5_wp, 1_ip, bodies%n, now%power_sum, now%wall_sum)
      end if
      bodies%work = dt*now%power_sum(2:3, :)
   end subroutine find_body_works

end module polydem_body_works
