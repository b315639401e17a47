!> Speed of a wave of falling dominoes in the theory of rigid bodies.
!>
!> The assumptions are those of J.M.J. van Leeuwen, Am. J. Phys. 78 (2010) 721. Dominoes turn about their lower right
!> corners, which do not slip. After a collision the two dominoes stay in contact (plastic collisions). An upper corner
!> slides down the face of the next domino with friction mu. The equations are derived below, and the steady state is
!> found by integration.
!>
!> With the angle t of a domino, t' of the domino behind it, D = t' - t, height h, thickness d, gap s:
!>
!>     (s + d) cos(t) - h sin(D) = d                 the corner lies on the face
!>     w = dt'/dt = 1 - (s + d) sin(t)/(h cos(D))    ratio of the rate of the rear to that of the front domino
!>     a = h cos(D) - (s + d) sin(t) - mu d          torque on the front domino per normal force
!>     b = h (cos(D) + mu sin(D))                    torque on the rear domino per normal force
!>     G = m g (h sin(t) - d cos(t))/2               torque of gravity; J = m (h^2 + d^2)/3
!>
!> Each domino obeys J t'' = G + (force from behind) a - (force from the front) b, and all t'' follow from that of the
!> head of the train. A collision obeys the same equation for impulses and changes of rates, with G = 0. The head hits
!> the next domino at sin(t) = s/h.
module domino_train
   use polydem_kinds, only: wp
   implicit none
   private
   public :: domino_t, wave_speed

   !> A row of dominoes
   type :: domino_t
      !> Height [m]
      real(wp) :: height = 0.0_wp
      !> Thickness [m]
      real(wp) :: thickness = 0.0_wp
      !> Gap between two [m]
      real(wp) :: gap = 0.0_wp
      !> Friction coefficient of two dominoes
      real(wp) :: friction = 0.0_wp
      !> Acceleration of gravity [m/s2]
      real(wp) :: gravity = 0.0_wp
   end type domino_t

   !> Number of moving dominoes in the train; those behind are at rest
   integer, parameter :: n_followed = 16

