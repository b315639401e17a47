!> Median size of bodies.
module polydem_body_sizes
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: ip, wp
   use polydem_sort_reals, only: sort_reals
   implicit none
   private
   public :: median_of_diameters

contains

   !> Median diameter of the free bodies; huge if there are none [m]
   pure real(wp) function median_of_diameters(bodies)
      type(bodies_t), intent(in) :: bodies
      real(wp), allocatable :: length(:)
      integer(ip), allocatable :: ranked(:)
      integer(ip) :: n

      n = size(bodies%free, kind=ip)
      median_of_diameters = huge(1.0_wp)
      if (n == 0_ip) return
      allocate (ranked(n))
      length = bodies%diameter(bodies%free)
      call sort_reals(length, ranked)
      median_of_diameters = length(ranked((n + 1_ip)/2_ip))
   end function median_of_diameters

end module polydem_body_sizes
