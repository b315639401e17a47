!> Places grains inside a convex outline. Every scene with falling grains uses it. The grains are loose on a lattice,
!> loose in cells of many sizes, or packed as in an earlier result.
module polydem_pour
   use polydem_body_list, only: body_list_t
   use polydem_cut_cells, only: fit_cells
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: append_grains, draw_grains, grains_t
   use polydem_kinds, only: ip, wp
   use polydem_lattice, only: fill_lattice
   use polydem_packing, only: pack_grains, rotate_with_walls
   use polydem_random, only: new_random, random_t
   use polydem_settings, only: motion_settings_t, scene_settings_t
   use polydem_start_velocities, only: draw_velocities
   use polydem_strings, only: to_text
   implicit none
   private
   public :: place_grains, container_entries, loose_spacing, loose_spacing_ratio, displace_randomly

   !> Distance of loose grains over the largest long axis of a grain
   real(wp), parameter :: loose_spacing_ratio = 1.02_wp

contains

   !> Append n free grains, from the bottom of the outline up, with random velocities.
   subroutine place_grains(list, scene, outline, n, error, motions)
      type(body_list_t), intent(inout) :: list
      !> Settings: grains, seed, speed, packing
      type(scene_settings_t), intent(in) :: scene
      !> Corners of the convex outline, anticlockwise, (2, corner) [m]; an upright rectangle if grains differ in size
      real(wp), intent(in) :: outline(:, :)
      !> Number of grains
      integer(ip), intent(in) :: n
      !> Allocated if the grains do not fit
      type(error_t), allocatable, intent(inout) :: error
      !> Motions of the walls, with which packed grains rotate from the start; default: none
      type(motion_settings_t), intent(in), optional :: motions(:)
      type(random_t) :: random
      type(grains_t) :: grains
      real(wp), allocatable :: centres(:, :), velocities(:, :), spins(:)

      allocate (centres(2, n))
      random = new_random(scene%seed)
      if (scene%packing /= '') then
         call pack_grains(scene, outline, grains, centres, error)
      else
         call pour_loosely(scene, outline, random, grains, centres, error)
      end if
      if (allocated(error)) return
      allocate (velocities(2, n), spins(n))
      call draw_velocities(random, scene%speed, velocities)
      spins = 0.0_wp
      if (scene%packing /= '' .and. present(motions)) call rotate_with_walls(motions, centres, velocities, spins)
      call append_grains(list, scene, grains, centres, velocities, spins)
   end subroutine place_grains

   !> Place loose grains from the bottom up: on a lattice, or in cells of an upright rectangle if they differ in size.
   subroutine pour_loosely(scene, outline, random, grains, centres, error)
      type(scene_settings_t), intent(in) :: scene
      real(wp), intent(in) :: outline(:, :)
      type(random_t), intent(inout) :: random
      type(grains_t), intent(out) :: grains
      real(wp), intent(out) :: centres(:, :)
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: spread
      integer(ip) :: n, n_found

      n = size(centres, 2, kind=ip)
      call draw_grains(scene, random, n, grains)
      if (scene%size_ratio > 1.0_wp) then
         call fit_cells(outline, loose_spacing_ratio*grains%length, random, centres, spread)
         if (.not. spread > 0.0_wp) call raise(error, input_error, 'the container has no room for grains of such '// &
            'different sizes; enlarge the container (width), or lower bodies or size_ratio')
         return
      end if
      call fill_lattice(outline, loose_spacing(scene), centres, n_found)
      if (n_found < n) then
         call raise(error, input_error, 'the container has room for '//to_text(n_found)//' loose grains, not for ' &
                    //to_text(n)//'; enlarge the container ('//container_entries(scene%name)// &
                    '), or lower bodies or long_axis_max')
         return
      end if
      call displace_randomly(random, loose_spacing(scene) - scene%long_axis_max, centres)
   end subroutine pour_loosely

   !> Entries of &scene that enlarge the container of a scene, for a message
   pure function container_entries(name) result(text)
      !> Name of the scene
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text

      select case (name)
      case ('drum')
         text = 'radius'
      case ('hopper')
         text = 'opening, width'
      case default
         text = 'width'
      end select
   end function container_entries

   !> Distance of the centres of loose grains on the lattice [m]
   pure real(wp) function loose_spacing(scene)
      !> Settings: axes of the grains
      type(scene_settings_t), intent(in) :: scene

      loose_spacing = loose_spacing_ratio*scene%long_axis_max
   end function loose_spacing

   !> Displace points at random. The distance of two points decreases by less than `play`.
   subroutine displace_randomly(random, play, centres)
      type(random_t), intent(inout) :: random
      !> Gap between neighbours [m]
      real(wp), intent(in) :: play
      !> Points, (2, point) [m]
      real(wp), intent(inout) :: centres(:, :)
      real(wp) :: most
      integer :: k

      ! The displacement of each point is less than sqrt(2) 0.35 play < play/2.
      most = 0.35_wp*play
      do k = 1, size(centres, 2)
         centres(1, k) = centres(1, k) + random%between(-most, most)
         centres(2, k) = centres(2, k) + random%between(-most, most)
      end do
   end subroutine displace_randomly

end module polydem_pour
