!> Checkpoint files: the state that a bitwise identical restart needs, in an atomic file (polydem_atomic_file).
!>
!>     /run         step, time step, energy balance, clocks and counters of the whole run
!>     /bodies      id, mass and state: one row per body, in ascending order of identifiers
!>     /pieces      number of corners: one row per polygon, in the order of the bodies
!>     /vertices    position in the body frame: one row per vertex, in the order of the pieces
!>     /pairs       first, second (identifiers) and contact history of each pair of the last search
!>     /provenance  origin of the file
!>
!> The caller defines the contents of the groups with `field` and `match`. The file ends with a checksum and is opened
!> only if the checksum is correct.
!>
!> All ranks write a checkpoint collectively. The root rank writes /run; in the other groups each rank writes the rows
!> that `set_rows` assigns to it. All ranks open and close it together to read it. In between each rank reads by itself
!> what it needs: /run, and the rows that `choose_rows` names.
module polydem_checkpoint_file
   use polydem_atomic_file, only: begin_file, complete_file, open_on_all_ranks
   use polydem_communicator, only: choose_communicator, communicator_t
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_file_checksum, only: verify_checksum
   use polydem_row_distribution, only: component, row_distribution_t
   use polydem_hdf5_file, only: hdf5_file_t, part_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_provenance, only: provenance_t, write_provenance, schema_version
   use polydem_result_files, only: unfinished
   use polydem_serializer, only: serializer_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: checkpoint_file_t

   !> Groups with distributed rows
   character(len=*), parameter :: groups(4) = [character(len=10) :: '/bodies/', '/pieces/', '/vertices/', '/pairs/']
   !> Greatest number of rows that are read at once
   integer(lp), parameter :: most_rows = 65536_lp

   !> Rows of a group that a rank reads
   type :: chosen_rows_t
      !> Their numbers from 1, ascending; unallocated: all rows
      integer(lp), allocatable :: row(:)
   end type chosen_rows_t

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
      type(row_distribution_t) :: rows(size(groups))
      !> Whether the rows of each group are distributed; otherwise each column is complete on one rank
      logical :: is_spread(size(groups)) = .false.
      !> Rows of each group to read
      type(chosen_rows_t) :: chosen(size(groups))
   contains
      procedure :: create
      procedure :: set_rows
      procedure :: complete
      procedure :: open => open_checkpoint
      procedure :: close => close_checkpoint
      procedure :: read_origin
      procedure :: count_rows
      procedure :: choose_rows
      procedure :: transfer_reals
      procedure :: transfer_longs
   end type checkpoint_file_t

