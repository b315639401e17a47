!> Work space of the kernel for lenses: what its steps pass on, for all lanes of a batch.
!>
!> It is a local variable of the kernel, so that the compiler aligns it for the registers of the processor.
module polydem_lens_work
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: column_length
   implicit none
   private
   public :: lens_work_t, centre_of, cross, edge, from_centre, placed

   !> Work space, one lane for each pair. Its numbers are not initialised. Last indices (2) are P and Q, (4) x and y of
   !> P and of Q.
   type :: lens_work_t
      !> Places in the array of vertices: start and end of the edge of P that enters Q, of the edge of P that leaves it,
      !> of the edge of Q that enters P, of the edge of Q that leaves it
      integer(ip) :: vertex(column_length, 8)
      !> 1 if there is such a lens, otherwise 0
      integer(ip) :: possible(column_length)
      !> Number of corners inside the other polygon
      integer(ip) :: inner(column_length, 2)
      !> 1 if there are some, otherwise 0
      real(wp) :: some(column_length, 2)
      !> Number of lanes with two corners of a body inside the other or with far vertices, and those lanes
      integer(ip) :: n_rare, rare(column_length)
      !> Radii [m]
      real(wp) :: radius(column_length, 2)
      !> 1 if the radii are equal, otherwise 0
      real(wp) :: equal(column_length)
      !> Centres. The origin is that of P or, if the radii are equal, half-way between the centres [m]
      real(wp) :: centre(column_length, 4)
      !> The vertices, (lane, x or y, vertex, P or Q) [m]
      real(wp) :: corner(column_length, 2, 4, 2)
      !> Where P enters Q and where Q enters P, (lane, x or y, crossing) [m]
      real(wp) :: crossing(column_length, 2, 2)
      !> Positive as long as no test has failed
      real(wp) :: certified(column_length)
   end type lens_work_t

contains

   !> Centre of a polygon
   pure complex(wp) function centre_of(lens, lane, body)
      !> The batch
      type(lens_work_t), intent(in) :: lens
      !> The lane
      integer(ip), intent(in) :: lane
      !> 1 for P, 2 for Q
      integer, intent(in) :: body

      centre_of = cmplx(lens%centre(lane, 2*body - 1), lens%centre(lane, 2*body), wp)
   end function centre_of

   !> A vertex of a polygon
   pure complex(wp) function placed(lens, lane, k, body)
      !> The batch
      type(lens_work_t), intent(in) :: lens
      !> The lane
      integer(ip), intent(in) :: lane
      !> Vertex, 1 to 4; body, 1 for P, 2 for Q
      integer, intent(in) :: k, body

      placed = cmplx(lens%corner(lane, 1, k, body) + lens%centre(lane, 2*body - 1), &
                     lens%corner(lane, 2, k, body) + lens%centre(lane, 2*body), wp)
   end function placed

   !> A vertex of a polygon relative to its centre
   pure complex(wp) function from_centre(lens, lane, k, body)
      !> The batch
      type(lens_work_t), intent(in) :: lens
      !> The lane
      integer(ip), intent(in) :: lane
      !> Vertex, 1 to 4; body, 1 for P, 2 for Q
      integer, intent(in) :: k, body

      from_centre = cmplx(lens%corner(lane, 1, k, body), lens%corner(lane, 2, k, body), wp)
   end function from_centre

   !> Difference of two successive vertices
   pure complex(wp) function edge(lens, lane, k, body)
      !> The batch
      type(lens_work_t), intent(in) :: lens
      !> The lane
      integer(ip), intent(in) :: lane
      !> Vertex, 1 to 4; body, 1 for P, 2 for Q
      integer, intent(in) :: k, body

      edge = from_centre(lens, lane, k + 1, body) - from_centre(lens, lane, k, body)
   end function edge

   !> Cross product of two vectors
   pure real(wp) function cross(a, b)
      !> The vectors
      complex(wp), intent(in) :: a, b

      cross = real(a, wp)*aimag(b) - aimag(a)*real(b, wp)
   end function cross

end module polydem_lens_work
