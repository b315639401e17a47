!> Vertices of polygons for loops over the lanes of a batch.
module polydem_gather_corners
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: column_length
   implicit none
   private
   public :: gather_corners, less, next

contains

   !> Copy the vertices that the lanes name, four lanes at a time: it is stores that take the time. A loop without
   !> arithmetic keeps the compiler from computing places with wide registers.
   pure subroutine gather_corners(n, n_corners, vertex, n_vertices, turned, corner)
      !> Number of lanes
      integer(ip), intent(in) :: n
      !> Number of vertices of each lane
      integer(ip), intent(in) :: n_corners
      !> Places of the vertices; three lanes behind the last one are written
      integer(ip), intent(inout) :: vertex(column_length, n_corners)
      !> Number of vertices in the array
      integer(ip), intent(in) :: n_vertices
      !> Vertices of all polygons [m]
      real(wp), intent(in) :: turned(2, n_vertices)
      !> The copies, (lane, x or y, vertex) [m]
      real(wp), intent(inout) :: corner(column_length, 2, n_corners)
      integer(ip) :: i, k

      do k = 1_ip, n_corners
         vertex(n + 1_ip:n + 3_ip, k) = vertex(n, k)
      end do
      do i = 1_ip, n, 4_ip
         do k = 1_ip, n_corners
            corner(i:i + 3, 1, k) = [turned(1, vertex(i, k)), turned(1, vertex(i + 1, k)), &
                                     turned(1, vertex(i + 2, k)), turned(1, vertex(i + 3, k))]
            corner(i:i + 3, 2, k) = [turned(2, vertex(i, k)), turned(2, vertex(i + 1, k)), &
                                     turned(2, vertex(i + 2, k)), turned(2, vertex(i + 3, k))]
         end do
      end do
   end subroutine gather_corners

   !> -1 if the first number is less than the second one, otherwise 0; their difference must not overflow
   elemental integer(ip) function less(a, b)
      !> The numbers
      integer(ip), intent(in) :: a, b

      less = shifta(a - b, 31)
   end function less

   !> Corner behind another of n, counted from 0
   elemental integer(ip) function next(corner, n)
      !> The corner, and their number
      integer(ip), intent(in) :: corner, n

      next = iand(corner + 1_ip, less(corner + 1_ip, n))
   end function next

end module polydem_gather_corners
