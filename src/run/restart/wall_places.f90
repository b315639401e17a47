!> Places of walls in a run that goes on with other motions.
module polydem_wall_places
   use polydem_bodies, only: bodies_t
   use polydem_cell, only: minimum_image
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, wp
   use polydem_simulation, only: simulation_t, time_of
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_places

   !> Greatest way of a wall at a changed motion, over its diameter: the rounding of its place
   real(wp), parameter :: most_way = 1.0e-6_wp

contains

   !> Check that motions that were changed leave their walls where the checkpoint has them.
   subroutine check_places(simulation, error)
      !> The simulation at the checkpoint
      type(simulation_t), intent(in) :: simulation
      !> Names a body that would jump
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: moved
      real(wp) :: offset(2), way
      integer(ip) :: j
      integer :: k

      if (.not. simulation%walls%any_driven()) return
      moved = simulation%bodies
      call simulation%walls%move(time_of(simulation), moved)
      associate (bodies => simulation%bodies)
         do k = 1, size(simulation%walls%wall)
            if (.not. simulation%walls%wall(k)%is_driven()) cycle
            do j = 1_ip, size(simulation%walls%wall(k)%slots, kind=ip)
               associate (s => simulation%walls%wall(k)%slots(j))
                  offset = minimum_image(bodies%cell, bodies%cell%inverse, moved%position(:, s) - bodies%position(:, s))
                  way = hypotenuse(offset(1), offset(2)) + abs(moved%angle(s) - bodies%angle(s))*bodies%diameter(s)
                  if (way <= most_way*bodies%diameter(s)) cycle
                  call raise(error, input_error, 'the changed motions would move body '//to_text(bodies%id(s))// &
                     ', of a wall, at once by '//to_text(way, 3)//' m: a place is a function of the time since the '// &
                     'start. Leave the former motion in the namelist with end = '//to_text(time_of(simulation), 6)// &
                     ', and add another group &motion with this time as its start')
                  return
               end associate
            end do
         end do
      end associate
   end subroutine check_places

end module polydem_wall_places
