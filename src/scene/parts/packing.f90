!> Fills a container with copies of a settled patch. A large scene then starts nearly at rest.
!>
!> The copies lie side by side and on top of each other. Only grains wholly inside the container are used, from the
!> lowest to the highest. Time and memory are proportional to the number of grains.
module polydem_packing
   use polydem_elementary, only: hypotenuse, pi
   use polydem_errors, only: error_t
   use polydem_grain_list, only: grain_t, grains_t
   use polydem_kinds, only: ip, wp
   use polydem_patch, only: patch_t, read_patch
   use polydem_settings, only: motion_settings_t
   implicit none
   private
   public :: pack_grains, fill_with_patch, rotate_with_walls

   !> Convex outline with the data for point-in-polygon tests
   type :: outline_t
      !> Corners, anticlockwise, (2, corner) [m]
      real(wp), allocatable :: corners(:, :)
      !> Outward unit normal of the edge that starts at each corner, (2, corner)
      real(wp), allocatable :: normals(:, :)
      !> Centre of the bounding box [m]
      real(wp) :: middle(2) = 0.0_wp
      !> Radius of the largest circle about that centre inside the outline [m]
      real(wp) :: radius = 0.0_wp
   end type outline_t

contains

   !> Read a packing and fill a container with its grains.
   subroutine pack_grains(packing, corners, grains, centres, n_found, error)
      !> Path of the packing
      character(len=*), intent(in) :: packing
      !> Corners of the container, convex, anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: corners(:, :)
      type(grains_t), intent(out) :: grains
      !> Centres of the grains, (2, grain) [m]; their number is given
      real(wp), intent(out) :: centres(:, :)
      !> Number of grains that fit; there are no grains unless all fit
      integer(ip), intent(out) :: n_found
      !> Allocated if the packing cannot be read
      type(error_t), allocatable, intent(inout) :: error
      type(patch_t) :: patch
      integer(ip), allocatable :: source(:)
      integer(ip) :: k, most, n

      n_found = 0_ip
      n = size(centres, 2, kind=ip)
      call read_patch(packing, patch, error)
      if (allocated(error)) return
      allocate (source(n))
      call fill_with_patch(corners, patch, centres, source, n_found)
      if (n_found < n) return
      most = 0_ip
      do k = 1_ip, size(patch%grains, kind=ip)
         most = max(most, size(patch%grains(k)%corners, 2, kind=ip))
      end do
      call grains%start(n, most)
      do k = 1_ip, n
         call grains%append(patch%grains(source(k)))
      end do
   end subroutine pack_grains

   !> Fill a container with copies of a patch, from the bottom up, until `centres` is full.
   pure subroutine fill_with_patch(corners, patch, centres, source, n_found)
      !> Corners of the container, convex, anticlockwise, (2, corner) [m]
      real(wp), intent(in) :: corners(:, :)
      !> Patch; its grains are ordered from the lowest to the highest
      type(patch_t), intent(in) :: patch
      !> Centres of the copied grains, (2, copy) [m]
      real(wp), intent(out) :: centres(:, :)
      !> Grain of the patch from which each grain is copied, (copy)
      integer(ip), intent(out) :: source(:)
      !> Number of copied grains; less than size(source) if the container is full
      integer(ip), intent(out) :: n_found
      type(outline_t) :: outline
      real(wp) :: place(2), origin(2)
      integer(ip) :: row, column, columns, k

      n_found = 0_ip
      outline = new_outline(corners)
      columns = ceiling((maxval(corners(1, :)) - minval(corners(1, :)))/patch%period(1), ip)
      origin = [outline%middle(1) - 0.5_wp*real(columns, wp)*patch%period(1), minval(corners(2, :))]
      row = 0_ip
      do while (origin(2) + real(row, wp)*patch%period(2) < maxval(corners(2, :)))
         do k = 1_ip, size(patch%grains, kind=ip)
            do column = 0_ip, columns - 1_ip
               if (n_found == size(source)) return
               place = origin + patch%centres(:, k) + real([column, row], wp)*patch%period
               if (.not. holds(outline, patch%grains(k), place)) cycle
               n_found = n_found + 1_ip
               centres(:, n_found) = place
               source(n_found) = k
            end do
         end do
         row = row + 1_ip
      end do
   end subroutine fill_with_patch

   !> If walls rotate from time 0 on, add the same rotation to the grains. Walls and grains then move as one rigid body,
   !> and their contacts do not change.
   pure subroutine rotate_with_walls(motions, wall, centres, velocities, spins)
      !> Prescribed motions of the walls
      type(motion_settings_t), intent(in) :: motions(:)
      !> Wall around the grains, whose motions alone count beside those of all fixed bodies; empty: all motions count
      character(len=*), intent(in) :: wall
      !> Centres of the grains, (2, grain) [m]
      real(wp), intent(in) :: centres(:, :)
      !> Velocities, (2, grain) [m/s]; the velocities of the rotation are added
      real(wp), intent(inout) :: velocities(:, :)
      !> Angular velocities, (grain) [rad/s]; the angular velocity of the rotation is added
      real(wp), intent(inout) :: spins(:)
      real(wp) :: rate
      integer :: k

      do k = 1, size(motions)
         associate (motion => motions(k))
            if (max(motion%start, motion%ramp) > 0.0_wp) cycle
            if (motion%stage /= '') cycle
            if (motion%wall /= '' .and. wall /= '' .and. motion%wall /= wall) cycle
            rate = 2.0_wp*pi*motion%rate
            velocities(1, :) = velocities(1, :) - rate*(centres(2, :) - motion%pivot(2))
            velocities(2, :) = velocities(2, :) + rate*(centres(1, :) - motion%pivot(1))
            spins = spins + rate
         end associate
      end do
   end subroutine rotate_with_walls

   !> Make an outline from its corners.
   pure function new_outline(corners) result(outline)
      real(wp), intent(in) :: corners(:, :)
      type(outline_t) :: outline
      real(wp) :: edge(2)
      integer :: k

      outline%corners = corners
      outline%middle = 0.5_wp*(minval(corners, 2) + maxval(corners, 2))
      outline%radius = huge(1.0_wp)
      allocate (outline%normals(2, size(corners, 2)))
      do k = 1, size(corners, 2)
         edge = corners(:, modulo(k, size(corners, 2)) + 1) - corners(:, k)
         outline%normals(:, k) = [edge(2), -edge(1)]/hypotenuse(edge(1), edge(2))
         outline%radius = min(outline%radius, outline%normals(1, k)*(corners(1, k) - outline%middle(1)) &
                              + outline%normals(2, k)*(corners(2, k) - outline%middle(2)))
      end do
   end function new_outline

   !> Whether a grain lies wholly inside an outline. The test with the circle is sufficient for nearly all grains
   pure logical function holds(outline, grain, place)
      type(outline_t), intent(in) :: outline
      type(grain_t), intent(in) :: grain
      real(wp), intent(in) :: place(2)
      real(wp) :: arm(2), reach
      integer :: k, v

      arm = place - outline%middle
      holds = hypotenuse(arm(1), arm(2)) + 0.5_wp*grain%length <= outline%radius
      if (holds) return
      do k = 1, size(outline%corners, 2)
         arm = place - outline%corners(:, k)
         reach = -huge(1.0_wp)
         do v = 1, size(grain%corners, 2)
            reach = max(reach, outline%normals(1, k)*(arm(1) + grain%corners(1, v)) &
                        + outline%normals(2, k)*(arm(2) + grain%corners(2, v)))
         end do
         if (reach > 0.0_wp) return
      end do
      holds = .true.
   end function holds

end module polydem_packing
