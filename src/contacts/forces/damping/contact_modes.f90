!> Dashpots of all contacts between two bodies together, from the modes of their relative motion.
!>
!> The relative motion of two bodies has three components u, velocities along x and y and an angular velocity. With the
!> mobility Y (3 x 3; the velocities that unit impulses give) and the stiffness K = sum_i k_i J_i^T J_i of contacts that
!> close at the rates J_i u, the modes of the undamped motion have the frequencies w^2 = eigenvalues of Y K. Damping
!> with the ratio zeta in each mode is the force 2 zeta D u with
!>
!>     D = Y^(-1) (Y K)^(1/2) = K X K,     X = C S^(-3/2) C^T,     S = C^T K C,     Y = C C^T
!>
!> (on damping that keeps the modes T.K. Caughey, J. Appl. Mech. 27 (1960) 269). K u is the sum g of k_j J_j^T times the
!> rate at which contact j closes. So the force of contact i is 2 zeta k_i J_i X g, and the sum over contacts is exact, however the bodies
!> are cut. A contact alone gets 2 zeta sqrt(k/m') with the mobility m' = J Y J^T of the contact point.
!>
!> Powers of S are those of its positive eigenvalues. Contacts whose normals are nearly parallel hardly hold the bodies
!> sideways; such a mode could only be damped by great normal forces of both signs. A mode with the share q of the
!> greatest eigenvalue therefore has the weight (1 + h^2) q^2/(q^2 + h^2) with h = 3e-3: 1/2 if its frequency is a
!> twentieth of the highest one.
module polydem_contact_modes
   use polydem_kinds, only: wp
   implicit none
   private
   public :: modes_t, find_modes

   !> What the modes of two bodies make of forces and motions; symmetric, (3, 3)
   type :: modes_t
      !> X: velocities over stiffness and frequency, of the damping
      real(wp) :: damping(3, 3) = 0.0_wp
      !> C S^(-1) C^T: motion over force, of the springs
      real(wp) :: compliance(3, 3) = 0.0_wp
      !> C S^(-1/2) C^T: mobility over frequency
      real(wp) :: mobility(3, 3) = 0.0_wp
   end type modes_t

   !> Square of the share h of the greatest eigenvalue at which a mode has half its weight
   real(wp), parameter :: half_weight = 9.0e-6_wp

contains

   !> Find the modes of the relative motion of two bodies.
   pure subroutine find_modes(mobility, stiffness, modes)
      !> Mobility Y, positive definite, and stiffness K, not zero, both symmetric, (3, 3), in consistent units
      real(wp), intent(in) :: mobility(3, 3), stiffness(3, 3)
      type(modes_t), intent(out) :: modes
      real(wp) :: root(3, 3), axes(3, 3), square(3), axis(3), outer(3, 3), share
      integer :: k

      call find_root(mobility, root)
      call diagonalise(matmul(transpose(root), matmul(stiffness, root)), square, axes)
      do k = 1, 3
         share = square(k)/maxval(square)
         if (share <= epsilon(share)) cycle
         axis = matmul(root, axes(:, k))
         outer = spread(axis, 2, 3)*spread(axis, 1, 3)*((1.0_wp + half_weight)*share**2/(share**2 + half_weight))
         modes%mobility = modes%mobility + outer/sqrt(square(k))
         modes%compliance = modes%compliance + outer/square(k)
         modes%damping = modes%damping + outer/(square(k)*sqrt(square(k)))
      end do
   end subroutine find_modes

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
