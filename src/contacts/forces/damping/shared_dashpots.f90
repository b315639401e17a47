!> Dashpots of all contacts between two bodies together, for one damping ratio of their relative motion.
!>
!> The relative motion of two bodies has three components u, velocities along x and y and an angular velocity. With the
!> mobility Y (3 x 3; the velocities that unit impulses give) and the stiffness K = sum_i k_i J_i^T J_i of contacts that
!> close at the rates v_i = J_i u, a mode of the undamped motion, Y K u = w^2 u, has the damping ratio zeta if every
!> contact has the dashpot 2 zeta k_i/w (damping in proportion to the stiffness: T.K. Caughey, J. Appl. Mech. 27 (1960)
!> 269). So the answer does not depend on how bodies are cut. A contact alone has 2 zeta sqrt(k/m') with the mobility
!> m' = J Y J^T of its point. For a motion of several modes, w is that of Rayleigh's quotient,
!>
!>     w^2 = g^T Y g/(u^T K u),     g = K u = sum_i k_i v_i J_i^T,     u = K^+ g,
!>
!> and the ratio of each mode is zeta w_k/w. The power of these forces is that of u on K, never negative.
!>
!> K^+ = C S^+ C^T with S = C^T K C and Y = C C^T. Contacts whose normals are nearly parallel hardly hold the bodies
!> sideways, so S^+ = (1 + h^2) (S^2 + h^2 tr(S)^2)^(-1) S with h = 3e-3: a mode counts half if its frequency is a
!> twentieth of the highest one. What rates are left beyond u, these and those of walls with different motions, are
!> damped by each contact for itself, with the frequency of the motion Y J^T that its force causes.
!>
!> The frequency is that of the present stiffness, which changes with the depth. For one contact of the conservative
!> law, damping by the present stiffness gives the restitution exactly. So it does for several, if k is the square of
!> their force over twice their energy. The springs have more where no rigid displacement d gives all elastic forces f_i
!> at once, k_i J_i d /= f_i, as for a corner on many pieces; hence the factor
!>
!>     r^2 = Q^T K^+ Q/sum_i(f_i^2/k_i) <= 1,     Q = sum_i f_i J_i^T.
module polydem_shared_dashpots
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: spring_t, spring_sums_t, relative_motion_t, add_spring, joined_spring, find_motion, find_damping

   !> One of several contacts between two bodies
   type :: spring_t
      !> Stiffness k [N/m2]; 0: there is no contact
      real(wp) :: stiffness = 0.0_wp
      !> Rate at which the contact closes [m/s]
      real(wp) :: rate = 0.0_wp
      !> Elastic force [N/m]
      real(wp) :: elastic = 0.0_wp
      !> Rate J per velocities along x and y [1] and angular velocity [m] of the first body relative to the second
      real(wp) :: row(3) = 0.0_wp
      !> Mobility Y of the two bodies for this motion, positive definite [m/kg, 1/kg, 1/(kg m)]
      real(wp) :: mobility(3, 3) = 0.0_wp
   end type spring_t

   !> Sums over the contacts of two bodies
   type :: spring_sums_t
      !> Number of contacts
      integer(ip) :: n = 0_ip
      !> Stiffness K, g and Q
      real(wp) :: stiffness(3, 3) = 0.0_wp, impulse(3) = 0.0_wp, elastic(3) = 0.0_wp
      !> Sum of the squares of elastic forces over stiffnesses, and sum of the elastic forces times the rates
      real(wp) :: squares = 0.0_wp, power = 0.0_wp
   end type spring_sums_t

   !> The relative motion of two bodies
   type :: relative_motion_t
      !> Motion u, of the springs; reciprocal frequency 1/w of this motion, 0 at rest
      real(wp) :: velocity(3) = 0.0_wp, period = 0.0_wp
      !> The factor r
      real(wp) :: factor = 1.0_wp
   end type relative_motion_t

   !> Square of h, the share of the greatest eigenvalue at which a mode has half its weight
   real(wp), parameter :: half_weight = 9.0e-6_wp

contains

   !> Add a contact to the sums of its bodies.
   pure subroutine add_spring(spring, sums)
      type(spring_t), intent(in) :: spring
      type(spring_sums_t), intent(inout) :: sums

      sums%n = sums%n + 1_ip
      sums%stiffness = sums%stiffness + spring%stiffness*outer_square(spring%row)
      sums%impulse = sums%impulse + spring%stiffness*spring%rate*spring%row
      sums%elastic = sums%elastic + spring%elastic*spring%row
      sums%squares = sums%squares + spring%elastic**2/spring%stiffness
      sums%power = sums%power + spring%elastic*spring%rate
   end subroutine add_spring

   !> Contacts that are one, with one energy: the spring of their force, whose stiffness is the square of the force over
   !> twice the energy. It has no stiffness if the forces cancel.
   pure function joined_spring(sums, mobility) result(spring)
      !> Sums over these contacts
      type(spring_sums_t), intent(in) :: sums
      !> Mobility Y of the two bodies
      real(wp), intent(in) :: mobility(3, 3)
      type(spring_t) :: spring

      spring%mobility = mobility
      spring%elastic = sqrt(sums%elastic(1)**2 + sums%elastic(2)**2)
      if (.not. spring%elastic > 0.0_wp) return
      spring%stiffness = spring%elastic**2/sums%squares
      spring%rate = sums%power/spring%elastic
      spring%row = sums%elastic/spring%elastic
   end function joined_spring

   !> Find the relative motion of two bodies.
   pure subroutine find_motion(mobility, sums, motion)
      !> Mobility Y of one of the contacts
      real(wp), intent(in) :: mobility(3, 3)
      !> Sums over at least one contact
      type(spring_sums_t), intent(in) :: sums
      type(relative_motion_t), intent(out) :: motion
      real(wp) :: root(3, 3), s(3, 3), b(3, 3), force
      integer :: i, j

      ! Roots are of numbers whose units are squares, so that other units, times powers of two, change no bit.
      call find_root(mobility/mobility(1, 1), root)
      do j = 1, 3
         b(:, j) = times(sums%stiffness, root(:, j))
      end do
      do j = 1, 3
         do i = 1, 3
            s(i, j) = dot(root(:, i), b(:, j))
         end do
      end do
      do j = 1, 3
         b(:, j) = times(s, s(:, j))
      end do
      force = half_weight*((s(1, 1) + s(2, 2)) + s(3, 3))**2
      do j = 1, 3
         b(j, j) = b(j, j) + force
      end do
      motion%velocity = springs_give(sums%impulse)
      force = form(sums%impulse, mobility, sums%impulse)
      if (force > 0.0_wp) motion%period = sqrt(max(0.0_wp, dot(sums%impulse, motion%velocity))/force)
      if (sums%squares > 0.0_wp) motion%factor = &
         sqrt(max(0.0_wp, min(1.0_wp, dot(sums%elastic, springs_give(sums%elastic))/sums%squares)))

   contains

      !> K^+ times a force
      pure function springs_give(along) result(motion)
         real(wp), intent(in) :: along(3)
         real(wp) :: motion(3), x(3)

         x = [dot(root(:, 1), along), dot(root(:, 2), along), dot(root(:, 3), along)]
         x = (1.0_wp + half_weight)*solution(b, times(s, x))
         motion = times(root, x)
      end function springs_give

   end subroutine find_motion

   !> Solution of a system of equations with a symmetric, positive definite matrix, by its cofactors
   pure function solution(a, b) result(x)
      real(wp), intent(in) :: a(3, 3), b(3)
      real(wp) :: x(3), cofactor(3, 3)

      cofactor(:, 1) = [a(2, 2)*a(3, 3) - a(2, 3)*a(2, 3), a(1, 3)*a(2, 3) - a(1, 2)*a(3, 3), &
                        a(1, 2)*a(2, 3) - a(1, 3)*a(2, 2)]
      cofactor(:, 2) = [cofactor(2, 1), a(1, 1)*a(3, 3) - a(1, 3)*a(1, 3), a(1, 2)*a(1, 3) - a(1, 1)*a(2, 3)]
      cofactor(:, 3) = [cofactor(3, 1), cofactor(3, 2), a(1, 1)*a(2, 2) - a(1, 2)*a(1, 2)]
      x = times(cofactor, b)/dot(a(:, 1), cofactor(:, 1))
   end function solution

   !> Find the damping of one contact: its force and its dashpot, both over 2 zeta.
   pure subroutine find_damping(spring, sums, motion, force, dashpot)
      type(spring_t), intent(in) :: spring
      !> Sums and motion of its two bodies
      type(spring_sums_t), intent(in) :: sums
      type(relative_motion_t), intent(in) :: motion
      !> The force [N/m]
      real(wp), intent(out) :: force
      !> The dashpot [N s/m2]
      real(wp), intent(out) :: dashpot
      real(wp) :: rigid, u(3), g(3)

      associate (row => spring%row, k => motion%factor*spring%stiffness)
         u = times(spring%mobility, row)
         g = times(sums%stiffness, u)
         rigid = dot(row, motion%velocity)
         dashpot = k*sqrt(dot(g, u)/form(g, spring%mobility, g))
         force = k*motion%period*rigid + dashpot*(spring%rate - rigid)
      end associate
   end subroutine find_damping

   !> The matrix a a^T
   pure function outer_square(a) result(matrix)
      real(wp), intent(in) :: a(3)
      real(wp) :: matrix(3, 3)
      integer :: j

      do j = 1, 3
         matrix(1, j) = a(1)*a(j)
         matrix(2, j) = a(2)*a(j)
         matrix(3, j) = a(3)*a(j)
      end do
   end function outer_square

   !> A matrix times a vector; the intrinsic function takes longer
   pure function times(matrix, a) result(b)
      real(wp), intent(in) :: matrix(3, 3), a(3)
      real(wp) :: b(3)

      b = (matrix(:, 1)*a(1) + matrix(:, 2)*a(2)) + matrix(:, 3)*a(3)
   end function times

   !> The product a^T b
   pure real(wp) function dot(a, b)
      real(wp), intent(in) :: a(3), b(3)

      dot = (a(1)*b(1) + a(2)*b(2)) + a(3)*b(3)
   end function dot

   !> The form a^T M b
   pure real(wp) function form(a, matrix, b)
      real(wp), intent(in) :: a(3), matrix(3, 3), b(3)

      form = dot(a, times(matrix, b))
   end function form

   !> Find the lower triangular root C of a positive definite matrix C C^T.
   pure subroutine find_root(matrix, root)
      real(wp), intent(in) :: matrix(3, 3)
      real(wp), intent(out) :: root(3, 3)
      integer :: i, j

      root = 0.0_wp
      do j = 1, 3
         root(j, j) = sqrt(matrix(j, j) - sum(root(j, :j - 1)**2))
         do i = j + 1, 3
            root(i, j) = (matrix(i, j) - sum(root(i, :j - 1)*root(j, :j - 1)))/root(j, j)
         end do
      end do
   end subroutine find_root

end module polydem_shared_dashpots
