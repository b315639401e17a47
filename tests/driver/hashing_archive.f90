!> An archive that remembers a hash of what is kept, and nothing else: two states are equal if their hashes are.
module hashing_archive
   use polydem_archive, only: archive_t
   use polydem_checkpoint_contents, only: history_t, keep_run
   use polydem_hash, only: mix_word
   use polydem_kinds, only: dp, lp
   use polydem_simulation, only: simulation_t
   use polydem_watch, only: watch_t
   implicit none
   private
   public :: hash_of_everything

   !> Hash and size of all columns but those of clocks, of attempts and of the work of finders, which begin anew
   type, extends(archive_t) :: hashing_archive_t
      !> Hash of the numbers so far
      integer(lp) :: hash = 0_lp
   contains
      procedure :: exchange_reals
      procedure :: exchange_longs
   end type hashing_archive_t

contains

   !> Hash of everything that a checkpoint of a simulation would hold
   function hash_of_everything(simulation) result(hash)
      !> The simulation, which stays as it is
      type(simulation_t), intent(inout) :: simulation
      integer(lp) :: hash
      type(hashing_archive_t) :: archive
      type(history_t) :: history
      type(watch_t) :: watch

      call keep_run(archive, simulation, history, watch)
      hash = archive%hash
   end function hash_of_everything

   !> Whether a column must be equal in runs that are
   pure logical function counts(name)
      character(len=*), intent(in) :: name

      counts = index(name, '/run/stage') /= 1 .and. index(name, '/run/finder') /= 1 .and. name /= '/run/seconds'
   end function counts

   !> Take in real numbers.
   subroutine exchange_reals(self, name, width, values, unit, meaning)
      class(hashing_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer :: k

      associate (unused => [len(unit), len(meaning)])
      end associate
      if (.not. counts(name)) return
      self%hash = mix_word(mix_word(self%hash, int(width, lp)), size(values, kind=lp))
      do k = 1, size(values)
         self%hash = mix_word(self%hash, transfer(values(k), 0_lp))
      end do
   end subroutine exchange_reals

   !> Take in whole numbers.
   subroutine exchange_longs(self, name, values, unit, meaning)
      class(hashing_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer :: k

      associate (unused => [len(unit), len(meaning)])
      end associate
      if (.not. counts(name)) return
      self%hash = mix_word(self%hash, size(values, kind=lp))
      do k = 1, size(values)
         self%hash = mix_word(self%hash, values(k))
      end do
   end subroutine exchange_longs

end module hashing_archive
