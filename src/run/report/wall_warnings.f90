!> Warnings about walls that the namelist probably places or loads otherwise than meant: walls that are pulled away,
!> rows that leave a gap at the border of a periodic cell, and walls outside it.
module polydem_wall_warnings
   use polydem_driven, only: along_angle
   use polydem_kinds, only: wp
   use polydem_scene_measures, only: scene_measures_t
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: text_t, to_text
   implicit none
   private
   public :: add, warn_of_copies, warn_of_pulls, warn_of_rows

   !> Relative length of rounding errors
   real(wp), parameter :: rounding = 1.0e-9_wp

contains

   !> Warn of loads that pull their walls away from all free bodies. Bodies of sources may be anywhere, and a wall comes
   !> back to them along an axis that repeats.
   subroutine warn_of_pulls(simulation, measures, warnings)
      type(simulation_t), intent(in) :: simulation
      type(scene_measures_t), intent(in) :: measures
      !> The warnings so far
      type(text_t), allocatable, intent(inout) :: warnings(:)
      character(len=:), allocatable :: key, sense
      real(wp) :: extent(2), pull, slack, free(2)
      integer :: k

      if (.not. allocated(simulation%walls%loads) .or. size(simulation%settings%source) > 0) return
      do k = 1, size(simulation%walls%loads)
         associate (load => simulation%walls%loads(k), given => simulation%settings%load(k), &
                    cell => simulation%bodies%cell)
            if (load%has_weight) cycle
            pull = load%force + load%stress
            if (load%direction == along_angle) then
               if (cell%is_periodic .or. .not. measures%sides(3, k) > 0.0_wp) cycle
               extent = 0.5_wp*measures%sides(3, k)*[-1.0_wp, 1.0_wp]
               free = measures%sides(1:2, k)
            else
               if (cell%size(load%direction) > 0.0_wp) cycle
               extent = simulation%walls%wall(load%wall)%extent(load%direction, simulation%bodies)
               free = measures%free_extent(load%direction, :)
            end if
            ! Bodies reach into a row of grains, but not beyond the middle of the wall.
            slack = 0.5_wp*min(extent(2) - extent(1), measures%diameter(2))
            if (.not. (pull > 0.0_wp .and. extent(1) > free(2) - slack) .and. &
                .not. (pull < 0.0_wp .and. extent(2) < free(1) + slack)) cycle
            key = 'force'
            if (abs(load%stress) > 0.0_wp) key = 'stress'
            sense = 'acts along '//given%direction//', a negative one against it'
            if (load%direction == along_angle) then
               key = 'torque'
               sense = 'turns anticlockwise, a negative one clockwise'
            end if
            call add(warnings, place_of(simulation%settings, 'load.'//load%name, key)//': '''//key//''' in &load '// &
                     load%name//' pulls the wall '//given%wall//' away from all free bodies. A positive value '// &
                     sense//'; change the sign')
         end associate
      end do
   end subroutine warn_of_pulls

   !> Warn of rows of fixed grains that leave a gap at the border of a periodic cell.
   subroutine warn_of_rows(settings, warnings)
      type(settings_t), intent(in) :: settings
      !> The warnings so far
      type(text_t), allocatable, intent(inout) :: warnings(:)
      real(wp) :: length(2), gap
      integer :: axis, k

      do k = 1, size(settings%wall)
         associate (wall => settings%wall(k))
            if (wall%outline /= 'row') cycle
            length = abs(wall%to - wall%from)
            do axis = 1, 2
               if (scan(settings%cell%periodic, 'xy'(axis:axis)) == 0 .or. length(axis) < 3.0_wp*length(3 - axis)) cycle
               gap = settings%cell%size(axis) - length(axis)
               if (gap <= length(axis)/real(wall%segments, wp)) cycle
               call add(warnings, place_of(settings, 'wall.'//wall%name, 'to')//': the row of &wall '//wall%name// &
                        ' is '//to_text(length(axis), 3)//' m long, the cell '//to_text(settings%cell%size(axis), 3)// &
                        ' m: grains pass through the gap of '//to_text(gap, 3)//' m. Let ''from'' and ''to'' be as '// &
                        'far apart as the cell is long')
            end do
         end associate
      end do
   end subroutine warn_of_rows

   !> Warn of walls that stand outside a periodic cell: their copies stand in it, mostly among grains.
   subroutine warn_of_copies(settings, warnings)
      type(settings_t), intent(in) :: settings
      !> The warnings so far
      type(text_t), allocatable, intent(inout) :: warnings(:)
      real(wp) :: low(2), high(2)
      integer :: axis, k

      do k = 1, size(settings%wall)
         associate (wall => settings%wall(k), cell => settings%cell)
            select case (wall%outline)
            case ('rectangle')
               low = wall%low
               high = wall%high
            case ('line')
               low = min(wall%from, wall%to)
               high = max(wall%from, wall%to)
            case default
               cycle
            end select
            do axis = 1, 2
               if (scan(cell%periodic, 'xy'(axis:axis)) == 0) cycle
               if (low(axis) < (cell%low(axis) + cell%size(axis))*(1.0_wp - rounding) .and. &
                   high(axis) > cell%low(axis)*(1.0_wp + rounding)) cycle
               call add(warnings, place_of(settings, 'wall.'//wall%name, 'name')//': &wall '//wall%name//' stands '// &
                        'outside the cell along '//'xy'(axis:axis)//', so a copy of it stands inside. A cell needs '// &
                        'no walls across the axes along which it is periodic; leave it out')
               exit
            end do
         end associate
      end do
   end subroutine warn_of_copies

   !> Append a warning to the list.
   pure subroutine add(warnings, text)
      !> The warnings so far
      type(text_t), allocatable, intent(inout) :: warnings(:)
      !> The new one
      character(len=*), intent(in) :: text

      warnings = [warnings, text_t(text)]
   end subroutine add

end module polydem_wall_warnings
