!> A batch of pairs of polygons whose outlines are expected to cross twice, for evaluation many at a time.
!>
!> In a pair, P is the polygon with the smaller radius and Q the other. The radius is the greatest distance of a
!> vertex from the centre of mass. A caller computes it once from the polygon before it turns, so roles do not change
!> with time. If the radii are equal, either may be P: the evaluation is symmetric.
module polydem_overlap_batch
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: lanes, column_length, overlap_batch_t, overlap_columns_t, add_lane

   !> Number of pairs in a batch
   integer(ip), parameter :: lanes = 64_ip
   !> Length of the columns. Columns of 64 numbers would begin at multiples of 512 bytes, and the cache would hold few
   !> of them at once
   integer(ip), parameter :: column_length = lanes + 8_ip

   !> Overlaps of a batch of pairs, one lane each. Its numbers are not initialised.
   type :: overlap_columns_t
      !> Area of the overlap, true or effective (see `polydem_overlap_measure`) [m2]
      real(wp) :: area(lanes)
      !> Integral of the outward normal of P over its outline inside Q, (lane, x or y), with the weight of the measure
      !> [m]. Without division by a length it is the gradient of the area
      real(wp) :: normal(lanes, 2)
      !> Moments of that integral about the centres of P and of Q, (lane, body) [m2]
      real(wp) :: moment(lanes, 2)
      !> Centroid of the overlap relative to the centre of each body, (lane, x or y) [m]
      real(wp) :: arm_first(lanes, 2), arm_second(lanes, 2)
      !> Length |normal| [m]
      real(wp) :: length(lanes)
      !> Square L^2 of the length of the overlap; 0 if the measure does not contain it [m2]
      real(wp) :: length_square(lanes)
      !> Gradient of the true area, (lane, x or y) [m], its moment about the centroid, and the true area [m2]; set only
      !> if the measure asks for it
      real(wp) :: of_area(lanes, 4)
   end type overlap_columns_t

   !> A batch of pairs, one lane each. Its numbers are not initialised. Last indices (2) are P and Q.
   type :: overlap_batch_t
      !> What is remembered, see `polydem_feature_cache`; any integer
      integer(ip) :: features(column_length)
      !> Places of the first vertices in the array of vertices that `evaluate_batch` gets
      integer(ip) :: start(column_length, 2)
      !> Numbers of vertices
      integer(ip) :: corners(column_length, 2)
      !> Centre of Q minus centre of P [m]
      real(wp) :: offset(column_length, 2)
      !> Radii, that of P not greater than that of Q [m]
      real(wp) :: radius(column_length, 2)

      !> Positive if the result is certified, which a memory without a lens of these polygons never is; the rest may
      !> not be read otherwise
      real(wp) :: certified(column_length)
   end type overlap_batch_t

contains

   !> Write a pair into a lane.
   pure subroutine add_lane(batch, lane, features, vertices, offset, radius_p, radius_q)
      type(overlap_batch_t), intent(inout) :: batch
      !> The lane, from 1
      integer(ip), intent(in) :: lane
      !> What is remembered
      integer(ip), intent(in) :: features
      !> Places of the first and the last vertex of P and of Q in the array of vertices that `evaluate_batch` gets
      integer(ip), intent(in) :: vertices(4)
      !> Centre of Q minus centre of P [m]
      real(wp), intent(in) :: offset(2)
      !> Radii of P and of Q, that of P not greater than that of Q [m]
      real(wp), intent(in) :: radius_p, radius_q

      batch%features(lane) = features
      batch%start(lane, :) = vertices([1, 3])
      batch%corners(lane, :) = vertices([2, 4]) - vertices([1, 3]) + 1_ip
      batch%offset(lane, :) = offset
      batch%radius(lane, :) = [radius_p, radius_q]
   end subroutine add_lane

end module polydem_overlap_batch
