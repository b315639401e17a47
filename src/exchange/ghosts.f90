!> Ghosts: bodies that other processes move, here because they are near. They follow their owners in every step.
module polydem_ghosts
   use polydem_bodies, only: bodies_t
   use polydem_kinds, only: ip, wp
   use polydem_team, only: route_t, team_t
   implicit none
   private
   public :: ghosts_t, new_ghosts

   !> Who needs bodies of this process, and whose bodies are here
   type :: ghosts_t
      !> Neighbouring processes, with rows that go there and come from there
      type(route_t), private :: route
      !> Slots of the bodies that go, in the order of the route
      integer(ip), allocatable, private :: sent(:)
      !> Slots of the ghosts, in the order of the route
      integer(ip), allocatable :: slots(:)
      !> Whether accelerations are told too
      logical, private :: with_acceleration = .false.
      !> Rows under way, (width, row)
      real(wp), allocatable, private :: going(:, :), coming(:, :)
   contains
      procedure :: follow
      procedure :: follow_column
   end type ghosts_t

contains

   !> Prepare to let ghosts follow.
   subroutine new_ghosts(ghosts, counts_sent, sent, counts_received, received, with_acceleration)
      !> What is prepared
      type(ghosts_t), intent(out) :: ghosts
      !> Bodies that go to each process, (0:size - 1)
      integer(ip), intent(in) :: counts_sent(0:)
      !> Their slots, in the order of these processes
      integer(ip), intent(in) :: sent(:)
      !> Ghosts from each process, (0:size - 1)
      integer(ip), intent(in) :: counts_received(0:)
      !> Their slots, in the order of these processes, and as they sent them
      integer(ip), intent(in) :: received(:)
      !> Whether forces depend on accelerations
      logical, intent(in) :: with_acceleration
      integer(ip) :: k, r, width

      associate (route => ghosts%route)
         route%rank = pack([(r, r=0_ip, size(counts_sent, kind=ip) - 1_ip)], &
                           counts_sent > 0_ip .or. counts_received > 0_ip)
         allocate (route%sent(size(route%rank) + 1), route%received(size(route%rank) + 1))
         route%sent(1) = 1_ip
         route%received(1) = 1_ip
         do k = 1_ip, size(route%rank, kind=ip)
            route%sent(k + 1_ip) = route%sent(k) + counts_sent(route%rank(k))
            route%received(k + 1_ip) = route%received(k) + counts_received(route%rank(k))
         end do
      end associate
      ghosts%sent = sent
      ghosts%slots = received
      ghosts%with_acceleration = with_acceleration
      width = merge(9_ip, 6_ip, with_acceleration)
      allocate (ghosts%going(width, size(sent)), ghosts%coming(width, size(received)))
   end subroutine new_ghosts

   !> Bring ghosts to where their owners have them. Those of the route call this.
   subroutine follow(self, team, bodies)
      class(ghosts_t), intent(inout) :: self
      !> Processes
      class(team_t), intent(inout) :: team
      !> Bodies; positions, angles and velocities (and accelerations) of ghosts change
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: k, s

      if (.not. allocated(self%sent)) return
      do k = 1_ip, size(self%sent, kind=ip)
         s = self%sent(k)
         self%going(1:2, k) = bodies%position(:, s)
         self%going(3, k) = bodies%angle(s)
         self%going(4:5, k) = bodies%velocity(:, s)
         self%going(6, k) = bodies%angular_velocity(s)
         if (.not. self%with_acceleration) cycle
         self%going(7:8, k) = bodies%acceleration(:, s)
         self%going(9, k) = bodies%angular_acceleration(s)
      end do
      call team%pass(self%route, self%going, self%coming)
      do k = 1_ip, size(self%slots, kind=ip)
         s = self%slots(k)
         bodies%position(:, s) = self%coming(1:2, k)
         bodies%angle(s) = self%coming(3, k)
         bodies%velocity(:, s) = self%coming(4:5, k)
         bodies%angular_velocity(s) = self%coming(6, k)
         if (.not. self%with_acceleration) cycle
         bodies%acceleration(:, s) = self%coming(7:8, k)
         bodies%angular_acceleration(s) = self%coming(9, k)
      end do
   end subroutine follow

   !> Bring one number of each ghost to what its owner has.
   subroutine follow_column(self, team, values)
      class(ghosts_t), intent(inout) :: self
      !> Processes
      class(team_t), intent(inout) :: team
      !> A number of each body, (slot); those of ghosts change
      real(wp), intent(inout) :: values(:)
      real(wp), allocatable :: going(:, :), coming(:, :)
      integer(ip) :: k

      if (.not. allocated(self%sent)) return
      allocate (going(1, size(self%sent)), coming(1, size(self%slots)))
      do k = 1_ip, size(self%sent, kind=ip)
         going(1, k) = values(self%sent(k))
      end do
      call team%pass(self%route, going, coming)
      do k = 1_ip, size(self%slots, kind=ip)
         values(self%slots(k)) = coming(1, k)
      end do
   end subroutine follow_column

end module polydem_ghosts