contains

   !> Speed of the wave after many dominoes [m/s].
   pure real(wp) function wave_speed(row)
      !> The row
      type(domino_t), intent(in) :: row
      real(wp) :: rate, duration
      integer :: k, n

      rate = sqrt(row%gravity/row%height)
      duration = 1.0_wp
      do k = 1, 60
         n = min(k, n_followed)
         call fall(row, n, rate, duration)
         call collide(row, n, rate)
      end do
      wave_speed = (row%gap + row%thickness)/duration
   end function wave_speed

   !> Integrate from one collision to the next with fourth-order Runge-Kutta: the head falls from 0 to asin(s/h).
   pure subroutine fall(row, n, rate, duration)
      type(domino_t), intent(in) :: row
      integer, intent(in) :: n
      real(wp), intent(inout) :: rate
      real(wp), intent(out) :: duration
      real(wp) :: h, last, y(2), k1(2), k2(2), k3(2), k4(2), former(2)

      last = asin(row%gap/row%height)
      h = 1.0e-3_wp*sqrt(row%height/row%gravity)
      y = [0.0_wp, rate]
      former = y
      duration = 0.0_wp
      do while (y(1) < last .and. duration < 1.0e5_wp*h)
         former = y
         k1 = slope(y)
         k2 = slope(y + 0.5_wp*h*k1)
         k3 = slope(y + 0.5_wp*h*k2)
         k4 = slope(y + h*k3)
         y = y + h/6.0_wp*(k1 + 2.0_wp*k2 + 2.0_wp*k3 + k4)
         duration = duration + h
      end do
      associate (share => (last - former(1))/(y(1) - former(1)))
         duration = duration - (1.0_wp - share)*h
         rate = former(2) + share*(y(2) - former(2))
      end associate

   contains

      pure function slope(state) result(change)
         real(wp), intent(in) :: state(2)
         real(wp) :: change(2)
         real(wp) :: t(0:n - 1), w(n - 1), curve(n - 1), a(n - 1), b(n - 1)

         call lean(row, state(1), t, w, curve, a, b)
         change = [state(2), acceleration(row, state(2), t, w, curve, a, b)]
      end function slope

   end subroutine fall

   !> Compute the angles of the train from the head (0) on, and for each pair w, its derivative dw/dt, a and b.
   pure subroutine lean(row, head, t, w, curve, a, b)
      type(domino_t), intent(in) :: row
      real(wp), intent(in) :: head
      real(wp), intent(out) :: t(0:), w(:), curve(:), a(:), b(:)
      real(wp) :: pitch, difference
      integer :: k

      pitch = row%gap + row%thickness
      t(0) = head
      do k = 1, size(w)
         associate (angle => t(k - 1))
            difference = asin((pitch*cos(angle) - row%thickness)/row%height)
            t(k) = angle + difference
            w(k) = 1.0_wp - pitch*sin(angle)/(row%height*cos(difference))
            ! dD/dt = w - 1
            curve(k) = -pitch/row%height*(cos(angle)/cos(difference) &
                                          + sin(angle)*sin(difference)/cos(difference)**2*(w(k) - 1.0_wp))
            a(k) = row%height*cos(difference) - pitch*sin(angle) - row%friction*row%thickness
            b(k) = row%height*(cos(difference) + row%friction*sin(difference))
         end associate
      end do
   end subroutine lean

   !> Angular acceleration of the head [1/s2]. Each quantity q is linear in it: q(1) times it plus q(2)
   pure real(wp) function acceleration(row, rate, t, w, curve, a, b)
      type(domino_t), intent(in) :: row
      real(wp), intent(in) :: rate, t(0:), w(:), curve(:), a(:), b(:)
      real(wp) :: alpha(2, 0:size(w)), rates(0:size(w)), force(2), total(2)
      integer :: k

      alpha(:, 0) = [1.0_wp, 0.0_wp]
      rates(0) = rate
      do k = 1, size(w)
         alpha(:, k) = w(k)*alpha(:, k - 1)
         alpha(2, k) = alpha(2, k) + curve(k)*rates(k - 1)**2
         rates(k) = w(k)*rates(k - 1)
      end do
      force = 0.0_wp
      do k = size(w), 1, -1
         total = -inertia(row)*alpha(:, k)
         total(2) = total(2) + torque(row, t(k))
         if (k < size(w)) total = total + force*a(k + 1)
         force = total/b(k)
      end do
      total = -inertia(row)*alpha(:, 0)
      total(2) = total(2) + torque(row, t(0))
      if (size(w) > 0) total = total + force*a(1)
      acceleration = -total(2)/total(1)
   end function acceleration

   !> Let the head hit the next domino, which becomes the head, and compute its rate.
   pure subroutine collide(row, n, rate)
      type(domino_t), intent(in) :: row
      integer, intent(in) :: n
      real(wp), intent(inout) :: rate
      real(wp) :: t(0:n), w(n), curve(n), a(n), b(n), impulse(2), before(0:n), after(0:n)
      integer :: k

      call lean(row, 0.0_wp, t, w, curve, a, b)
      before(0) = 0.0_wp
      before(1) = rate
      after(0) = 1.0_wp
      do k = 1, n
         if (k > 1) before(k) = w(k)*before(k - 1)
         after(k) = w(k)*after(k - 1)
      end do
      impulse = 0.0_wp
      do k = n, 1, -1
         impulse = [-after(k), before(k)] + impulse*merge(a(min(k + 1, n)), 0.0_wp, k < n)
         impulse = impulse/b(k)
      end do
      ! The new head: J times its rate is the impulse from behind times a.
      rate = impulse(2)*a(1)/(1.0_wp - impulse(1)*a(1))
   end subroutine collide

   !> Moment of inertia about a lower corner, per mass [m2]
   pure real(wp) function inertia(row)
      type(domino_t), intent(in) :: row

      inertia = (row%height**2 + row%thickness**2)/3.0_wp
   end function inertia

   !> Torque of gravity about the lower right corner, per mass [m2/s2]
   pure real(wp) function torque(row, angle)
      type(domino_t), intent(in) :: row
      real(wp), intent(in) :: angle

      torque = 0.5_wp*row%gravity*(row%height*sin(angle) - row%thickness*cos(angle))
   end function torque

end module domino_train
