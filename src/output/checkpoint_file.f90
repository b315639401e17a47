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
!>
!> Several processes write a checkpoint together: /run is that of the leader, and of the other groups each process has
!> rows as laid out by `set_rows`. The leader reads it alone.
module polydem_checkpoint_file
   use polydem_archive, only: archive_t
   use polydem_complete_file, only: begin_file, complete_file, share_file
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_hdf5_file, only: hdf5_file_t, part_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_lone_team, only: lone_team_t
   use polydem_provenance, only: provenance_t, write_provenance
   use polydem_result_folder, only: unfinished
   use polydem_row_blocks, only: component, row_blocks_t
   use polydem_sealed_file, only: check_seal
   use polydem_segment, only: schema_version
   use polydem_team, only: team_t
   implicit none
   private
   public :: checkpoint_file_t

   !> Groups that have rows
   character(len=*), parameter :: groups(3) = [character(len=8) :: '/bodies/', '/boxes/', '/pairs/']

   !> A checkpoint that is being written or read
   type, extends(archive_t) :: checkpoint_file_t
      private
      !> The file
      type(hdf5_file_t) :: file
      !> Its path when it is complete
      character(len=:), allocatable :: path
      !> Processes that write it
      class(team_t), allocatable :: team
      !> How the rows of each group are spread over them
      type(row_blocks_t) :: rows(size(groups))
      !> Whether that is known; else columns are whole
      logical :: is_spread(size(groups)) = .false.
   contains
      procedure :: create
      procedure :: set_rows
      procedure :: complete
      procedure :: open => open_checkpoint
      procedure :: close => close_checkpoint
      procedure :: read_origin
      procedure :: exchange_reals
      procedure :: exchange_longs
   end type checkpoint_file_t

contains

   !> Begin a checkpoint; a failure goes to `error` of the archive.
   subroutine create(self, path, provenance, team, room)
      class(checkpoint_file_t), intent(inout) :: self
      !> Its path when it is complete; a former file of this name is kept until then
      character(len=*), intent(in) :: path
      !> Where it comes from
      type(provenance_t), intent(in) :: provenance
      !> Processes that write it; this one alone if absent
      class(team_t), intent(in), optional :: team
      !> What they are going to write at most [B]; 0 if absent
      integer(lp), intent(in), optional :: room
      integer(lp) :: bytes

      bytes = 0_lp
      if (present(room)) bytes = room
      self%path = path
      self%gives_back = .false.
      self%is_spread = .false.
      if (allocated(self%team)) deallocate (self%team)
      if (present(team)) then
         allocate (self%team, source=team)
      else
         allocate (lone_team_t :: self%team)
      end if
      if (self%team%leads()) call write_origin(self, provenance)
      call share_file(self%team, self%file, path//unfinished, bytes, self%error)
   end subroutine create

   !> Create the file, and write what it is and where it comes from.
   subroutine write_origin(self, provenance)
      class(checkpoint_file_t), intent(inout) :: self
      type(provenance_t), intent(in) :: provenance

      call begin_file(self%file, self%path, self%error, sealed=.true.)
      if (allocated(self%error)) return
      call self%file%write_attribute('/', 'content', 'checkpoint by polydem', self%error)
      call self%file%write_attribute('/', 'schema_version', schema_version, self%error)
      if (.not. allocated(self%error)) call write_provenance(provenance, self%file, self%error)
   end subroutine write_origin

   !> Say how the rows of a group are spread over processes, before its columns are kept.
   subroutine set_rows(self, group, rows)
      class(checkpoint_file_t), intent(inout) :: self
      !> /bodies/, /boxes/ or /pairs/
      character(len=*), intent(in) :: group
      !> How they get into ascending order
      type(row_blocks_t), intent(in) :: rows
      integer :: k

      do k = 1, size(groups)
         if (groups(k) /= group) cycle
         self%rows(k) = rows
         self%is_spread(k) = .true.
      end do
   end subroutine set_rows

   !> Seal the checkpoint, bring it to disk and give it its name; if it could not be written it is removed. All
   !> processes know of a failure.
   subroutine complete(self, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> Why there is no checkpoint
      type(error_t), allocatable, intent(inout) :: error

      call complete_file(self%file, self%path, self%error, sealed=.true., team=self%team)
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

      if (.not. self%gives_back) then
         call write_reals(self, name, reshape(values, [width, size(values)/width]), unit, meaning)
      else
         if (width == 1) call self%file%read(name, list, self%error)
         if (width > 1) call self%file%read(name, table, self%error)
         if (width > 1 .and. .not. allocated(self%error)) list = reshape(table, [size(table)])
         if (allocated(self%error)) return
         call expect_size(self, name, size(list), size(values))
         if (.not. allocated(self%error)) values = list
      end if
   end subroutine exchange_reals

   !> Write rows of real numbers.
   subroutine write_reals(self, name, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name, unit, meaning
      real(dp), intent(in) :: values(:, :)
      real(dp), allocatable :: block(:, :)
      type(part_t) :: part
      integer :: k

      k = group_of(self, name)
      if (k == 0 .and. size(values, 1) == 1) then
         call self%file%write(name, component(values, 1), self%error, unit, meaning)
      else if (k == 0) then
         call self%file%write(name, values, self%error, unit, meaning)
      else
         call self%rows(k)%bring(self%team, values, block)
         part = part_t(self%rows(k)%first, self%rows(k)%total)
         if (size(values, 1) == 1) call self%file%write(name, component(block, 1), self%error, unit, meaning, part)
         if (size(values, 1) > 1) call self%file%write(name, block, self%error, unit, meaning, part)
      end if
   end subroutine write_reals

   !> Write rows of whole numbers as a list. There are several numbers in a row if they are bits of longer ones; a
   !> process without rows learns from the others how many.
   subroutine write_longs(self, name, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name, unit, meaning
      integer(lp), intent(in), contiguous :: values(:)
      integer(lp), allocatable :: block(:, :)
      integer(lp) :: width(1)
      integer :: k

      k = group_of(self, name)
      if (k == 0) then
         call self%file%write(name, values, self%error, unit, meaning)
         return
      end if
      associate (rows => self%rows(k))
         width = size(values, kind=lp)/int(max(1_ip, rows%n_known), lp)
         call self%team%maximise(width)
         call rows%bring(self%team, reshape(values, [width(1), int(rows%n_known, lp)]), block)
         call self%file%write(name, reshape(block, [size(block)]), self%error, unit, meaning, &
                              part_t(width(1)*rows%first, width(1)*rows%total))
      end associate
   end subroutine write_longs

   !> Number of the group of a column, if its rows are spread over processes; else 0
   pure integer function group_of(self, name)
      class(checkpoint_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer :: k

      group_of = 0
      do k = 1, size(groups)
         if (index(name, trim(groups(k))) == 1 .and. self%is_spread(k)) group_of = k
      end do
   end function group_of

   !> Write whole numbers or read them.
   subroutine exchange_longs(self, name, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: list(:)

      if (.not. self%gives_back) then
         call write_longs(self, name, values, unit, meaning)
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
