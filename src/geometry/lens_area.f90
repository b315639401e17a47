!> Area, its gradient, moments and centroid of lenses, for all lanes of a batch at a time.
module polydem_lens_area
   use polydem_kinds, only: ip, wp
   use polydem_lens_work, only: lens_work_t, placed
   use polydem_overlap_batch, only: column_length, overlap_columns_t
   use polydem_overlap_tolerances, only: no_length, sure_area
   implicit none
   private
   public :: integrate_area

   real(wp), parameter :: third = 1.0_wp/3.0_wp

   !> Integrals over arcs with the chord (lane, P or Q)
   type :: arcs_t
      !> Twice the area [m2]
      real(wp) :: area(column_length, 2)
      !> Six times the moments about its first crossing, (lane, x or y, P or Q) [m3]
      real(wp) :: moment(column_length, 2, 2)
   end type arcs_t

contains

   !> Area, its gradient, moments and centroid of all lenses.
   pure subroutine integrate_area(n, with_area, lens, columns)
      !> Number of lanes
      integer(ip), intent(in) :: n
      !> Whether the area is needed besides, with the moment about the centroid
      logical, intent(in) :: with_area
      !> The batch with crossings
      type(lens_work_t), intent(inout) :: lens
      !> Overlaps of these lanes
      type(overlap_columns_t), intent(inout) :: columns
      type(arcs_t) :: arcs
      real(wp) :: zx, zy, mx, my, twice, wx, wy, scale, about_centroid(column_length)
      integer(ip) :: i

      call find_arcs(n, lens, arcs)
      do i = 1_ip, n
         zx = lens%crossing(i, 1, 2) - lens%crossing(i, 1, 1)
         zy = lens%crossing(i, 2, 2) - lens%crossing(i, 2, 1)
         mx = 0.5_wp*(lens%crossing(i, 1, 1) + lens%crossing(i, 1, 2))
         my = 0.5_wp*(lens%crossing(i, 2, 1) + lens%crossing(i, 2, 2))
         twice = arcs%area(i, 1) + arcs%area(i, 2)
         wx = arcs%moment(i, 1, 1) + arcs%moment(i, 1, 2)
         wy = arcs%moment(i, 2, 1) + arcs%moment(i, 2, 2)
         scale = 1.0_wp/max(twice, sure_area*lens%radius(i, 1)*lens%radius(i, 1))
         wx = mx + scale*(0.5_wp*(arcs%area(i, 2) - arcs%area(i, 1))*zx + third*wx)
         wy = my + scale*(0.5_wp*(arcs%area(i, 2) - arcs%area(i, 1))*zy + third*wy)
         about_centroid(i) = -(zx*(mx - wx) + zy*(my - wy))
         columns%area(i) = 0.5_wp*twice
         columns%arm_first(i, 1) = wx - lens%centre(i, 1)
         columns%arm_first(i, 2) = wy - lens%centre(i, 2)
         columns%arm_second(i, 1) = wx - lens%centre(i, 3)
         columns%arm_second(i, 2) = wy - lens%centre(i, 4)
         columns%normal(i, 1) = zy
         columns%normal(i, 2) = -zx
         columns%length(i) = sqrt(zx*zx + zy*zy)
         columns%length_square(i) = 0.0_wp
         columns%moment(i, 1) = -(zx*(mx - lens%centre(i, 1)) + zy*(my - lens%centre(i, 2)))
         columns%moment(i, 2) = -(zx*(mx - lens%centre(i, 3)) + zy*(my - lens%centre(i, 4)))
         lens%certified(i) = min(lens%certified(i), &
                                  min(columns%area(i) - sure_area*lens%radius(i, 1)*lens%radius(i, 1), &
                                      zx*zx + zy*zy - 4.0_wp*no_length**2*columns%area(i)))
      end do
      if (.not. with_area) return
      columns%of_area(:n, 1:2) = columns%normal(:n, :)
      columns%of_area(:n, 3) = about_centroid(:n)
      columns%of_area(:n, 4) = columns%area(:n)
   end subroutine integrate_area

   !> Integrate over both arcs with the chord, each as a fan from its first crossing.
   pure subroutine find_arcs(n, lens, arcs)
      integer(ip), intent(in) :: n
      type(lens_work_t), intent(in) :: lens
      type(arcs_t), intent(inout) :: arcs
      complex(wp) :: p, q
      real(wp) :: zx, zy, vx, vy, part
      integer(ip) :: i

      do i = 1_ip, n
         zx = lens%crossing(i, 1, 2) - lens%crossing(i, 1, 1)
         zy = lens%crossing(i, 2, 2) - lens%crossing(i, 2, 1)
         p = placed(lens, i, 3, 1)
         q = placed(lens, i, 3, 2)
         vx = lens%some(i, 1)*(real(p, wp) - lens%crossing(i, 1, 1))
         vy = lens%some(i, 1)*(aimag(p) - lens%crossing(i, 2, 1))
         part = vx*zy - vy*zx
         arcs%area(i, 1) = part
         arcs%moment(i, 1, 1) = part*(vx + zx)
         arcs%moment(i, 2, 1) = part*(vy + zy)
         vx = lens%some(i, 2)*(real(q, wp) - lens%crossing(i, 1, 2))
         vy = lens%some(i, 2)*(aimag(q) - lens%crossing(i, 2, 2))
         part = vy*zx - vx*zy
         arcs%area(i, 2) = part
         arcs%moment(i, 1, 2) = part*(vx - zx)
         arcs%moment(i, 2, 2) = part*(vy - zy)
      end do
      call add_first_corners(lens, 1, arcs)
      call add_first_corners(lens, 2, arcs)
   end subroutine find_arcs

   !> Add the triangle of the first crossing and both corners to the arcs of the rare lanes. Where there is one corner,
   !> it is zero.
   pure subroutine add_first_corners(lens, body, arcs)
      type(lens_work_t), intent(in) :: lens
      integer, intent(in) :: body
      type(arcs_t), intent(inout) :: arcs
      complex(wp) :: p, q
      real(wp) :: v(2), w(2), part
      integer(ip) :: i, k

      do k = 1_ip, lens%n_rare
         i = lens%rare(k)
         p = placed(lens, i, 2, body)
         q = placed(lens, i, 3, body)
         v = lens%some(i, body)*([real(p, wp), aimag(p)] - lens%crossing(i, :, body))
         w = lens%some(i, body)*([real(q, wp), aimag(q)] - lens%crossing(i, :, body))
         part = v(1)*w(2) - v(2)*w(1)
         arcs%area(i, body) = part + arcs%area(i, body)
         arcs%moment(i, :, body) = part*(v + w) + arcs%moment(i, :, body)
      end do
   end subroutine add_first_corners

end module polydem_lens_area
