!> Work space of the kernel for lenses: what its steps pass on, for all lanes of a batch.
!>
!> It is a local variable of the kernel, so that the compiler aligns it for the registers of the processor.
module polydem_lens_work
   use polydem_kinds, only: ip, wp
   use polydem_overlap_batch, only: column_length
   implicit none
   private
   public :: lens_work_t

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
      !> 1 if there are two, otherwise 0
      real(wp) :: two(column_length, 2)
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

end module polydem_lens_work
