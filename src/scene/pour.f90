!> Loose grains on a lattice inside a convex outline, which is how every scene with falling grains starts.
module polydem_pour
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: append_grains, draw_grains, grain_t
   use polydem_kinds, only: ip, wp
   use polydem_lattice, only: fill_lattice
   use polydem_random, only: new_random, random_t
   use polydem_settings, only: scene_settings_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: pour_grains, loose_spacing, shake, draw_velocities

   !> Distance of loose grains over the greatest diameter of a grain
   real(wp), parameter :: looseness = 1.02_wp

contains

   !> Append n free grains without overlaps, from the bottom of the outline up, with random velocities.
   subroutine pour_grains(list, scene, outline, n, error)
      !> List to extend
      type(body_list_t), intent(inout) :: list
      !> Grains, seed and speed
      type(scene_settings_t), intent(in) :: scene
      !> Corners of the convex outline, anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: outline(:, :)
      !> Number of grains
      integer(ip), intent(in) :: n
      !> If the grains do not fit
      type(error_t), allocatable, intent(inout) :: error
      type(random_t) :: random
      type(grain_t), allocatable :: grains(:)
      real(wp), allocatable :: centres(:, :), velocities(:, :)
      integer(ip) :: n_found

      allocate (grains(n), centres(2, n), velocities(2, n))
      call fill_lattice(outline, loose_spacing(scene), centres, n_found)
      if (n_found < n) then
         call raise(error, input_error, 'there is room for '//to_text(n_found)//' loose grains, not for ' &
                    //to_text(n)//': make the container larger or the grains fewer')
         return
      end if
      random = new_random(scene%seed)
      call draw_grains(scene, random, grains)
      call shake(random, loose_spacing(scene) - scene%long_axis_max, centres)
      call draw_velocities(random, scene%speed, velocities)
      call append_grains(list, grains, centres, velocities, scene%density)
   end subroutine pour_grains

   !> Distance of the centres of loose grains on the lattice [m]
   pure real(wp) function loose_spacing(scene)
      !> Axes of the grains
      type(scene_settings_t), intent(in) :: scene

      loose_spacing = looseness*scene%long_axis_max
   end function loose_spacing

   !> Displace points at random, so that the distance of two shrinks by less than the play between them.
   subroutine shake(random, play, centres)
      !> Stream of random numbers
      type(random_t), intent(inout) :: random
      !> Distance of neighbours that is not needed [m]
      real(wp), intent(in) :: play
      !> Points, (2, :) [m]
      real(wp), intent(inout) :: centres(:, :)
      real(wp) :: most
      integer :: k

      ! Each point moves by less than sqrt(2) 0.35 play < play/2.
      most = 0.35_wp*play
      do k = 1, size(centres, 2)
         centres(1, k) = centres(1, k) + random%between(-most, most)
         centres(2, k) = centres(2, k) + random%between(-most, most)
      end do
   end subroutine shake

   !> Draw velocities from a normal distribution.
   subroutine draw_velocities(random, speed, velocities)
      !> Stream of random numbers
      type(random_t), intent(inout) :: random
      !> Expected root of the mean square of the speed [m/s]
      real(wp), intent(in) :: speed
      !> Velocities, (2, :) [m/s]
      real(wp), intent(out) :: velocities(:, :)
      integer :: k

      do k = 1, size(velocities, 2)
         velocities(1, k) = sqrt(0.5_wp)*speed*random%normal()
         velocities(2, k) = sqrt(0.5_wp)*speed*random%normal()
      end do
   end subroutine draw_velocities

end module polydem_pour
