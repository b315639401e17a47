!> Halo: copies of nearby bodies that other ranks move. The halo exchange updates them in every step.
!>
!> `follow` is the whole exchange. `send_border` and `receive_halo` are its two parts: between them a step predicts all
!> other bodies, and updates the boxes.
module polydem_halo
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: neighbour_ranks_t, communicator_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: halo_t, new_halo

   !> Halo of this rank, and its own bodies in the halos of other ranks
   type :: halo_t
      !> Neighbouring ranks, with the rows to send and to receive
      type(neighbour_ranks_t), private :: route
      !> Slots of the free bodies that are in the halo of another rank, the border, ascending. Not allocated before the
      !> first redistribution
      integer(ip), allocatable :: border(:)
      !> Whether a body is in the border, (slot), up to the last free body
      logical, allocatable :: in_border(:)
      !> Slots of the bodies to send, in the order of the route
      integer(ip), allocatable, private :: sent(:)
      !> Slots of the halo bodies, in the order of the route
      integer(ip), allocatable :: slots(:)
      !> Whether accelerations are exchanged too
      logical, private :: with_acceleration = .false.
      !> Rows to send and received rows, (width, row)
      real(wp), allocatable, private :: send_buffer(:, :), receive_buffer(:, :)
   contains
      procedure :: follow
      procedure :: send_border
      procedure :: receive_halo
      procedure :: exchange_column
   end type halo_t

contains

   !> Prepare the halo exchange.
   subroutine new_halo(halo, free, counts_sent, sent, counts_received, received, with_acceleration)
      type(halo_t), intent(out) :: halo
      !> Slots of the free bodies of this rank, ascending
      integer(ip), intent(in) :: free(:)
      !> Number of bodies to send to each rank, (0:size - 1)
      integer(ip), intent(in) :: counts_sent(0:)
      !> Their slots, in the order of these ranks
      integer(ip), intent(in) :: sent(:)
      !> Number of halo bodies from each rank, (0:size - 1)
      integer(ip), intent(in) :: counts_received(0:)
      !> Their slots, in the order of these ranks; for each rank in the order in which it sends them
      integer(ip), intent(in) :: received(:)
      !> Whether forces depend on accelerations
      logical, intent(in) :: with_acceleration
      integer(ip) :: k, r, width

      halo%in_border = spread(.false., 1, maxval([0_ip, free]))
      halo%in_border(sent) = .true.
      halo%border = pack(free, halo%in_border(free))
      associate (route => halo%route)
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
      halo%sent = sent
      halo%slots = received
      halo%with_acceleration = with_acceleration
      width = merge(9_ip, 6_ip, with_acceleration)
      allocate (halo%send_buffer(width, size(sent)), halo%receive_buffer(width, size(received)))
   end subroutine new_halo

   !> Halo exchange: set positions, angles and velocities of halo bodies to those on the ranks that own them. All ranks
   !> of the route must call this.
   subroutine follow(self, comm, bodies)
      class(halo_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      !> Bodies; positions, angles, velocities and, if required, accelerations of halo bodies change
      type(bodies_t), intent(inout) :: bodies

      call self%send_border(comm, bodies)
      call self%receive_halo(comm, bodies)
   end subroutine follow

   !> Begin the halo exchange: send the bodies of the border.
   subroutine send_border(self, comm, bodies)
      class(halo_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      integer(ip) :: k, s

      if (.not. allocated(self%sent)) return
      do k = 1_ip, size(self%sent, kind=ip)
         s = self%sent(k)
         self%send_buffer(1:2, k) = bodies%position(:, s)
         self%send_buffer(3, k) = bodies%angle(s)
         self%send_buffer(4:5, k) = bodies%velocity(:, s)
         self%send_buffer(6, k) = bodies%angular_velocity(s)
         if (.not. self%with_acceleration) cycle
         self%send_buffer(7:8, k) = bodies%acceleration(:, s)
         self%send_buffer(9, k) = bodies%angular_acceleration(s)
      end do
      call comm%begin_exchange(self%route, self%send_buffer, self%receive_buffer)
   end subroutine send_border

   !> Finish the halo exchange: receive the halo bodies.
   subroutine receive_halo(self, comm, bodies)
      class(halo_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: k, s

      if (.not. allocated(self%sent)) return
      call comm%finish_exchange(self%send_buffer, self%receive_buffer)
      do k = 1_ip, size(self%slots, kind=ip)
         s = self%slots(k)
         bodies%position(:, s) = self%receive_buffer(1:2, k)
         bodies%angle(s) = self%receive_buffer(3, k)
         bodies%velocity(:, s) = self%receive_buffer(4:5, k)
         bodies%angular_velocity(s) = self%receive_buffer(6, k)
         if (.not. self%with_acceleration) cycle
         bodies%acceleration(:, s) = self%receive_buffer(7:8, k)
         bodies%angular_acceleration(s) = self%receive_buffer(9, k)
      end do
   end subroutine receive_halo

   !> Halo exchange of one value per body. All ranks of the route must call this.
   subroutine exchange_column(self, comm, values)
      class(halo_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      !> One value per body, (slot); those of halo bodies change
      real(wp), intent(inout) :: values(:)
      real(wp), allocatable :: send_buffer(:, :), receive_buffer(:, :)
      integer(ip) :: k

      if (.not. allocated(self%sent)) return
      allocate (send_buffer(1, size(self%sent)), receive_buffer(1, size(self%slots)))
      do k = 1_ip, size(self%sent, kind=ip)
         send_buffer(1, k) = values(self%sent(k))
      end do
      call comm%exchange(self%route, send_buffer, receive_buffer)
      do k = 1_ip, size(self%slots, kind=ip)
         values(self%slots(k)) = receive_buffer(1, k)
      end do
   end subroutine exchange_column

end module polydem_halo
