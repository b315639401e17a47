!> Walls: fixed bodies that move as one. Their pose is the reference pose, to which each motion is applied in turn. What
!> loads displace further comes on top of it.
module polydem_wall
   use polydem_bodies, only: bodies_t
   use polydem_elementary, only: hypotenuse
   use polydem_kinds, only: ip, lp, wp
   use polydem_motion, only: carry_bodies, motion_item_t, pose_bodies
   use polydem_sort, only: place_in
   implicit none
   private
   public :: wall_t, new_wall, move_wall, find_slots, greatest_wall_speed, hash_of_tables

   !> A wall with prescribed motions, or with loads
   type :: wall_t
      !> Slots of its bodies
      integer(ip), allocatable :: slots(:)
      !> Their positions before all motions, (2, :) [m]
      real(wp), allocatable :: position(:, :)
      !> Their angles before all motions [rad]
      real(wp), allocatable :: angle(:)
      !> Motions, of which each one moves what the motions before it have moved
      type(motion_item_t), allocatable :: motions(:)
      !> Whether loads displace it from where the motions place it
      logical :: is_loaded = .false.
   end type wall_t

contains

   !> Make a wall of some bodies from their present positions and angles.
   subroutine new_wall(wall, motions, bodies, slots)
      !> The wall
      type(wall_t), intent(out) :: wall
      !> Its motions in their order
      type(motion_item_t), intent(in) :: motions(:)
      !> All bodies
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies of the wall
      integer(ip), intent(in) :: slots(:)
      integer :: k

      wall%slots = slots
      wall%position = bodies%position(:, slots)
      wall%angle = bodies%angle(slots)
      allocate (wall%motions(size(motions)))
      do k = 1, size(motions)
         allocate (wall%motions(k)%motion, source=motions(k)%motion)
      end do
   end subroutine new_wall

   !> Find the bodies of a wall again after bodies have changed their slots. Bodies that are gone leave the wall.
   pure subroutine find_slots(wall, former, id)
      type(wall_t), intent(inout) :: wall
      !> Identifier of the body of each former slot, and of each slot now, ascending
      integer(ip), intent(in) :: former(:), id(:)
      integer(ip) :: slots(size(wall%slots)), kept(size(wall%slots)), k, n, s

      n = 0_ip
      do k = 1_ip, size(wall%slots, kind=ip)
         s = place_in(id, former(wall%slots(k)))
         if (s > size(id)) cycle
         if (id(s) /= former(wall%slots(k))) cycle
         n = n + 1_ip
         slots(n) = s
         kept(n) = k
      end do
      wall%slots = slots(:n)
      wall%position = wall%position(:, kept(:n))
      wall%angle = wall%angle(kept(:n))
   end subroutine find_slots

   !> Set positions, angles, velocities and accelerations of the bodies of a wall at a time.
   subroutine move_wall(wall, time, bodies)
      type(wall_t), intent(in) :: wall
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      !> Bodies; position, angle, velocities and accelerations of the bodies of the wall change
      type(bodies_t), intent(inout) :: bodies
      logical :: is_moved
      integer :: k

      if (size(wall%motions) /= 1 .or. wall%is_loaded) then
         call reset_bodies(wall, bodies)
      else if (.not. wall%motions(1)%motion%starts_from_reference()) then
         call reset_bodies(wall, bodies)
      end if
      is_moved = .false.
      do k = 1, size(wall%motions)
         associate (motion => wall%motions(k)%motion)
            if (time < motion%start) cycle
            if (is_moved .or. .not. motion%starts_from_reference()) then
               call carry_bodies(motion, time, wall%slots, bodies)
            else
               call pose_bodies(motion, time, wall%slots, wall%position, wall%angle, bodies)
            end if
            is_moved = .true.
         end associate
      end do
   end subroutine move_wall

   !> Put the bodies of a wall at rest in their reference poses.
   pure subroutine reset_bodies(wall, bodies)
      type(wall_t), intent(in) :: wall
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: k

      do k = 1_ip, size(wall%slots, kind=ip)
         associate (slot => wall%slots(k))
            bodies%position(:, slot) = wall%position(:, k)
            bodies%angle(slot) = wall%angle(k)
            bodies%velocity(:, slot) = 0.0_wp
            bodies%angular_velocity(slot) = 0.0_wp
            bodies%acceleration(:, slot) = 0.0_wp
            bodies%angular_acceleration(slot) = 0.0_wp
         end associate
      end do
   end subroutine reset_bodies

   !> Hash of the tables of the motions of a wall; 0 if there are none
   pure integer(lp) function hash_of_tables(wall) result(hash)
      type(wall_t), intent(in) :: wall
      integer :: k

      hash = 0_lp
      do k = 1, size(wall%motions)
         hash = wall%motions(k)%motion%hash_of_table(hash)
      end do
   end function hash_of_tables

   !> Upper bound of the speed of any point of the bodies of a wall; of one motion, the greatest speed [m/s]
   pure real(wp) function greatest_wall_speed(wall, radius, duration) result(speed)
      type(wall_t), intent(in) :: wall
      !> Greatest distance of a vertex from the centre of each body, (slot) [m]
      real(wp), intent(in) :: radius(:)
      !> Duration of the run, in which a motion can move a body away from the pivot of the next one [s]
      real(wp), intent(in) :: duration
      real(wp) :: reach
      integer :: k

      speed = 0.0_wp
      reach = 0.0_wp
      do k = 1, size(wall%motions)
         associate (motion => wall%motions(k)%motion)
            call motion%add_bounds(greatest_arm(motion%pivot), duration, speed, reach)
         end associate
      end do

   contains

      !> Greatest distance of a vertex from a pivot before all motions [m]
      pure real(wp) function greatest_arm(pivot) result(arm)
         real(wp), intent(in) :: pivot(2)
         integer :: j

         arm = 0.0_wp
         do j = 1, size(wall%slots)
            arm = max(arm, radius(wall%slots(j)) + hypotenuse(wall%position(1, j) - pivot(1), &
                                                              wall%position(2, j) - pivot(2)))
         end do
      end function greatest_arm

   end function greatest_wall_speed

end module polydem_wall
