!> Normal damping for a given restitution: F = 2 zeta sqrt(m_eff k) v_n, where k = E L/l is the stiffness of the contact
!> as it is and v_n = (dA/dt)/L.
!>
!> A flat contact keeps its k, so it is a damped spring that is let go when its force vanishes (no attraction). Its
!> restitution depends on the damping ratio zeta alone (T. Schwager & T. Poeschel, Granular Matter 9 (2007) 465):
!>
!>     e = exp(-2 zeta acos(zeta)/sqrt(1 - zeta^2))       zeta < 1
!>     e = exp(-2 zeta acosh(zeta)/sqrt(zeta^2 - 1))      zeta > 1
!>
!> whatever the sizes and masses of the two bodies. With the conservative law every central contact has it: there
!> F = K A A' and k = K A'^2, A' = dA/dd, so that dv/dA is the same function of A and v whatever A(d). With the area
!> law contacts that are not flat have another restitution, but since k follows the depth it does not depend on the
!> speed either (Y. Tsuji, T. Tanaka & T. Ishida, Powder Technol. 71 (1992) 239). The effective mass is that of a
!> central impact; eccentric ones lose more.
module polydem_restitution_damping
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_memory_t
   use polydem_contacts, only: contacts_t
   use polydem_force_part, only: force_part_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   implicit none
   private
   public :: restitution_damping_t, restitution_of, damping_ratio_of

   !> Damping with one ratio for all contacts
   type, extends(force_part_t) :: restitution_damping_t
      !> Young's modulus in two dimensions E [N/m2]
      real(wp) :: stiffness
      !> Damping ratio zeta
      real(wp) :: ratio
   contains
      procedure :: add
   end type restitution_damping_t

contains

   !> Add the damping and limit the sum to repulsion.
   subroutine add(self, bodies, dt, contacts, memory)
      class(restitution_damping_t), intent(in) :: self
      !> Bodies, for their masses
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s] (not used)
      real(wp), intent(in) :: dt
      !> Contacts; `normal_force` changes
      type(contacts_t), intent(inout) :: contacts
      !> Memory of the pairs (not used)
      type(contact_memory_t), intent(inout) :: memory
      real(wp) :: mobility, reach, force
      integer(ip) :: c

      associate (unused_dt => dt, unused_memory => memory)
      end associate
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, bodies, contacts) private(c, mobility, reach, force)
      do c = 1_ip, contacts%n
         mobility = bodies%inverse_mass(contacts%first(c)) + bodies%inverse_mass(contacts%second(c))
         ! Bars that nearly cross turn without approach: L is not taken shorter than the side of a square of the area.
         reach = max(contacts%length(c), sqrt(contacts%area(c)))
         force = 2.0_wp*self%ratio*sqrt(self%stiffness/mobility)*sqrt(contacts%inverse_length(c)/reach)*contacts%rate(c)
         contacts%normal_force(c) = max(0.0_wp, contacts%normal_force(c) + force)
      end do
      !$omp end parallel do
   end subroutine add

   !> Restitution of a damped spring that is let go when its force vanishes
   elemental real(wp) function restitution_of(ratio) result(restitution)
      !> Damping ratio zeta, not negative
      real(wp), intent(in) :: ratio
      real(wp) :: root

      root = sqrt(abs((1.0_wp - ratio)*(1.0_wp + ratio)))
      if (ratio < 1.0_wp) then
         restitution = exp(-2.0_wp*ratio*atan2(root, ratio)/root)
      else if (ratio > 1.0_wp) then
         restitution = exp(-2.0_wp*ratio*log(ratio + root)/root)
      else
         restitution = exp(-2.0_wp)
      end if
   end function restitution_of

   !> Damping ratio with which a damped spring has a restitution; exactly 0 for 1
   elemental real(wp) function damping_ratio_of(restitution) result(ratio)
      !> Restitution, above 0, at most 1
      real(wp), intent(in) :: restitution
      real(wp) :: low, high
      integer :: k

      ratio = 0.0_wp
      if (restitution >= 1.0_wp) return
      low = 0.0_wp
      high = 1.0_wp/sqrt(restitution)
      do k = 1, digits(ratio) + 8
         ratio = 0.5_wp*(low + high)
         if (restitution_of(ratio) > restitution) then
            low = ratio
         else
            high = ratio
         end if
      end do
   end function damping_ratio_of

end module polydem_restitution_damping
