!> Checkpoints: what a run needs to go on with the same bits, as a file that is there whole or not at all.
!>
!>     /run         step, time step, books, clocks and counters of the run as a whole
!>     /bodies      id, and what changes about bodies: one row per body in order of identifiers
!>     /boxes       bounds when pairs were last searched
!>     /pairs       first, second (identifiers), and what is remembered of each pair
!>     /provenance  where it comes from
!>
!> What never changes, shapes and masses, follows from the namelist; hashes tell if it does not. The driver says what
!> is in the groups, by `keep` and `match`. The file is sealed, and opened only if its seal is right.
module polydem_checkpoint_file
   use polydem_archive, only: archive_t
   use polydem_complete_file, only: begin_file, complete_file
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: dp, lp
   use polydem_provenance, only: provenance_t, write_provenance
   use polydem_sealed_file, only: check_seal
   use polydem_segment, only: schema_version
   implicit none
   private
   public :: checkpoint_file_t

   !> A checkpoint that is being written or read
   type, extends(archive_t) :: checkpoint_file_t
      private
      !> The file
      type(hdf5_file_t) :: file
      !> Its path when it is complete
      character(len=:), allocatable :: path
   contains
      procedure :: create
      procedure :: complete
      procedure :: open => open_checkpoint
      procedure :: close => close_checkpoint
      procedure :: read_origin
      procedure :: exchange_reals
      procedure :: exchange_longs
   end type checkpoint_file_t

contains

   !> Begin a checkpoint; a failure goes to `error` of the archive.
   subroutine create(self, path, provenance)
      class(checkpoint_file_t), intent(inout) :: self
      !> Its path when it is complete; a former file of this name is kept until then
      character(len=*), intent(in) :: path
      !> Where it comes from
      type(provenance_t), intent(in) :: provenance

      self%path = path
      self%gives_back = .false.
      call begin_file(self%file, path, self%error, sealed=.true.)
      if (allocated(self%error)) return
      call self%file%write_attribute('/', 'content', 'checkpoint by polydem', self%error)
      call self%file%write_attribute('/', 'schema_version', schema_version, self%error)
      if (.not. allocated(self%error)) call write_provenance(provenance, self%file, self%error)
   end subroutine create

   !> Seal the checkpoint, bring it to disk and give it its name; if it could not be written it is removed.
   subroutine complete(self, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> Why there is no checkpoint
      type(error_t), allocatable, intent(inout) :: error

      call complete_file(self%file, self%path, self%error, sealed=.true.)
      if (allocated(self%error) .and. .not. allocated(error)) call move_alloc(self%error, error)
   end subroutine complete

   !> Open a checkpoint to take the state from it.
   subroutine open_checkpoint(self, path, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> Its path
      character(len=*), intent(in) :: path
      !> Says what is wrong if it is damaged
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: problem

      self%path = path
      self%gives_back = .true.
      call check_seal(path, problem)
      if (allocated(problem)) then
         call raise(error, io_error, path//': is damaged: '//problem)
      else
         call self%file%open(path, error)
      end if
   end subroutine open_checkpoint

   !> End reading.
   subroutine close_checkpoint(self, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> Why not all could be read
      type(error_t), allocatable, intent(inout) :: error

      call self%file%close(self%error)
      if (allocated(self%error) .and. .not. allocated(error)) call move_alloc(self%error, error)
   end subroutine close_checkpoint

   !> Read which program wrote an open checkpoint, from which settings.
   subroutine read_origin(self, revision, settings, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> Commit that the program was built from
      character(len=:), allocatable, intent(out) :: revision
      !> All settings that were in force
      character(len=:), allocatable, intent(out) :: settings
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      call self%file%read('/provenance/revision', revision, error)
      if (.not. allocated(error)) call self%file%read('/provenance/resolved_input', settings, error)
   end subroutine read_origin

   !> Write real numbers or read them.
   subroutine exchange_reals(self, name, width, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      real(dp), allocatable :: table(:, :), list(:)

      if (.not. self%gives_back .and. width == 1) then
         call self%file%write(name, values, self%error, unit, meaning)
      else if (.not. self%gives_back) then
         call self%file%write(name, reshape(values, [width, size(values)/width]), self%error, unit, meaning)
      else
         if (width == 1) call self%file%read(name, list, self%error)
         if (width > 1) call self%file%read(name, table, self%error)
         if (width > 1 .and. .not. allocated(self%error)) list = reshape(table, [size(table)])
         if (allocated(self%error)) return
         call expect_size(self, name, size(list), size(values))
         if (.not. allocated(self%error)) values = list
      end if
   end subroutine exchange_reals

   !> Write whole numbers or read them.
   subroutine exchange_longs(self, name, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: list(:)

      if (.not. self%gives_back) then
         call self%file%write(name, values, self%error, unit, meaning)
      else
         call self%file%read(name, list, self%error)
         if (allocated(self%error)) return
         call expect_size(self, name, size(list), size(values))
         if (.not. allocated(self%error)) values = list
      end if
   end subroutine exchange_longs

   subroutine expect_size(self, name, found, wanted)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: found, wanted

      if (found /= wanted) call raise(self%error, input_error, self%path//': '//name// &
         ' has another length than this run needs: bodies or settings are others')
   end subroutine expect_size

end module polydem_checkpoint_file
