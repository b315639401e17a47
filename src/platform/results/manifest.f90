!> The manifest of a result: `manifest.txt`, the list of the files that belong to the result. The program neither
!> changes nor removes any other file in the folder.
!>
!>     polydem-manifest 1, run 3f2a9c0d1b4e5f60
!>     log.txt                  open                 0 00000000         0               0               0
!>     trajectory_0001.h5       closed           19040 9a8b7c6d         3               0              20
!>     crc32 5a6b7c8d
!>
!> The run is an identifier that every HDF5 file of the result repeats, together with its own name, in `/provenance`.
!> Columns: name, state, and for a closed file its length in bytes and the CRC-32 of all bytes (polydem_crc32); for a
!> segment of the trajectory also the number of frames and the steps of the first and the last one. The last line is the
!> CRC-32 of the lines above it.
!>
!> An open file may be created, changed and removed by the run; this also covers the temporary names NAME.unfinished
!> and NAME.open. A closed file is complete and final. A file is listed as open before it is created, changed or
!> removed, and as closed after it has its final name. A killed program may therefore leave a file with its final name
!> that is not closed, but never an unlisted file of the result. Segments, profile.h5, trace.h5, steps.h5, series.csv
!> and overlaps.csv are closed. log.txt, running.lock and the checkpoints, which have their own checksums, stay open.
!>
!> Each change replaces the whole list atomically.
module polydem_manifest
   use polydem_crc32, only: crc32_of
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_checksum, only: sum_file
   use polydem_file_system, only: remove_file, rename_file, sync_file
   use polydem_folders, only: link_exists, read_bytes
   use polydem_hash, only: hexadecimal, mix_word
   use polydem_kinds, only: lp
   use polydem_line_writer, only: line_writer_t
   use polydem_posix_processes, only: c_getpid
   use polydem_result_files, only: forms_of, conflict_text, manifest_name, name_in, unfinished
   implicit none
   private
   public :: manifest_t, entry_t, longest_name

   !> Maximum length of the name of a file of a result
   integer, parameter :: longest_name = 24

   !> A file of a result
   type :: entry_t
      !> Name of the file, without folder
      character(len=longest_name) :: name = ''
      !> Whether the file is final; only then are the following components set
      logical :: is_closed = .false.
      !> Length of the file [B]
      integer(lp) :: bytes = 0_lp
      !> CRC-32 of all its bytes
      character(len=8) :: checksum = '00000000'
      !> For a segment: number of frames, step of the first frame, step of the last frame
      integer(lp) :: frames(3) = 0_lp
   end type entry_t

   !> The manifest of a folder
   type :: manifest_t
      !> Whether the folder has a manifest
      logical :: is_found = .false.
      !> Defect of the manifest, with its path; unallocated if it is valid
      character(len=:), allocatable :: problem
      !> Whether the file is not a polydem manifest at all
      logical :: is_foreign = .false.
      !> Whether the system refused to read it: nothing is known of its contents
      logical :: is_unread = .false.
      !> Identifier of the run
      character(len=16) :: run = ''
      !> Number of files of the result
      integer :: n = 0
      !> The files, (n) in the order in which they were added
      type(entry_t), allocatable :: entry(:)
      !> Folder of the result
      character(len=:), allocatable, private :: folder
      !> Whether the manifest is open for writing; otherwise no file is written or removed
      logical, private :: is_active = .false.
   contains
      procedure :: read => read_manifest
      procedure :: begin
      procedure :: continue_writing
      procedure :: owns
      procedure :: place_of
      procedure :: add_file
      procedure :: reopen
      procedure :: close_file
      procedure :: remove_file => remove_forms
      procedure :: remove_unfinished
      procedure :: remove_entry
   end type manifest_t

   !> First words of every manifest, and of one of the version that this program supports
   character(len=*), parameter :: beginning = 'polydem-manifest', first_words = beginning//' 1, run '
   !> First word of the last line
   character(len=*), parameter :: last_word = 'crc32 '
   !> A line without its end
   character(len=*), parameter :: form = '(a, 1x, a6, 1x, i15, 1x, a8, 1x, i9, 2(1x, i15))'
   !> Length of such a line
   integer, parameter :: line_length = longest_name + 7 + 16 + 9 + 10 + 2*16
   !> Line end
   character(len=*), parameter :: line_end = new_line('a')

