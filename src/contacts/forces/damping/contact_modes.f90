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
!> and the ratio of each mode is zeta w_k/w. Every dashpot acts on its own rate, so damping never adds energy, and the
!> force is 0 where nothing closes.
!>
!> K^+ = C S^+ C^T with S = C^T K C and Y = C C^T. Contacts whose normals are nearly parallel hardly hold the bodies
!> sideways. A mode with the share q of the greatest eigenvalue of S has the weight (1 + h^2) q^2/(q^2 + h^2) with
!> h = 3e-3 in K^+: it counts half if its frequency is a twentieth of the highest one. What rates are left beyond u,
!> these and those of walls with different motions, are damped by each contact for itself.
!>
!> The frequency is that of the present stiffness, which changes with the depth. For one contact of the conservative
!> law, damping by the present stiffness gives the restitution exactly. So it does for several, if k is the square of
!> their force over twice their energy. The springs have more where no rigid displacement d gives all elastic forces f_i
!> at once, k_i J_i d /= f_i, as for a corner on many pieces; hence the factor
!>
!>     r^2 = Q^T K^+ Q/sum_i(f_i^2/k_i) <= 1,     Q = sum_i f_i J_i^T.
module polydem_contact_modes
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: spring_t, spring_sums_t, modes_t, add_spring, joined_spring, find_modes, find_damping

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

   !> The modes of two bodies
   type :: modes_t
      !> K^+: motion over force, (3, 3)
      real(wp) :: compliance(3, 3) = 0.0_wp
      !> Mobility over frequency, C S^(-1/2) C^T, (3, 3)
      real(wp) :: mobility(3, 3) = 0.0_wp
      !> Relative motion u, of the springs; reciprocal frequency 1/w of this motion, 0 at rest
      real(wp) :: motion(3) = 0.0_wp, period = 0.0_wp
      !> The factor r
      real(wp) :: factor = 1.0_wp
   end type modes_t

   !> Square of the share h of the greatest eigenvalue at which a mode has half its weight
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

   !> Find the modes of two bodies.
   pure subroutine find_modes(mobility, sums, modes)
      !> Mobility Y of one of the contacts
      real(wp), intent(in) :: mobility(3, 3)
      !> Sums over at least one contact
      type(spring_sums_t), intent(in) :: sums
      type(modes_t), intent(out) :: modes
      real(wp) :: root(3, 3), axes(3, 3), square(3), outer(3, 3), share, force
      integer :: k

      ! Roots are of numbers whose units are squares, so that other units, times powers of two, change no bit.
      call find_root(mobility/mobility(1, 1), root)
      call diagonalise(matmul(transpose(root), matmul(sums%stiffness, root)), square, axes)
      do k = 1, 3
         share = square(k)/maxval(square)
         if (share <= epsilon(share)) cycle
         outer = (1.0_wp + half_weight)*share**2/(share**2 + half_weight)*outer_square(matmul(root, axes(:, k)))
         modes%mobility = modes%mobility + outer*mobility(1, 1)/sqrt(mobility(1, 1)*square(k))
         modes%compliance = modes%compliance + outer/square(k)
      end do
      modes%motion = matmul(modes%compliance, sums%impulse)
      force = dot_product(sums%impulse, matmul(mobility, sums%impulse))
      if (force > 0.0_wp) modes%period = sqrt(dot_product(sums%impulse, modes%motion)/force)
      if (sums%squares > 0.0_wp) modes%factor = sqrt(min(1.0_wp, &
         dot_product(sums%elastic, matmul(modes%compliance, sums%elastic))/sums%squares))
   end subroutine find_modes

   !> Find the damping of one contact: its force and its dashpot, both over 2 zeta.
   pure subroutine find_damping(spring, modes, force, dashpot)
      type(spring_t), intent(in) :: spring
      !> Modes of its two bodies
      type(modes_t), intent(in) :: modes
      !> The force [N/m]
      real(wp), intent(out) :: force
      !> The dashpot [N s/m2]
      real(wp), intent(out) :: dashpot
      real(wp) :: rigid

      associate (row => spring%row, k => modes%factor*spring%stiffness)
         rigid = dot_product(row, modes%motion)
         dashpot = k*dot_product(row, matmul(modes%mobility, row))/dot_product(row, matmul(spring%mobility, row))
         force = k*modes%period*rigid + dashpot*(spring%rate - rigid)
      end associate
   end subroutine find_damping

   !> The matrix a a^T
   pure function outer_square(a) result(matrix)
      real(wp), intent(in) :: a(3)
      real(wp) :: matrix(3, 3)

      matrix = spread(a, 2, 3)*spread(a, 1, 3)
   end function outer_square

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

   !> Find eigenvalues and eigenvectors of a symmetric matrix by Jacobi's rotations (Golub & Van Loan, Matrix
   !> Computations, 4th ed., Sec. 8.5).
   pure subroutine diagonalise(matrix, values, vectors)
      real(wp), intent(in) :: matrix(3, 3)
      !> Eigenvalues, and eigenvectors as columns
      real(wp), intent(out) :: values(3), vectors(3, 3)
      real(wp) :: a(3, 3), turn(3, 3), c, s, t, theta
      integer, parameter :: rows(3) = [1, 1, 2], columns(3) = [2, 3, 3]
      integer :: i, k, n, p, q

      a = matrix
      vectors = 0.0_wp
      do k = 1, 3
         vectors(k, k) = 1.0_wp
      end do
      sweeps: do n = 1, 8
         if (.not. maxval(abs([a(1, 2), a(1, 3), a(2, 3)])) > epsilon(a)**2*maxval(abs(a))) exit sweeps
         do k = 1, 3
            p = rows(k)
            q = columns(k)
            if (.not. abs(a(p, q)) > 0.0_wp) cycle
            theta = (a(q, q) - a(p, p))/(2.0_wp*a(p, q))
            t = sign(1.0_wp, theta)/(abs(theta) + sqrt(theta*theta + 1.0_wp))
            c = 1.0_wp/sqrt(t*t + 1.0_wp)
            s = t*c
            turn = 0.0_wp
            do i = 1, 3
               turn(i, i) = 1.0_wp
            end do
            turn(p, p) = c
            turn(q, q) = c
            turn(p, q) = s
            turn(q, p) = -s
            a = matmul(transpose(turn), matmul(a, turn))
            a(p, q) = 0.0_wp
            a(q, p) = 0.0_wp
            vectors = matmul(vectors, turn)
         end do
      end do sweeps
      values = [a(1, 1), a(2, 2), a(3, 3)]
   end subroutine diagonalise

end module polydem_contact_modes