contains

   !> Create a checkpoint. A failure is stored in component `error` of the serializer.
   subroutine create(self, path, provenance, comm, room)
      class(checkpoint_file_t), intent(inout) :: self
      !> Final path of the file; an older file of this name stays until `complete`
      character(len=*), intent(in) :: path
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
      call choose_communicator(self%comm, comm)
      if (self%comm%is_root()) then
         call begin_file(self%file, path, self%error, with_checksum=.true.)
         call write_provenance(self%file, 'checkpoint by polydem', provenance, self%error)
      end if
      call open_on_all_ranks(self%comm, self%file, path//unfinished, bytes, self%error)
   end subroutine create

   !> Set the distribution of the rows of a group over ranks. Call it before the columns of the group are written.
   subroutine set_rows(self, group, rows)
      class(checkpoint_file_t), intent(inout) :: self
      !> Name of the group, such as /pairs/
      character(len=*), intent(in) :: group
      !> Global order of the rows
      type(row_distribution_t), intent(in) :: rows
      integer :: k

      k = place_of(group)
      self%rows(k) = rows
      self%is_spread(k) = .true.
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

   !> Open a checkpoint for reading. Collective; all ranks get the same error.
   subroutine open_checkpoint(self, path, error, comm)
      class(checkpoint_file_t), intent(inout) :: self
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Describes the damage if the checksum is wrong
      type(error_t), allocatable, intent(inout) :: error
      !> Communicator of the ranks that read it; absent: this rank reads alone
      class(communicator_t), intent(in), optional :: comm
      character(len=:), allocatable :: problem

      self%path = path
      self%is_reading = .true.
      call choose_communicator(self%comm, comm)
      if (self%comm%is_root()) call verify_checksum(path, problem, error)
      if (allocated(problem)) call raise(error, io_error, path//': is damaged: '//problem)
      call self%comm%all_reduce_error(error)
      if (.not. allocated(error)) then
         call self%file%open(path, error)
         if (.not. allocated(error)) call refuse_other_versions(self, error)
      end if
      call self%comm%all_reduce_error(error)
   end subroutine open_checkpoint

   !> Number of rows of a column in the file
   subroutine count_rows(self, name, n)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(out) :: n
      integer(lp), allocatable :: extent(:)

      n = 0_lp
      if (allocated(self%error)) return
      call self%file%shape_of(name, extent, self%error)
      if (.not. allocated(self%error)) n = product(extent(:min(1, size(extent))))
   end subroutine count_rows

   !> Choose the rows of a group that are read next.
   subroutine choose_rows(self, group, rows)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: group
      integer(lp), intent(in) :: rows(:)

      self%chosen(place_of(group))%row = rows
   end subroutine choose_rows

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

   !> Close a checkpoint after reading. Collective; all ranks get the same error.
   subroutine close_checkpoint(self, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> First read error, if any
      type(error_t), allocatable, intent(inout) :: error

      call self%file%close(self%error)
      if (allocated(self%error) .and. .not. allocated(error)) call move_alloc(self%error, error)
      call self%comm%all_reduce_error(error)
   end subroutine close_checkpoint

   !> Read the revision of the program that wrote an open checkpoint, and its settings.
   subroutine read_origin(self, revision, settings, error)
      class(checkpoint_file_t), intent(inout) :: self
      !> Git commit of the program
      character(len=:), allocatable, intent(out) :: revision
      !> Resolved settings of the run, one per line
      character(len=:), allocatable, intent(out) :: settings
      type(error_t), allocatable, intent(inout) :: error

      call self%file%read('/provenance/revision', revision, error)
      call self%file%read('/provenance/resolved_input', settings, error)
   end subroutine read_origin

   !> Write or read real numbers.
   subroutine transfer_reals(self, name, width, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      real(dp), allocatable :: table(:, :), list(:)
      integer(lp), allocatable :: row(:)
      integer :: k, first, last

      if (.not. self%is_reading) then
         call write_reals(self, name, width, size(values)/width, values, unit, meaning)
         return
      end if
      call list_rows(self, name, 1, size(values)/width, row)
      last = 0
      do while (last < size(row) .and. .not. allocated(self%error))
         first = last + 1
         last = last_of_part(row, first)
         associate (rows => [row(first) - 1_lp, row(last) - row(first) + 1_lp])
            if (width == 1) then
               call self%file%read(name, list, self%error, rows)
            else
               call self%file%read(name, table, self%error, rows)
               if (.not. allocated(self%error)) call expect_size(self, name, size(table, 1), width)
               if (.not. allocated(self%error)) list = reshape(table, [size(table)])
            end if
         end associate
         if (allocated(self%error)) return
         do k = first, last
            associate (before => width*int(row(k) - row(first)))
               values(width*(k - 1) + 1:width*k) = list(before + 1:before + width)
            end associate
         end do
      end do
   end subroutine transfer_reals

   !> Write or read integers. Rows of several integers are stored one after the other in a list.
   subroutine transfer_longs(self, name, width, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: row(:), list(:)
      integer :: k, first, last

      if (.not. self%is_reading) then
         call write_longs(self, name, width, size(values)/width, values, unit, meaning)
         return
      end if
      call list_rows(self, name, width, size(values)/width, row)
      last = 0
      do while (last < size(row) .and. .not. allocated(self%error))
         first = last + 1
         last = last_of_part(row, first)
         call self%file%read(name, list, self%error, width*[row(first) - 1_lp, row(last) - row(first) + 1_lp])
         if (allocated(self%error)) return
         do k = first, last
            associate (before => width*int(row(k) - row(first)))
               values(width*(k - 1) + 1:width*k) = list(before + 1:before + width)
            end associate
         end do
      end do
   end subroutine transfer_longs

   !> List the rows of a column to read: the chosen ones, or all.
   subroutine list_rows(self, name, entries, wanted, row)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      !> Number of entries of the data set along its slowest dimension that make a row
      integer, intent(in) :: entries
      !> Number of rows that the caller needs
      integer, intent(in) :: wanted
      !> Numbers of the rows, ascending
      integer(lp), allocatable, intent(out) :: row(:)
      integer(lp) :: n, j
      integer :: k

      k = place_of(name)
      if (k > 0) then
         if (allocated(self%chosen(k)%row)) row = self%chosen(k)%row
      end if
      ! Also a column of which no row is read must be there, and in this file.
      if (.not. allocated(row) .or. wanted == 0) call self%count_rows(name, n)
      if (.not. allocated(row)) then
         if (.not. allocated(self%error)) call expect_size(self, name, int(n), entries*wanted)
         row = [(j, j=1_lp, int(wanted, lp))]
      end if
      if (.not. allocated(self%error)) call expect_size(self, name, size(row), wanted)
   end subroutine list_rows

   !> Last of the rows that are read at once with a row: those behind it that lie close to it. The rows between them are
   !> dropped.
   pure integer function last_of_part(row, first) result(last)
      !> Numbers of the rows, ascending
      integer(lp), intent(in) :: row(:)
      !> Index of the first row to read
      integer, intent(in) :: first

      last = first
      do while (last < size(row))
         if (row(last + 1) - row(first) >= most_rows) exit
         last = last + 1
      end do
   end function last_of_part

   !> Write rows of real numbers.
   subroutine write_reals(self, name, width, n, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name, unit, meaning
      !> Numbers per row, and number of rows
      integer, intent(in) :: width, n
      real(dp), intent(in) :: values(width, n)
      real(dp), allocatable :: block(:, :)
      type(part_t) :: part
      integer :: k

      k = group_of(self, name)
      if (k == 0 .and. width == 1) then
         call self%file%write(name, component(values, 1), self%error, unit, meaning)
      else if (k == 0) then
         call self%file%write(name, values, self%error, unit, meaning)
      else
         call self%rows(k)%to_blocks(self%comm, values, block)
         part = part_t(self%rows(k)%first, self%rows(k)%total)
         if (width == 1) call self%file%write(name, component(block, 1), self%error, unit, meaning, part)
         if (width > 1) call self%file%write(name, block, self%error, unit, meaning, part)
      end if
   end subroutine write_reals

   !> Write rows of integers as a list.
   subroutine write_longs(self, name, width, n, values, unit, meaning)
      class(checkpoint_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name, unit, meaning
      !> Integers per row, and number of rows
      integer, intent(in) :: width, n
      integer(lp), intent(in) :: values(width, n)
      integer(lp), allocatable :: block(:, :)
      integer :: k

      k = group_of(self, name)
      if (k == 0) then
         call self%file%write(name, reshape(values, [width*n]), self%error, unit, meaning)
         return
      end if
      associate (rows => self%rows(k))
         call rows%to_blocks(self%comm, values, block)
         call self%file%write(name, reshape(block, [size(block)]), self%error, unit, meaning, &
                              part_t(width*rows%first, width*rows%total))
      end associate
   end subroutine write_longs

   !> Index of the group of a column if its rows are distributed; otherwise 0
   pure integer function group_of(self, name)
      class(checkpoint_file_t), intent(in) :: self
      character(len=*), intent(in) :: name

      group_of = place_of(name)
      if (group_of > 0) group_of = merge(group_of, 0, self%is_spread(group_of))
   end function group_of

   !> Index of the group of a column in `groups`; 0: none of them
   pure integer function place_of(name)
      character(len=*), intent(in) :: name
      integer :: k

      place_of = 0
      do k = 1, size(groups)
         if (index(name, trim(groups(k))) == 1) place_of = k
      end do
   end function place_of

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
