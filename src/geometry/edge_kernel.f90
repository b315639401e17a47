!> Test of remembered separating edges, for all lanes of a batch at a time.
!>
!> A polygon is surely outside of an edge if the remembered corner is, and if both neighbours of this corner are surely
!> farther out: no corner of a convex polygon is nearer then.
!>
!> Loops over all lanes have no branches, so that the compiler handles several lanes at a time.
module polydem_edge_kernel
   use polydem_gather_corners, only: gather_corners, less, next
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: column_length, overlap_batch_t
   use polydem_overlap_tolerances, only: far, surely_apart
   use polydem_feature_cache, only: edge_bits
   implicit none
   private
   public :: find_separated, lead

   !> Number of vertices of a lane: start and end of the edge, the remembered corner, the one before, and the one behind
   integer(ip), parameter :: n_corners = 5_ip

contains

   !> Find the lanes whose polygons are surely apart.
   pure subroutine find_separated(batch, n, n_vertices, turned, sure)
      !> The batch: an edge is remembered in each lane
      type(overlap_batch_t), intent(in) :: batch
      !> Number of lanes
      integer(ip), intent(in) :: n
      !> Number of vertices in the array
      integer(ip), intent(in) :: n_vertices
      !> Vertices of all polygons, anticlockwise, each relative to its own centre [m]
      real(wp), intent(in) :: turned(2, n_vertices)
      !> Positive if the polygons of a lane are surely apart
      real(wp), intent(inout) :: sure(column_length)
      real(wp) :: vertex(column_length, 2, n_corners), of_q(column_length)
      integer(ip) :: place(column_length, n_corners)

      call unpack_edges(batch, n, place, of_q, sure)
      call gather_corners(n, n_corners, place, n_vertices, turned, vertex)
      call test_corners(batch, n, vertex, of_q, sure)
   end subroutine find_separated

   !> Find the vertices of the remembered edges and corners. These are whole numbers, and -1 is true, so that the
   !> compiler handles several lanes at a time.
   pure subroutine unpack_edges(batch, n, vertex, of_q, sure)
      type(overlap_batch_t), intent(in) :: batch
      integer(ip), intent(in) :: n
      !> Places of the vertices
      integer(ip), intent(inout) :: vertex(column_length, n_corners)
      !> 1 if the edge is one of Q, 0 if it is one of P
      real(wp), intent(inout) :: of_q(column_length)
      !> 1 if edge and corner exist, otherwise 0; the first ones are taken then
      real(wp), intent(inout) :: sure(column_length)
      integer(ip), parameter :: mask = 2_ip**edge_bits - 1_ip
      integer(ip) :: i, packed, edge, corner, start(2), corners(2), exchange, possible

      do i = 1_ip, n
         ! As in `unpack_edge`. If the edge is one of Q, P and Q change places.
         packed = not(batch%features(i))
         edge = iand(shiftr(packed, 1), mask)
         corner = iand(shiftr(packed, 1 + edge_bits), mask)
         of_q(i) = real(iand(packed, 1_ip), wp)
         exchange = iand(-iand(packed, 1_ip), ieor(batch%start(i, 1), batch%start(i, 2)))
         start(1) = ieor(batch%start(i, 1), exchange)
         start(2) = ieor(batch%start(i, 2), exchange)
         exchange = iand(-iand(packed, 1_ip), ieor(batch%corners(i, 1), batch%corners(i, 2)))
         corners(1) = ieor(batch%corners(i, 1), exchange)
         corners(2) = ieor(batch%corners(i, 2), exchange)
         possible = iand(less(edge, corners(1)), less(corner, corners(2)))
         sure(i) = real(iand(1_ip, possible), wp)
         edge = iand(edge, possible)
         corner = iand(corner, possible)
         vertex(i, 1) = start(1) + edge
         vertex(i, 2) = start(1) + next(edge, corners(1))
         vertex(i, 3) = start(2) + corner
         vertex(i, 4) = start(2) + corner - 1_ip + iand(less(corner, 1_ip), corners(2))
         vertex(i, 5) = start(2) + next(corner, corners(2))
      end do
   end subroutine unpack_edges

   !> Test the remembered corners: `sure` stays positive if the corner is near, outside of the edge, and nearer to its
   !> line than both its neighbours.
   pure subroutine test_corners(batch, n, vertex, of_q, sure)
      type(overlap_batch_t), intent(in) :: batch
      integer(ip), intent(in) :: n
      !> Vertices as in `unpack_edges`, (lane, x or y, vertex)
      real(wp), intent(in) :: vertex(column_length, 2, n_corners)
      !> 1 if the edge is one of Q, 0 if it is one of P
      real(wp), intent(in) :: of_q(column_length)
      real(wp), intent(inout) :: sure(column_length)
      real(wp) :: edge_x, edge_y, from_x, from_y, to_x, to_y, nearer
      integer(ip) :: i

      do i = 1_ip, n
         edge_x = vertex(i, 1, 2) - vertex(i, 1, 1)
         edge_y = vertex(i, 2, 2) - vertex(i, 2, 1)
         from_x = vertex(i, 1, 1) + of_q(i)*batch%offset(i, 1)
         from_y = vertex(i, 2, 1) + of_q(i)*batch%offset(i, 2)
         to_x = vertex(i, 1, 3) + (1.0_wp - of_q(i))*batch%offset(i, 1)
         to_y = vertex(i, 2, 3) + (1.0_wp - of_q(i))*batch%offset(i, 2)
         nearer = min(lead(edge_x, edge_y, vertex(i, 1, 3) - vertex(i, 1, 4), vertex(i, 2, 3) - vertex(i, 2, 4)), &
                      lead(edge_x, edge_y, vertex(i, 1, 3) - vertex(i, 1, 5), vertex(i, 2, 3) - vertex(i, 2, 5)))
         sure(i) = min(min(sure(i), nearer), &
                       min(far*batch%radius(i, 1) - max(max(abs(from_x), abs(from_y)), max(abs(to_x), abs(to_y))), &
                           -surely_apart*batch%radius(i, 1)*(abs(edge_x) + abs(edge_y)) &
                           - (edge_x*(to_y - from_y) - edge_y*(to_x - from_x))))
      end do
   end subroutine test_corners

   !> How much deeper below an edge one point is than another, beyond rounding errors: they are 4 u of each product at
   !> most
   elemental real(wp) function lead(edge_x, edge_y, x, y)
      !> The edge
      real(wp), intent(in) :: edge_x, edge_y
      !> The point minus the other
      real(wp), intent(in) :: x, y
      real(wp) :: plus, minus

      plus = edge_x*y
      minus = edge_y*x
      lead = plus - minus - 4.0_wp*epsilon(1.0_wp)*(abs(plus) + abs(minus))
   end function lead

end module polydem_edge_kernel
