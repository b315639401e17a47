!> Checkpoint files: the state that a bitwise identical restart needs, in an atomic file (polydem_atomic_file).
!>
!>     /run         step, time step, energy balance, clocks and counters of the whole run
!>     /bodies      id and variable state: one row per body, in ascending order of identifiers
!>     /boxes       bounds at the last pair search
!>     /pairs       first, second (identifiers) and contact history of each pair
!>     /provenance  origin of the file
!>
!> Constant data (shapes, masses) follow from the namelist; hashes detect a difference. The caller defines the
!> contents of the groups with `field` and `match`. The file ends with a checksum and is opened only if the checksum
!> is correct.
!>
!> All ranks write a checkpoint collectively. The root rank writes /run. In the other groups each rank writes the rows
!> that `set_rows` assigns to it. The root rank reads a checkpoint alone.
module polydem_checkpoint_file
   use polydem_atomic_file, only: begin_file, complete_file, open_on_all_ranks
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_file_checksum, only: verify_checksum
   use polydem_global_order, only: component, global_order_t
   use polydem_hdf5_file, only: hdf5_file_t, part_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_provenance, only: provenance_t, write_provenance, schema_version
   use polydem_result_files, only: unfinished
   use polydem_serial_communicator, only: serial_communicator_t
   use polydem_serializer, only: serializer_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: checkpoint_file_t

   !> Groups with distributed rows
   character(len=*), parameter :: groups(3) = [character(len=8) :: '/bodies/', '/boxes/', '/pairs/']

   !> A checkpoint that is being written or read
   type, extends(serializer_t) :: checkpoint_file_t
      private
      !> The file
      type(hdf5_file_t) :: file
      !> Final path of the file
      character(len=:), allocatable :: path
      !> Communicator of the ranks that write it
      class(communicator_t), allocatable :: comm
      !> Distribution of the rows of each group over ranks
      type(global_order_t) :: rows(size(groups))
      !> Whether the rows of each group are distributed; otherwise each column is complete on one rank
      logical :: is_spread(size(groups)) = .false.
   contains
      procedure :: create
      procedure :: set_rows
      procedure :: complete
      procedure :: open => open_checkpoint
      procedure :: close => close_checkpoint
      procedure :: read_origin
      procedure :: transfer_reals
      procedure :: transfer_longs
   end type checkpoint_file_t

