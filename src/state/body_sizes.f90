!> Thickness and radius of bodies, measured from their centres of mass.
module polydem_body_sizes
   use polydem_bodies, only: bodies_t
   use polydem_elementary, only: hypotenuse
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: measure_body, thickness_of_bodies

contains

   !> Thickness and radius of one body.
   pure subroutine measure_body(bodies, s, thickness, radius)
      type(bodies_t), intent(in) :: bodies
      !> Slot
      integer(ip), intent(in) :: s
      !> Twice the least distance of an edge from the centre [m]
      real(wp), intent(out) :: thickness
      !> Greatest distance of a vertex from the centre [m]
      real(wp), intent(out) :: radius
      real(wp) :: edge(2)
      integer(ip) :: v, w

      thickness = huge(1.0_wp)
      radius = 0.0_wp
      w = bodies%vertex_start(s + 1_ip) - 1_ip
      associate (shape => bodies%shape)
         do v = bodies%vertex_start(s), bodies%vertex_start(s + 1_ip) - 1_ip
            edge = shape(:, v) - shape(:, w)
            thickness = min(thickness, &
                            2.0_wp*abs(edge(1)*shape(2, w) - edge(2)*shape(1, w))/hypotenuse(edge(1), edge(2)))
            radius = max(radius, hypotenuse(shape(1, v), shape(2, v)))
            w = v
         end do
      end associate
   end subroutine measure_body

   !> Thickness of every body [m], (slot)
   pure function thickness_of_bodies(bodies) result(thickness)
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: thickness(:)
      real(wp) :: radius
      integer(ip) :: s

      allocate (thickness(bodies%n))
      do s = 1_ip, bodies%n
         call measure_body(bodies, s, thickness(s), radius)
      end do
   end function thickness_of_bodies

end module polydem_body_sizes
