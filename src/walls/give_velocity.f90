!> A velocity that is given to a wall during a run, in place of its motions.
module polydem_give_velocity
   use polydem_bodies, only: bodies_t
   use polydem_given_velocity, only: given_velocity_t
   use polydem_kinds, only: wp
   use polydem_motion, only: motion_item_t
   use polydem_walls, only: walls_t
   implicit none
   private
   public :: give_velocity

contains

   !> Give a wall a velocity from a time on. Its place stays continuous.
   subroutine give_velocity(walls, k, time, velocity, spin, pivot, bodies)
      type(walls_t), intent(inout) :: walls
      !> Number of the wall, which has no loads
      integer, intent(in) :: k
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      !> Velocity, (2) [m/s], angular velocity [rad/s], and the point about which the wall turns, (2) [m]
      real(wp), intent(in) :: velocity(2), spin, pivot(2)
      !> Bodies; unchanged on return
      type(bodies_t), intent(inout) :: bodies
      type(given_velocity_t) :: motion

      if (walls%wall(k)%is_driven()) call renew_reference(walls, k, time, bodies)
      motion%kind = 'given'
      motion%start = time
      motion%velocity = velocity
      motion%spin = spin
      motion%pivot = pivot
      motion%has_pivot = .true.
      call replace_motions(walls, k, motion)
   end subroutine give_velocity

   !> Let the poses to which the motions of a wall have brought it be its reference poses. In a periodic cell these are
   !> not those to which its bodies have returned.
   subroutine renew_reference(walls, k, time, bodies)
      type(walls_t), intent(inout) :: walls
      !> Number of the wall
      integer, intent(in) :: k
      !> Time since the start of the run [s]
      real(wp), intent(in) :: time
      !> Bodies; unchanged on return
      type(bodies_t), intent(inout) :: bodies
      real(wp), allocatable :: former(:, :)

      associate (wall => walls%wall(k), slots => walls%wall(k)%slots)
         allocate (former(9, size(slots)))
         former(1:2, :) = bodies%position(:, slots)
         former(3:4, :) = bodies%velocity(:, slots)
         former(5:6, :) = bodies%acceleration(:, slots)
         former(7, :) = bodies%angle(slots)
         former(8, :) = bodies%angular_velocity(slots)
         former(9, :) = bodies%angular_acceleration(slots)
         call wall%move(walls%motions, time, bodies)
         wall%position = bodies%position(:, slots)
         wall%angle = bodies%angle(slots)
         bodies%position(:, slots) = former(1:2, :)
         bodies%velocity(:, slots) = former(3:4, :)
         bodies%acceleration(:, slots) = former(5:6, :)
         bodies%angle(slots) = former(7, :)
         bodies%angular_velocity(slots) = former(8, :)
         bodies%angular_acceleration(slots) = former(9, :)
      end associate
   end subroutine renew_reference

   !> Let a wall have one motion alone, in the place of the one that it was given before, if there is one.
   subroutine replace_motions(walls, k, motion)
      type(walls_t), intent(inout) :: walls
      !> Number of the wall
      integer, intent(in) :: k
      !> The motion
      type(given_velocity_t), intent(in) :: motion
      type(motion_item_t), allocatable :: longer(:)
      integer :: j, n

      n = size(walls%motions)
      if (size(walls%wall(k)%motions) == 1) then
         j = walls%wall(k)%motions(1)
         if (walls%motions(j)%motion%kind == 'given') n = j - 1
      end if
      if (n == size(walls%motions)) then
         allocate (longer(n + 1))
         do j = 1, n
            call move_alloc(walls%motions(j)%motion, longer(j)%motion)
         end do
         call move_alloc(longer, walls%motions)
      else
         deallocate (walls%motions(n + 1)%motion)
      end if
      allocate (walls%motions(n + 1)%motion, source=motion)
      walls%wall(k)%motions = [n + 1]
   end subroutine replace_motions

end module polydem_give_velocity
