!> Communicator of one process: every call is a copy or a no-op.
module polydem_serial_communicator
   use polydem_communicator, only: neighbour_ranks_t, communicator_t
   use polydem_kinds, only: dp, ip, lp, wp
   implicit none
   private
   public :: serial_communicator_t

   !> A communicator of size 1
   type, extends(communicator_t) :: serial_communicator_t
   contains
      procedure :: all_reduce_sum => unchanged_longs
      procedure :: all_reduce_max_longs => unchanged_longs
      procedure :: all_reduce_max_doubles
      procedure :: broadcast_longs => unchanged_longs
      procedure :: gather_longs
      procedure :: all_to_all_longs
      procedure :: exchange
      procedure :: receive_from_previous => unchanged_longs
      procedure :: send_to_next => unchanged_longs
      procedure :: finalize
   end type serial_communicator_t

contains

   !> Sums, maxima, broadcast and relayed numbers: unchanged, as there is only one rank.
   subroutine unchanged_longs(self, values)
      class(serial_communicator_t), intent(inout) :: self
      integer(lp), intent(inout), contiguous :: values(:)

      associate (unused => self%size, unused_values => values)
      end associate
   end subroutine unchanged_longs

   !> Maxima: unchanged, as there is only one rank.
   subroutine all_reduce_max_doubles(self, values)
      class(serial_communicator_t), intent(inout) :: self
      real(dp), intent(inout), contiguous :: values(:)

      associate (unused => self%size, unused_values => values)
      end associate
   end subroutine all_reduce_max_doubles

   !> Return a copy of the only list.
   subroutine gather_longs(self, mine, all_of_them, counts)
      class(serial_communicator_t), intent(inout) :: self
      integer(lp), intent(in), contiguous :: mine(:)
      integer(lp), allocatable, intent(out) :: all_of_them(:)
      integer(ip), allocatable, intent(out) :: counts(:)

      all_of_them = mine
      allocate (counts(0:self%size - 1_ip))
      counts = size(mine, kind=ip)
   end subroutine gather_longs

   !> Return a copy of the rows.
   subroutine all_to_all_longs(self, rows, counts, received, counts_received)
      class(serial_communicator_t), intent(inout) :: self
      integer(lp), intent(in), contiguous :: rows(:, :)
      integer(ip), intent(in) :: counts(0:)
      integer(lp), allocatable, intent(out) :: received(:, :)
      integer(ip), allocatable, intent(out) :: counts_received(:)

      received = rows
      allocate (counts_received(0:self%size - 1_ip))
      counts_received = counts
   end subroutine all_to_all_longs

   !> No-op: there is no other rank.
   subroutine exchange(self, route, sent, received)
      class(serial_communicator_t), intent(inout) :: self
      type(neighbour_ranks_t), intent(in) :: route
      real(wp), intent(in), contiguous, target :: sent(:, :)
      real(wp), intent(inout), contiguous, target :: received(:, :)

      associate (unused => self%size, unused_route => route, unused_rows => sent, unused_values => received)
      end associate
   end subroutine exchange

   !> No-op: no communication has to be ended.
   subroutine finalize(self)
      class(serial_communicator_t), intent(inout) :: self

      associate (unused => self%size)
      end associate
   end subroutine finalize

end module polydem_serial_communicator
