!> What one step leaves to the next about a pair of polygons, in one integer.
!>
!> A positive number is a *lens*: the outlines of P and Q cross twice, and the four edges that cross are known. A
!> negative number is an edge that separates the polygons, with the corner of the other polygon that is nearest to its
!> line. Zero is nothing. Edges and corners count from 0; edge k begins at corner k. Any integer is safe: the numbers
!> that it stands for are compared with the numbers of corners before they are used, and what they say is tested
!> before it is believed.
module polydem_feature_cache
   use polydem_kinds, only: ip
   implicit none
   private
   public :: lens_bits, edge_bits, most_lens_corners, packed_lens, packed_edge, unpack_edge

   !> Bits of the number of an edge of a lens, and of the number of a separating edge
   integer, parameter :: lens_bits = 7, edge_bits = 15
   !> Greatest number of corners of polygons whose lens can be remembered
   integer(ip), parameter :: most_lens_corners = 2_ip**lens_bits - 1_ip

contains

   !> Memory of a lens
   pure integer(ip) function packed_lens(edges)
      !> Edge of P that enters Q, edge of P that leaves it, edge of Q that enters P, edge of Q that leaves it, from the
      !> lowest bits upwards
      integer(ip), intent(in) :: edges(4)

      packed_lens = ior(ior(edges(1), ishft(edges(2), lens_bits)), &
                        ior(ishft(edges(3), 2*lens_bits), ishft(edges(4), 3*lens_bits)))
   end function packed_lens

   !> Memory of a separating edge, 0 if its number or that of the corner is too large
   pure integer(ip) function packed_edge(of_q, edge, corner)
      !> Whether the edge is one of Q
      logical, intent(in) :: of_q
      !> The edge, and the nearest corner of the other polygon
      integer(ip), intent(in) :: edge, corner

      packed_edge = 0_ip
      if (max(edge, corner) >= 2_ip**edge_bits) return
      packed_edge = not(ior(ior(merge(1_ip, 0_ip, of_q), ishft(edge, 1)), ishft(corner, 1 + edge_bits)))
   end function packed_edge

   !> The separating edge.
   pure subroutine unpack_edge(features, of_q, edge, corner)
      !> A negative number
      integer(ip), intent(in) :: features
      !> Whether the edge is one of Q
      logical, intent(out) :: of_q
      !> The edge, and the nearest corner of the other polygon
      integer(ip), intent(out) :: edge, corner

      of_q = .not. btest(features, 0)
      edge = ibits(not(features), 1, edge_bits)
      corner = ibits(not(features), 1 + edge_bits, edge_bits)
   end subroutine unpack_edge

end module polydem_feature_cache
