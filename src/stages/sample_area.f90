!> The area of the sample: a rectangle with sides along the axes, the same on all ranks.
module polydem_sample_area
   use polydem_kinds, only: ip, wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: text_t
   use polydem_wall, only: number_of
   implicit none
   private
   public :: sample_area_t, find_area, has_area

   !> The area. A body is in it if its centre is; in a periodic cell each copy counts
   type :: sample_area_t
      !> Lower left and upper right corner (2) [m]
      real(wp) :: low(2) = 0.0_wp, high(2) = 0.0_wp
      !> Width and height (2) [m]
      real(wp) :: size(2) = 0.0_wp
   end type sample_area_t

contains

   !> Whether a sample has an area
   pure logical function has_area(simulation)
      type(simulation_t), intent(in) :: simulation

      has_area = simulation%settings%sample%area /= 'none' .or. all(simulation%bodies%cell%size > 0.0_wp)
   end function has_area

   !> Find the area of the sample. Walls may move, so it may change from step to step.
   subroutine find_area(simulation, area)
      !> The simulation, with turned vertices of the walls
      type(simulation_t), intent(in) :: simulation
      type(sample_area_t), intent(out) :: area
      integer :: axis

      associate (sample => simulation%settings%sample, cell => simulation%bodies%cell)
         if (sample%area == 'rectangle') then
            area%low = sample%low
            area%high = sample%high
            area%size = area%high - area%low
            return
         end if
         if (sample%area == 'walls') then
            if (size(sample%sides) == 2) call bound(area, 1, wall_pair(simulation, sample%sides), simulation)
            if (size(sample%ends) == 2) call bound(area, 2, wall_pair(simulation, sample%ends), simulation)
         end if
         do axis = 1, 2
            if (area%size(axis) > 0.0_wp) cycle
            area%low(axis) = cell%low(axis)
            area%high(axis) = cell%low(axis) + cell%size(axis)
            area%size(axis) = cell%size(axis)
         end do
      end associate
   end subroutine find_area

   !> Bound an area by the faces of two walls that look at each other.
   subroutine bound(area, axis, pair, simulation)
      type(sample_area_t), intent(inout) :: area
      !> 1: along x, 2: along y
      integer, intent(in) :: axis
      !> Numbers of the walls
      integer(ip), intent(in) :: pair(2)
      type(simulation_t), intent(in) :: simulation
      real(wp) :: first(2), second(2)

      first = simulation%walls%wall(pair(1))%extent(axis, simulation%bodies)
      second = simulation%walls%wall(pair(2))%extent(axis, simulation%bodies)
      if (second(1) - first(2) >= first(1) - second(2)) then
         area%low(axis) = first(2)
         area%high(axis) = second(1)
      else
         area%low(axis) = second(2)
         area%high(axis) = first(1)
      end if
      ! Walls that pass each other leave no area.
      area%size(axis) = max(area%high(axis) - area%low(axis), tiny(1.0_wp))
   end subroutine bound

   !> Numbers of two walls
   pure function wall_pair(simulation, names) result(pair)
      type(simulation_t), intent(in) :: simulation
      !> Their names, (2)
      type(text_t), intent(in) :: names(:)
      integer(ip) :: pair(2)

      pair = [number_of(names(1)%text, simulation%walls%wall), number_of(names(2)%text, simulation%walls%wall)]
   end function wall_pair

end module polydem_sample_area
