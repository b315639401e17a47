!> Dense packings of grains in a box or in a drum. Each rank makes its share independently of the others.
!>
!> The grains are ellipses with axes 1 and 0.7 m at any angle, and cover 0.85 of the area. They lie on a triangular
!> lattice with small random shifts; shift and angle depend only on the index of the lattice site.
module packed_grains
   use polydem_hash, only: mix_word
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: pack_share, shape_names

   !> 'box': a square; 'drum': the lower half of a disc, tilted
   character(len=*), parameter :: shape_names(2) = [character(len=4) :: 'box', 'drum']

   real(wp), parameter :: pi = 3.14159265358979323846264338327950288_wp
   !> Half axes [m]
   real(wp), parameter :: long = 0.5_wp
   real(wp), parameter :: short = 0.35_wp
   !> Area of the packing per grain [m^2]
   real(wp), parameter :: room = pi*long*short/0.85_wp
   !> Tilt of the surface in the drum
   real(wp), parameter :: tilt = 25.0_wp*pi/180.0_wp

contains

   !> Make the grains of one rank: those on its share of the lattice sites.
   subroutine pack_share(shape, n, rank, n_ranks, grains)
      !> One of `shape_names`
      character(len=*), intent(in) :: shape
      !> Approximate number of grains of all ranks
      integer(ip), intent(in) :: n
      integer(ip), intent(in) :: rank, n_ranks
      !> Position and half sides of the box of each grain, (4, grain) [m]
      real(wp), allocatable, intent(out) :: grains(:, :)
      real(wp) :: side, spacing, place(2), angle
      integer(lp) :: k, first, last
      integer(ip) :: columns, rows, kept

      side = sqrt(real(n, wp)*room)
      if (shape == 'drum') side = 2.0_wp*sqrt(2.0_wp*real(n, wp)*room/pi)
      spacing = sqrt(room*2.0_wp/sqrt(3.0_wp))
      columns = int(side/spacing, ip) + 1_ip
      rows = int(side/(0.5_wp*sqrt(3.0_wp)*spacing), ip) + 1_ip
      first = int(columns, lp)*rows*rank/n_ranks
      last = int(columns, lp)*rows*(rank + 1_lp)/n_ranks - 1_lp
      allocate (grains(4, last - first + 1_lp))
      kept = 0_ip
      do k = first, last
         place(1) = (real(modulo(k, int(columns, lp)), wp) + 0.5_wp*real(modulo(k/columns, 2_lp), wp))*spacing
         place(2) = real(k/columns, wp)*0.5_wp*sqrt(3.0_wp)*spacing
         place = place - 0.5_wp*side + 0.3_wp*spacing*[chance(k, 1_lp) - 0.5_wp, chance(k, 2_lp) - 0.5_wp]
         if (shape == 'drum' .and. .not. in_drum(place, 0.5_wp*side)) cycle
         kept = kept + 1_ip
         angle = pi*chance(k, 3_lp)
         grains(1:2, kept) = place
         grains(3, kept) = hypot(long*cos(angle), short*sin(angle))
         grains(4, kept) = hypot(long*sin(angle), short*cos(angle))
      end do
      grains = grains(:, 1:kept)
   end subroutine pack_share

   pure logical function in_drum(place, radius)
      real(wp), intent(in) :: place(2), radius

      in_drum = hypot(place(1), place(2)) <= radius .and. place(2)*cos(tilt) <= place(1)*sin(tilt)
   end function in_drum

   !> Random number between 0 and 1 of a lattice site
   pure real(wp) function chance(place, which)
      integer(lp), intent(in) :: place, which

      chance = real(ishft(mix_word(mix_word(which, place), which), -40), wp)/2.0_wp**24
   end function chance

end module packed_grains
