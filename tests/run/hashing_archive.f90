!> A serializer that only hashes the fields of a state: two states are equal if their hashes are equal.
module hashing_archive
   use polydem_checkpoint_fields, only: restarts_t, serialize_run
   use polydem_hash, only: mix_word
   use polydem_kinds, only: dp, lp
   use polydem_monitor, only: monitor_t, new_monitor
   use polydem_serializer, only: serializer_t
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: hash_of_everything

   !> Hash of all fields except times and finder statistics, which differ after a restart
   type, extends(serializer_t) :: hashing_serializer_t
      !> Hash of the fields so far
      integer(lp) :: hash = 0_lp
   contains
      procedure :: transfer_reals
      procedure :: transfer_longs
   end type hashing_serializer_t

contains

   !> Hash of the fields that a checkpoint of a simulation holds, without times and finder statistics
   function hash_of_everything(simulation) result(hash)
      !> The simulation; unchanged on return
      type(simulation_t), intent(inout) :: simulation
      integer(lp) :: hash
      type(hashing_serializer_t) :: serializer
      type(restarts_t) :: restarts
      type(monitor_t) :: monitor

      call new_monitor(monitor, simulation)
      call serialize_run(serializer, simulation, restarts)
      hash = serializer%hash
   end function hash_of_everything

   !> Whether a field must agree after a restart
   pure logical function counts(name)
      character(len=*), intent(in) :: name

      counts = index(name, '/run/stage') /= 1 .and. index(name, '/run/finder') /= 1 .and. name /= '/run/seconds'
   end function counts

   !> Hash a field of real numbers.
   subroutine transfer_reals(self, name, width, values, unit, meaning)
      class(hashing_serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: words(:)

      words = transfer(values, 0_lp, size(values))
      call self%transfer_longs(name, width, words, unit, meaning)
   end subroutine transfer_reals

   !> Hash a field of integers.
   subroutine transfer_longs(self, name, width, values, unit, meaning)
      class(hashing_serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer :: k

      associate (unused => [len(unit), len(meaning)])
      end associate
      if (.not. counts(name)) return
      self%hash = mix_word(mix_word(self%hash, int(width, lp)), size(values, kind=lp))
      do k = 1, size(values)
         self%hash = mix_word(self%hash, values(k))
      end do
   end subroutine transfer_longs

end module hashing_archive
