!> Distinguishable bodies, for tests of packing and migration.
module some_bodies
   use polydem_bodies, only: bodies_t
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: make_bodies

contains

   !> Triangles and squares in a row, the fourth fixed; identifier 10 k, side k.
   subroutine make_bodies(n, bodies)
      integer(ip), intent(in) :: n
      type(bodies_t), intent(out) :: bodies
      type(body_list_t) :: list
      type(error_t), allocatable :: error
      real(wp) :: corners(2, 4), side
      integer(ip) :: k, last

      do k = 1_ip, n
         side = real(k, wp)
         corners = side*reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 0.0_wp, 1.0_wp], [2, 4])
         corners(1, :) = corners(1, :) + 2.0_wp*side*side
         last = 3_ip + modulo(k, 2_ip)
         if (k == 4_ip) call list%append(corners(:, :last), fixed=.true., id=10_ip*k)
         if (k /= 4_ip) call list%append(corners(:, :last), velocity=[side, -side], angular_velocity=0.5_wp*side, &
                                         id=10_ip*k)
      end do
      call new_bodies(list, bodies, error)
   end subroutine make_bodies

end module some_bodies