contains

   !> Create a checkpoint. A failure is stored in component `error` of the serializer.
   subroutine create(self, path, provenance, comm, room)
      class(checkpoint_file_t), intent(inout) :: self
      !> Final path of the file; an older file of this name stays until `complete`
      character(len=*), intent(in) :: path
      !> Origin of the result
      type(provenance_t), intent(in) :: provenance
      !> Communicator of the ranks that write it; absent: this rank writes alone
      class(communicator_t), intent(in), optional :: comm
      !> Upper bound of the size of the data of all ranks [B]; default: 0
      integer(lp), intent(in), optional :: room
      integer(lp) :: bytes

      bytes = 0_lp
      if (present(room)) bytes = room
      self%path = path
      self%is_reading = .false.
      self%is_spread = .false.
      if (allocated(self%comm)) deallocate (self%comm)
      if (present(comm)) then
         allocate (self%comm, source=comm)
      else
         allocate (serial_communicator_t :: self%comm)
      end if
      if (self%comm%is_root()) call write_origin(self, provenance)
      call open_on_all_ranks(self%comm, self%file, path//unfinished, bytes, self%error)
   end subroutine create

   !> Create the file and write its attributes and provenance.
   subroutine write_origin(self, provenance)
      class(checkpoint_file_t), intent(inout) :: self
      type(provenance_t), intent(in) :: provenance

      call begin_file(self%file, self%path, self%error, with_checksum=.true.)
      if (allocated(self%error)) return
      call write_provenance(self%file, 'checkpoint by polydem', provenance, self%error)
   end subroutine write_origin

   !> Set the distribution of the rows of a group over ranks. Call it before the columns of the group are written.
   subroutine set_rows(self, group, rows)
      class(checkpoint_file_t), intent(inout) :: self
      !> /bodies/, /boxes/ or /pairs/
      character(len=*), intent(in) :: group
      !> Global order of the rows
      type(global_order_t), intent(in) :: rows
      integer :: k

      do k = 1, size(groups)
         if (groups(k) /= group) cycle
         self%rows(k) = rows
         self%is_spread(k) = .true.
      end do
   end subroutine set_rows

   !> Append the checksum, flush the file to disk and rename it to its final path. After a write error the file is
   !> removed. Collective; all ranks get the same error.
   subroutine complete(self, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> Reason why there is no checkpoint
      type(error_t), allocatable, intent(inout) :: error

      call complete_file(self%file, self%path, self%error, with_checksum=.true., comm=self%comm)
      if (allocated(self%error) .and. .not. allocated(error)) call move_alloc(self%error, error)
   end subroutine complete

   !> Open a checkpoint for reading.
   subroutine open_checkpoint(self, path, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Describes the damage if the checksum is wrong
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: problem

      self%path = path
      self%is_reading = .true.
      call verify_checksum(path, problem)
      if (allocated(problem)) then
         call raise(error, io_error, path//': is damaged: '//problem)
      else
         call self%file%open(path, error)
         if (.not. allocated(error)) call refuse_other_versions(self, error)
      end if
   end subroutine open_checkpoint

   !> Refuse a checkpoint of another version of the file layout. Close it in this case.
   subroutine refuse_other_versions(self, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> Allocated if the version differs
      type(error_t), allocatable, intent(inout) :: error
      real(dp) :: version

      version = 0.0_dp
      call self%file%read_real_attribute('/', 'schema_version', version, error)
      if (allocated(error)) return
      if (nint(version) == int(schema_version)) return
      call self%file%close(error)
      if (.not. allocated(error)) call raise(error, input_error, self%path//': has file layout '// &
         to_text(nint(version))//', but this version of polydem reads only layout '//to_text(schema_version)// &
         '; finish the run with the version that began it')
   end subroutine refuse_other_versions

   !> Close a checkpoint after reading.
   subroutine close_checkpoint(self, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> First read error, if any
      type(error_t), allocatable, intent(inout) :: error

      call self%file%close(self%error)
      if (allocated(self%error) .and. .not. allocated(error)) call move_alloc(self%error, error)
   end subroutine close_checkpoint

   !> Read the revision of the program that wrote an open checkpoint, and its settings.
   subroutine read_origin(self, revision, settings, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> Git commit of the program
      character(len=:), allocatable, intent(out) :: revision
      !> Resolved settings of the run, one per line
      character(len=:), allocatable, intent(out) :: settings
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error

      call self%file%read('/provenance/revision', revision, error)
      if (.not. allocated(error)) call self%file%read('/provenance/resolved_input', settings, error)
   end subroutine read_origin

   !> Write or read real numbers.
   subroutine transfer_reals(self, name, width, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      real(dp), allocatable :: table(:, :), list(:)

      if (.not. self%is_reading) then
         call write_reals(self, name, reshape(values, [width, size(values)/width]), unit, meaning)
      else
         if (width == 1) call self%file%read(name, list, self%error)
         if (width > 1) call self%file%read(name, table, self%error)
         if (width > 1 .and. .not. allocated(self%error)) list = reshape(table, [size(table)])
         if (allocated(self%error)) return
         call expect_size(self, name, size(list), size(values))
         if (.not. allocated(self%error)) values = list
      end if
   end subroutine transfer_reals

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
         call self%rows(k)%to_blocks(self%comm, values, block)
         part = part_t(self%rows(k)%first, self%rows(k)%total)
         if (size(values, 1) == 1) call self%file%write(name, component(block, 1), self%error, unit, meaning, part)
         if (size(values, 1) > 1) call self%file%write(name, block, self%error, unit, meaning, part)
      end if
   end subroutine write_reals

   !> Write rows of integers as a list. A row has several integers if these are the bits of a longer number. A rank
   !> without rows gets the width of a row by an all-reduce.
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
         call self%comm%all_reduce_max(width)
         call rows%to_blocks(self%comm, reshape(values, [width(1), int(rows%n_known, lp)]), block)
         call self%file%write(name, reshape(block, [size(block)]), self%error, unit, meaning, &
                              part_t(width(1)*rows%first, width(1)*rows%total))
      end associate
   end subroutine write_longs

   !> Index of the group of a column if its rows are distributed; otherwise 0
   pure integer function group_of(self, name)
      class(checkpoint_file_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer :: k

      group_of = 0
      do k = 1, size(groups)
         if (index(name, trim(groups(k))) == 1 .and. self%is_spread(k)) group_of = k
      end do
   end function group_of

   !> Write or read integers.
   subroutine transfer_longs(self, name, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: list(:)

      if (.not. self%is_reading) then
         call write_longs(self, name, values, unit, meaning)
      else
         call self%file%read(name, list, self%error)
         if (allocated(self%error)) return
         call expect_size(self, name, size(list), size(values))
         if (.not. allocated(self%error)) values = list
      end if
   end subroutine transfer_longs

   !> Raise an error if a data set has not the expected number of values.
   subroutine expect_size(self, name, found, wanted)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: found, wanted

      if (found /= wanted) call raise(self%error, input_error, self%path//': '//name//' has '// &
         to_text(int(found, ip))//' values, but this run needs '//to_text(int(wanted, ip))// &
         ': the bodies or the settings differ')
   end subroutine expect_size

end module polydem_checkpoint_file