contains

   !> Read the manifest of a folder, if there is one. No file is changed.
   subroutine read_manifest(self, folder)
      class(manifest_t), intent(inout) :: self
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path, text
      type(error_t), allocatable :: error

      path = folder//'/'//manifest_name
      call clear(self, folder)
      self%is_found = link_exists(path, error)
      if (self%is_found) call read_bytes(path, text, error)
      self%is_unread = allocated(error)
      if (self%is_unread) then
         self%is_found = .true.
         self%problem = error%message
      else if (self%is_found) then
         self%is_foreign = .not. is_draft(text)
         if (self%is_foreign) then
            self%problem = path//': this file is not a polydem manifest'
         else if (.not. is_valid(text)) then
            self%problem = path//': the file was truncated or changed, or written by another version of polydem'
         else
            call read_lines(self, text)
         end if
      end if
   end subroutine read_manifest

   !> Forget everything: the manifest of a folder without files.
   subroutine clear(self, folder)
      type(manifest_t), intent(out) :: self
      character(len=*), intent(in) :: folder

      self%folder = folder
      allocate (self%entry(0))
   end subroutine clear

   !> Whether a text is a manifest, or the beginning of one
   pure logical function is_draft(text)
      character(len=*), intent(in) :: text
      integer :: n

      n = min(len(text), len(beginning))
      is_draft = text(:n) == beginning(:n)
   end function is_draft

   !> Whether a text is a complete manifest of this version without a changed bit
   pure logical function is_valid(text)
      character(len=*), intent(in) :: text
      integer :: n

      n = len(text) - len(last_word) - 9
      is_valid = index(text, first_words) == 1 .and. n > 0
      if (is_valid) is_valid = text(n + 1:) == last_word//crc32_of(text(:n))//line_end
   end function is_valid

   !> Read the run and the files from a valid text.
   subroutine read_lines(self, text)
      type(manifest_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      character(len=6) :: state
      integer :: first, k

      self%run = text(len(first_words) + 1:)
      first = index(text, line_end) + 1
      self%n = (len(text) - first)/(line_length + 1)
      deallocate (self%entry)
      allocate (self%entry(self%n))
      do k = 1, self%n
         associate (entry => self%entry(k))
            read (text(first:first + line_length - 1), form) entry%name, state, entry%bytes, entry%checksum, &
               entry%frames
            entry%is_closed = adjustl(state) == 'closed'
         end associate
         first = first + line_length + 1
      end do
   end subroutine read_lines

   !> Create the manifest of a new result and write it. The folder must not have a manifest.
   subroutine begin(self, folder, names, error)
      class(manifest_t), intent(inout) :: self
      !> Folder of the result, which is locked
      character(len=*), intent(in) :: folder
      !> Names of the files that the result owns from the start, blank-padded
      character(len=*), intent(in) :: names(:)
      type(error_t), allocatable, intent(inout) :: error
      type(entry_t), allocatable :: entry(:)
      integer(lp) :: clock
      integer :: k

      call clear(self, folder)
      call system_clock(clock)
      self%run = hexadecimal(mix_word(clock, int(c_getpid(), lp)))
      entry = [(entry_t(name=names(k)), k=1, size(names))]
      self%is_active = .true.
      call replace_list(self, entry, error)
      self%is_found = .not. allocated(error)
      self%is_active = self%is_found
   end subroutine begin

   !> Open for writing a manifest that was read. A no-op if it is missing or invalid.
   subroutine continue_writing(self)
      class(manifest_t), intent(inout) :: self

      self%is_active = self%is_found .and. .not. allocated(self%problem)
   end subroutine continue_writing

   !> Replace the list atomically, in the file and in memory. Nothing changes after a failure.
   subroutine replace_list(self, entry, error)
      type(manifest_t), intent(inout) :: self
      !> The new list
      type(entry_t), intent(in) :: entry(:)
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: file
      character(len=:), allocatable :: draft, path, text

      path = self%folder//'/'//manifest_name
      if (link_exists(path//unfinished, error)) then
         call read_bytes(path//unfinished, draft, error)
         if (.not. is_draft(draft)) call raise(error, input_error, conflict_text(path//unfinished))
      end if
      if (allocated(error)) return
      text = first_words//self%run//line_end//lines_of(entry)
      call file%open(path//unfinished, error)
      call file%put(text//last_word//crc32_of(text)//line_end)
      call file%close(error)
      if (.not. allocated(error)) call sync_file(path//unfinished, error)
      if (.not. allocated(error)) call rename_file(path//unfinished, path, error)
      if (.not. allocated(error)) call sync_file(self%folder, error)
      if (allocated(error)) return
      self%entry = entry
      self%n = size(entry)
   end subroutine replace_list

   !> The lines of files
   pure function lines_of(entry) result(text)
      type(entry_t), intent(in) :: entry(:)
      character(len=(line_length + 1)*size(entry)) :: text
      character(len=line_length) :: line
      integer :: k

      do k = 1, size(entry)
         associate (e => entry(k))
            write (line, form) e%name, merge('closed', 'open  ', e%is_closed), e%bytes, e%checksum, e%frames
         end associate
         text((line_length + 1)*(k - 1) + 1:(line_length + 1)*k) = line//line_end
      end do
   end function lines_of

   !> Replace the entry of a file.
   subroutine replace_entry(self, k, entry, error)
      type(manifest_t), intent(inout) :: self
      !> Index of the entry
      integer, intent(in) :: k
      type(entry_t), intent(in) :: entry
      type(error_t), allocatable, intent(inout) :: error

      call replace_list(self, [self%entry(:k - 1), entry, self%entry(k + 1:)], error)
   end subroutine replace_entry

   !> Whether a file belongs to the result
   pure logical function owns(self, name)
      class(manifest_t), intent(in) :: self
      !> Final name of the file
      character(len=*), intent(in) :: name

      owns = self%place_of(name) > 0
   end function owns

   !> Index of a file in the list; 0 if it does not belong to the result
   pure integer function place_of(self, name)
      class(manifest_t), intent(in) :: self
      !> Final name of the file
      character(len=*), intent(in) :: name

      do place_of = self%n, 1, -1
         if (self%entry(place_of)%name == name) return
      end do
   end function place_of

   !> Index of the entry of a file if it can be changed; else 0
   pure integer function writable_entry(self, path, error) result(k)
      type(manifest_t), intent(in) :: self
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(in) :: error

      k = 0
      if (self%is_active .and. .not. allocated(error)) k = self%place_of(name_in(path))
   end function writable_entry

   !> Add a file to the result, before the file is created. A no-op if the result already owns it.
   subroutine add_file(self, path, error)
      class(manifest_t), intent(inout) :: self
      !> Final name of the file, with or without folder
      character(len=*), intent(in) :: path
      !> Allocated if a file of this name already exists, or if the list cannot be written
      type(error_t), allocatable, intent(inout) :: error
      character(len=len(path) + len(unfinished)) :: forms(3)
      integer :: k

      if (.not. self%is_active .or. allocated(error)) return
      if (self%owns(name_in(path))) return
      forms = forms_of(name_in(path))
      do k = 1, size(forms)
         if (link_exists(self%folder//'/'//trim(forms(k)), error)) call raise(error, input_error, &
            conflict_text(self%folder//'/'//trim(forms(k))))
      end do
      if (.not. allocated(error)) call replace_entry(self, self%n + 1, entry_t(name=name_in(path)), error)
   end subroutine add_file

   !> Mark a closed file as about to be changed. A no-op if the file is not closed.
   subroutine reopen(self, path, error)
      class(manifest_t), intent(inout) :: self
      !> Final name of the file, with or without folder
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      k = writable_entry(self, path, error)
      if (k == 0) return
      if (self%entry(k)%is_closed) call replace_entry(self, k, entry_t(name=name_in(path)), error)
   end subroutine reopen

   !> Flush a file to disk, and mark it as final, with its length and checksum. A no-op if the file does not exist.
   subroutine close_file(self, path, error, frames)
      class(manifest_t), intent(inout) :: self
      !> Final name of the file, with or without folder
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      !> For a segment: number of frames, step of the first frame, step of the last frame
      integer(lp), intent(in), optional :: frames(3)
      type(entry_t) :: entry
      integer :: k

      k = writable_entry(self, path, error)
      if (k == 0) return
      entry = entry_t(name=name_in(path), is_closed=.true.)
      if (.not. link_exists(self%folder//'/'//trim(entry%name), error)) return
      if (present(frames)) entry%frames = frames
      ! After a loss of power the file must be as the list says.
      call sync_file(self%folder//'/'//trim(entry%name), error)
      if (allocated(error)) return
      call sum_file(self%folder//'/'//trim(entry%name), entry%bytes, entry%checksum, error)
      if (.not. allocated(error)) call replace_entry(self, k, entry, error)
   end subroutine close_file

   !> Remove the temporary forms of a file of the result, and the file itself unless `stays`. The result keeps the name.
   subroutine remove_forms(self, path, error, stays)
      class(manifest_t), intent(inout) :: self
      !> Final name of the file, with or without folder
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      !> Whether the file with its final name stays; default: false
      logical, intent(in), optional :: stays
      character(len=len(path) + len(unfinished)) :: forms(3)
      integer :: k, first

      if (.not. self%is_active .or. .not. self%owns(name_in(path))) return
      first = 1
      if (present(stays)) first = merge(2, 1, stays)
      if (first == 1) call self%reopen(path, error)
      forms = forms_of(name_in(path))
      do k = first, size(forms)
         if (allocated(error)) return
         if (.not. link_exists(self%folder//'/'//trim(forms(k)), error)) cycle
         call remove_file(self%folder//'/'//trim(forms(k)), error)
      end do
   end subroutine remove_forms

   !> Remove the unfinished forms of all files of the list.
   subroutine remove_unfinished(self, error)
      class(manifest_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, self%n
         if (.not. allocated(error)) call self%remove_file(trim(self%entry(k)%name), error, stays=.true.)
      end do
   end subroutine remove_unfinished

   !> Remove a name from the result. A file of this name no longer belongs to the result.
   subroutine remove_entry(self, path, error)
      class(manifest_t), intent(inout) :: self
      !> Final name of the file, with or without folder
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      k = writable_entry(self, path, error)
      if (k > 0) call replace_list(self, [self%entry(:k - 1), self%entry(k + 1:)], error)
   end subroutine remove_entry

end module polydem_manifest
