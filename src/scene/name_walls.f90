!> Named walls and the loads on them, from the settings.
module polydem_name_walls
   use polydem_bodies, only: bodies_t
   use polydem_driven, only: along_angle, new_window
   use polydem_kinds, only: ip, wp
   use polydem_named_walls, only: named_walls_t
   use polydem_run_duration, only: number_of_stage
   use polydem_settings, only: settings_t
   use polydem_strings, only: index_of
   use polydem_wall, only: wall_t
   use polydem_wall_bodies, only: wall_bodies_t
   use polydem_wall_load, only: wall_load_t
   implicit none
   private
   public :: assign_loads, ids_of_wall, name_walls

contains

   !> Identifiers of the bodies of a wall
   pure function ids_of_wall(name, named) result(ids)
      !> Its name
      character(len=*), intent(in) :: name
      !> All walls
      type(wall_bodies_t), intent(in) :: named(:)
      integer(ip), allocatable :: ids(:)

      ids = named(number_of(name, named))%id
   end function ids_of_wall

   !> Number of the wall with a name
   pure integer(ip) function number_of(name, named)
      character(len=*), intent(in) :: name
      type(wall_bodies_t), intent(in) :: named(:)

      do number_of = 1_ip, size(named, kind=ip)
         if (name == named(number_of)%name) return
      end do
   end function number_of

   !> List the walls by name. The torque on a wall is stated about the pivot of its first motion that has one, or load
   !> by angle, else about the origin.
   subroutine name_walls(settings, bodies, of_parts, walls, named)
      type(settings_t), intent(in) :: settings
      !> Bodies at the start
      type(bodies_t), intent(in) :: bodies
      !> The walls with their bodies
      type(wall_bodies_t), intent(in) :: of_parts(:)
      !> Walls with motions
      type(wall_t), intent(in) :: walls(:)
      !> The walls by name
      type(named_walls_t), intent(inout) :: named
      integer :: j, k, w

      allocate (named%wall(size(of_parts)))
      do w = 1, size(of_parts)
         named%wall(w)%name = of_parts(w)%name
         named%wall(w)%id = of_parts(w)%id
         do k = 1, size(settings%wall)
            if (settings%wall(k)%name == of_parts(w)%name .and. settings%wall(k)%vanish_at > 0.0_wp) &
               named%wall(w)%vanish_at = settings%wall(k)%vanish_at
         end do
      end do
      call named%find_slots(bodies)
      do w = 1, size(of_parts)
         associate (wall => named%wall(w))
            if (size(wall%slots) == 0) cycle
            wall%angle = bodies%angle(wall%slots(1))
            do k = size(settings%load), 1, -1
               if (settings%load(k)%wall == wall%name .and. settings%load(k)%direction == 'angle') &
                  wall%pivot = settings%load(k)%pivot
            end do
            do k = 1, size(walls)
               if (all(walls(k)%slots /= wall%slots(1))) cycle
               do j = size(walls(k)%motions), 1, -1
                  associate (motion => walls(k)%motions(j)%motion)
                     if (motion%has_pivot()) wall%pivot = motion%pivot
                  end associate
               end do
            end do
         end associate
      end do
   end subroutine name_walls

   !> Set the parameters of the loads.
   pure subroutine assign_loads(settings, of_parts, loads)
      type(settings_t), intent(in) :: settings
      !> The walls with their bodies
      type(wall_bodies_t), intent(in) :: of_parts(:)
      !> The loads; not allocated if there are none
      type(wall_load_t), allocatable, intent(inout) :: loads(:)
      integer :: j, k

      if (size(settings%load) == 0) return
      allocate (loads(size(settings%load)))
      do k = 1, size(loads)
         associate (given => settings%load(k), load => loads(k))
            load%name = given%name
            load%wall = number_of(given%wall, of_parts)
            load%direction = index_of(given%direction, [character(len=5) :: 'x', 'y', 'angle'])
            load%force = given%force
            if (load%direction == along_angle) load%force = given%torque
            load%stress = given%stress
            load%width = given%width
            do j = 1, min(2, size(given%between))
               load%between(j) = number_of(given%between(j)%text, of_parts)
            end do
            load%pivot = given%pivot
            load%mass = given%mass
            load%has_weight = given%weight
            load%damping_ratio = given%damping_ratio
            load%window_t = new_window(given%start, given%end, given%ramp, number_of_stage(settings, given%stage))
         end associate
      end do
   end subroutine assign_loads

end module polydem_name_walls
