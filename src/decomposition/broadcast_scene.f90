!> Broadcast of the data that all ranks share: fixed bodies, their prescribed motions, and values of the whole run.
module polydem_broadcast_scene
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_communicator, only: communicator_t
   use polydem_instruction_set, only: isa_base
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_packed_bodies, only: packed_bodies_t, pack_bodies, unpack_bodies
   use polydem_prescribed_motion, only: motion_names, motion_t
   use polydem_serializer, only: serializer_t
   implicit none
   private
   public :: broadcaster_t, broadcast_fixed_bodies, broadcast_motions

   !> Serializer that broadcasts the values of the whole run from the root rank
   type, extends(serializer_t) :: broadcaster_t
      !> Ranks
      class(communicator_t), allocatable :: comm
   contains
      procedure :: transfer_reals
      procedure :: transfer_longs
   end type broadcaster_t

contains

   !> Broadcast the fixed bodies of the root rank. On all other ranks they become the only bodies. Collective.
   subroutine broadcast_fixed_bodies(comm, n_all, bodies)
      !> Ranks
      class(communicator_t), intent(inout) :: comm
      !> Number of all bodies of the run
      integer(ip), intent(in) :: n_all
      !> On the root rank all bodies, unchanged; on the others afterwards the fixed bodies
      type(bodies_t), intent(inout) :: bodies
      type(packed_bodies_t) :: packed
      real(dp), allocatable :: pose(:, :)
      integer(ip), allocatable :: slots(:)
      integer(lp) :: counts(2)
      integer(ip) :: s

      if (comm%is_root()) then
         slots = pack([(s, s=1_ip, bodies%n)], bodies%fixed)
         call pack_bodies(bodies, slots, packed)
         pose = real(reshape([bodies%position(1, slots), bodies%position(2, slots), bodies%angle(slots)], &
                             [size(slots), 3]), dp)
         counts = [size(packed%label, 2, kind=lp), size(packed%shape, 2, kind=lp)]
      end if
      call comm%broadcast(counts)
      if (.not. comm%is_root()) allocate (packed%label(4, counts(1)), packed%mass(4, counts(1)), &
                                        packed%shape(2, counts(2)), pose(counts(1), 3))
      call broadcast_longs(comm, packed%label)
      call broadcast_reals(comm, packed%mass)
      call broadcast_reals(comm, packed%shape)
      call broadcast_doubles(comm, pose)
      if (comm%is_root()) return
      call unpack_bodies(packed, n_all, bodies, slots)
      bodies%position(1, :) = real(pose(:, 1), wp)
      bodies%position(2, :) = real(pose(:, 2), wp)
      bodies%angle = real(pose(:, 3), wp)
      call turn_bodies(bodies, slots, isa_base)
   end subroutine broadcast_fixed_bodies

   !> Broadcast the prescribed motions of the root rank. Collective.
   !>
   !> On the other ranks `slots` are afterwards those of the root rank, which are global indices. The caller must
   !> convert them.
   subroutine broadcast_motions(comm, motions)
      !> Ranks
      class(communicator_t), intent(inout) :: comm
      !> Prescribed motions; all ranks pass the same number of them
      type(motion_t), intent(inout) :: motions(:)
      integer(lp), allocatable :: rows(:)
      real(dp), allocatable :: poses(:)
      real(dp) :: numbers(10)
      integer(lp) :: counts(2)
      integer :: k, n

      do k = 1, size(motions)
         associate (motion => motions(k))
            if (comm%is_root()) then
               counts(1) = size(motion%slots, kind=lp)
               do n = 1, size(motion_names)
                  if (motion_names(n) == motion%kind) counts(2) = int(n, lp)
               end do
               numbers = real([motion%pivot, motion%rate, motion%velocity, motion%amplitude, motion%frequency, &
                               motion%start, motion%ramp], dp)
               rows = int(motion%slots, lp)
               poses = real([motion%position(1, :), motion%position(2, :), motion%angle], dp)
            end if
            call comm%broadcast(counts)
            call comm%broadcast(numbers)
            n = int(counts(1))
            if (.not. comm%is_root()) then
               if (allocated(rows)) deallocate (rows, poses)
               allocate (rows(n), poses(3*n))
            end if
            call comm%broadcast(rows)
            call comm%broadcast(poses)
            if (comm%is_root()) cycle
            motion%kind = motion_names(counts(2))
            motion%pivot = real(numbers(1:2), wp)
            motion%rate = real(numbers(3), wp)
            motion%velocity = real(numbers(4:5), wp)
            motion%amplitude = real(numbers(6:7), wp)
            motion%frequency = real(numbers(8), wp)
            motion%start = real(numbers(9), wp)
            motion%ramp = real(numbers(10), wp)
            motion%slots = int(rows, ip)
            allocate (motion%position(2, n))
            motion%position(1, :) = real(poses(:n), wp)
            motion%position(2, :) = real(poses(n + 1:2*n), wp)
            motion%angle = real(poses(2*n + 1:), wp)
         end associate
      end do
   end subroutine broadcast_motions

   !> Broadcast real numbers from the root rank if they belong to the whole run.
   subroutine transfer_reals(self, name, width, values, unit, meaning)
      class(broadcaster_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      if (index(name, '/run/') == 1) call self%comm%broadcast(values)
      associate (unused => unit//meaning, same => width)
      end associate
   end subroutine transfer_reals

   !> Broadcast integers from the root rank if they belong to the whole run.
   subroutine transfer_longs(self, name, values, unit, meaning)
      class(broadcaster_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      if (index(name, '/run/') == 1) call self%comm%broadcast(values)
      associate (unused => unit//meaning)
      end associate
   end subroutine transfer_longs

   !> Broadcast a table of integers.
   subroutine broadcast_longs(comm, table)
      class(communicator_t), intent(inout) :: comm
      integer(lp), intent(inout) :: table(:, :)
      integer(lp) :: list(size(table))

      list = reshape(table, [size(table)])
      call comm%broadcast(list)
      table = reshape(list, shape(table))
   end subroutine broadcast_longs

   !> Broadcast a table of real numbers of working precision.
   subroutine broadcast_reals(comm, table)
      class(communicator_t), intent(inout) :: comm
      real(wp), intent(inout) :: table(:, :)
      real(dp) :: list(size(table))

      list = real(reshape(table, [size(table)]), dp)
      call comm%broadcast(list)
      table = real(reshape(list, shape(table)), wp)
   end subroutine broadcast_reals

   !> Broadcast a table of real numbers of double precision.
   subroutine broadcast_doubles(comm, table)
      class(communicator_t), intent(inout) :: comm
      real(dp), intent(inout) :: table(:, :)
      real(dp) :: list(size(table))

      list = reshape(table, [size(table)])
      call comm%broadcast(list)
      table = reshape(list, shape(table))
   end subroutine broadcast_doubles

end module polydem_broadcast_scene
