!> The manifest of a result: `manifest.txt`, a journal of the files that belong to the result. The program neither
!> changes nor removes any other file in the folder.
!>
!>     polydem-manifest 1 HASH
!>     owns NAME HASH                              the result may create, change and remove the file
!>     closed NAME BYTES FILEHASH HASH             the file is complete and final
!>     closed NAME BYTES FILEHASH FRAMES FIRST LAST HASH    the same for a segment of the trajectory, with the number
!>                                                 of frames and the steps of the first and the last frame
!>     removed NAME HASH                           the file no longer exists, and its name is free
!>
!> HASH links each line to the previous one (polydem_manifest_lines). A changed or missing line is therefore detected.
!> FILEHASH is the hash of all bytes of the file (`hash_file` of polydem_file_checksum). The last line of a file is the
!> valid one: `owns` after `closed` means that the file is about to be changed or removed.
!>
!> `owns` is on disk before the file is created. It also covers the temporary names NAME.unfinished and NAME.open.
!> `closed` is written after the file has its final name. A killed program may therefore leave a file with its final
!> name that is not closed, but never an unlisted file of the result. Segments, profile.h5, trace.h5, steps.h5 and
!> overlaps.csv are closed. log.txt, running.lock and the checkpoints, which have their own checksums, are not.
!>
!> Each line is written with one call and flushed to disk at once. A killed program may leave an incomplete last line.
!> A reader ignores it, and the next writer cuts it off.
module polydem_manifest
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_file_checksum, only: hash_file
   use polydem_file_system, only: remove_file, rename_file, sync_file
   use polydem_folders, only: link_exists, read_bytes
   use polydem_kinds, only: ip, lp
   use polydem_line_writer, only: line_writer_t
   use polydem_manifest_lines, only: chain_line, closing_text, entry_t, read_line
   use polydem_result_files, only: forms_of, conflict_text, manifest_name, name_in, unfinished
   use polydem_strings, only: to_text
   implicit none
   private
   public :: manifest_t

   !> First word of every manifest, and text of the first line in the version that this program supports
   character(len=*), parameter :: beginning = 'polydem-manifest', first_text = beginning//' 1'
   !> Line end
   character(len=*), parameter :: line_end = new_line('a')

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
      !> Whether its last line is incomplete
      logical :: is_truncated = .false.
      !> Number of files of the result
      integer :: n = 0
      !> Entries of the files, (1:n) in the order of their first `owns`; the array may be larger
      type(entry_t), allocatable :: entry(:)
      !> Folder of the result
      character(len=:), allocatable, private :: folder
      !> The valid lines
      character(len=:), allocatable, private :: text
      !> Hash of the last valid line
      integer(lp), private :: chain = 0_lp
      !> Whether the manifest is open for writing; otherwise no file is written or removed
      logical, private :: is_active = .false.
      !> Whether writing a line has failed
      logical, private :: has_failed = .false.
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
      procedure :: remove_entry
   end type manifest_t

contains

   !> Read the manifest of a folder, if there is one. No file is changed.
   subroutine read_manifest(self, folder)
      class(manifest_t), intent(inout) :: self
      !> Folder of the result
      character(len=*), intent(in) :: folder
      character(len=:), allocatable :: path, text, problem
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
         call read_lines(self, text, problem)
         if (allocated(problem)) self%problem = path//': '//problem
      end if
   end subroutine read_manifest

   !> Forget everything: the manifest of a folder without files.
   subroutine clear(self, folder)
      type(manifest_t), intent(out) :: self
      character(len=*), intent(in) :: folder

      self%folder = folder
      self%text = ''
      allocate (self%entry(16))
   end subroutine clear

   subroutine read_lines(self, text, problem)
      type(manifest_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      character(len=:), allocatable, intent(inout) :: problem
      character(len=:), allocatable :: line
      integer(ip) :: number
      integer :: first, last

      call chain_line(first_text, self%chain, line)
      self%is_foreign = text(:min(len(text), len(beginning))) /= beginning(:min(len(text), len(beginning)))
      if (self%is_foreign) then
         problem = 'this file is not a polydem manifest'
      else if (index(text, line//line_end) /= 1) then
         problem = 'the first line is not '//line//': the file was changed, or written by another version of polydem'
      end if
      if (allocated(problem)) return
      first = len(line) + 2
      number = 1_ip
      do
         last = index(text(first:), line_end)
         if (last == 0) exit
         number = number + 1_ip
         if (.not. is_accepted(self, text(first:first + last - 2))) then
            problem = 'line '//to_text(number)//' has a wrong hash: it was changed, or an earlier line is missing'
            return
         end if
         first = first + last
      end do
      self%text = text(:first - 1)
      self%is_truncated = first <= len(text)
      if (.not. self%is_truncated) return
      ! A killed program leaves part of a line, never a complete line followed by a character other than the line end.
      if (is_accepted(self, text(first:len(text) - 1))) problem = 'the line end of the last line was changed'
   end subroutine read_lines

   !> Apply a line to the list of entries. False if the line is invalid.
   logical function is_accepted(self, line)
      type(manifest_t), intent(inout) :: self
      character(len=*), intent(in) :: line
      character(len=:), allocatable :: verb
      type(entry_t) :: entry
      integer :: k

      call read_line(line, self%chain, verb, entry, is_accepted)
      if (.not. is_accepted) return
      k = self%place_of(trim(entry%name))
      select case (verb)
      case ('owns')
         if (k > 0) self%entry(k) = entry
         if (k == 0) call add_entry(self, entry)
      case ('closed')
         is_accepted = k > 0
         if (k > 0) self%entry(k) = entry
      case ('removed')
         is_accepted = k > 0
         if (k > 0) call drop_entry(self, k)
      case default
         is_accepted = .false.
      end select
   end function is_accepted

   subroutine add_entry(self, entry)
      type(manifest_t), intent(inout) :: self
      type(entry_t), intent(in) :: entry
      type(entry_t), allocatable :: more(:)

      if (self%n == size(self%entry)) then
         allocate (more(2*self%n))
         more(:self%n) = self%entry
         call move_alloc(more, self%entry)
      end if
      self%n = self%n + 1
      self%entry(self%n) = entry
   end subroutine add_entry

   subroutine drop_entry(self, k)
      type(manifest_t), intent(inout) :: self
      integer, intent(in) :: k

      self%entry(k:self%n - 1) = self%entry(k + 1:self%n)
      self%n = self%n - 1
   end subroutine drop_entry

   !> Create the manifest of a new result and write it. The folder must not have a manifest.
   subroutine begin(self, folder, names, error)
      class(manifest_t), intent(inout) :: self
      !> Folder of the result, which is locked
      character(len=*), intent(in) :: folder
      !> Names of the files that the result owns from the start, blank-padded
      character(len=*), intent(in) :: names(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: line
      integer :: k

      call clear(self, folder)
      call chain_line(first_text, self%chain, line)
      self%text = line//line_end
      do k = 1, size(names)
         call chain_line('owns '//trim(names(k)), self%chain, line)
         self%text = self%text//line//line_end
         call add_entry(self, entry_t(name=trim(names(k))))
      end do
      call write_whole(self, error)
      self%is_found = .not. allocated(error)
      self%is_active = self%is_found
   end subroutine begin

   !> Open for writing a manifest that was read. A no-op if it is missing or invalid.
   subroutine continue_writing(self)
      class(manifest_t), intent(inout) :: self

      self%is_active = self%is_found .and. .not. allocated(self%problem)
   end subroutine continue_writing

   !> Replace the file atomically by the valid lines.
   subroutine write_whole(self, error)
      type(manifest_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: file
      character(len=:), allocatable :: draft, path
      integer :: n

      path = self%folder//'/'//manifest_name
      if (link_exists(path//unfinished, error)) then
         call read_bytes(path//unfinished, draft, error)
         n = min(len(beginning), len(draft))
         if (draft(:n) /= beginning(:n)) call raise(error, input_error, conflict_text(path//unfinished))
      end if
      if (allocated(error)) return
      call file%open(path//unfinished, error)
      call file%put(self%text)
      call file%close(error)
      if (.not. allocated(error)) call sync_file(path//unfinished, error)
      if (.not. allocated(error)) call rename_file(path//unfinished, path, error)
      if (.not. allocated(error)) call sync_file(self%folder, error)
   end subroutine write_whole

   !> Append a line to the file and flush it to disk.
   subroutine append(self, text, error)
      type(manifest_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: file
      character(len=:), allocatable :: line, path

      path = self%folder//'/'//manifest_name
      if (self%has_failed) call raise(error, io_error, path//': writing an earlier line has failed')
      if (self%is_truncated .and. .not. allocated(error)) call write_whole(self, error)
      if (allocated(error)) return
      self%is_truncated = .false.
      self%has_failed = .true.
      call chain_line(text, self%chain, line)
      call file%open(path, error, appended=.true.)
      call file%put_line(line)
      call file%close(error)
      if (.not. allocated(error)) call sync_file(path, error)
      self%has_failed = allocated(error)
   end subroutine append

   !> Whether a file belongs to the result
   pure logical function owns(self, name)
      class(manifest_t), intent(in) :: self
      !> Final name of the file
      character(len=*), intent(in) :: name

      owns = self%place_of(name) > 0
   end function owns

   !> Index of a file in the list of entries; 0 if it does not belong to the result
   pure integer function place_of(self, name)
      class(manifest_t), intent(in) :: self
      !> Final name of the file
      character(len=*), intent(in) :: name

      do place_of = self%n, 1, -1
         if (self%entry(place_of)%name == name) return
      end do
   end function place_of

   !> Index of the entry of a file if a line about it can be written; else 0
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
      !> Allocated if a file of this name already exists, or if the line cannot be written
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
      if (.not. allocated(error)) call append(self, 'owns '//name_in(path), error)
      if (.not. allocated(error)) call add_entry(self, entry_t(name=name_in(path)))
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
      if (self%entry(k)%is_closed) call append(self, 'owns '//name_in(path), error)
      if (.not. allocated(error)) self%entry(k) = entry_t(name=name_in(path))
   end subroutine reopen

   !> Mark a file as final, with its length and hash. A no-op if the file does not exist.
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
      call hash_file(self%folder//'/'//trim(entry%name), entry%bytes, entry%hash, error)
      if (.not. allocated(error)) call append(self, closing_text(entry), error)
      if (.not. allocated(error)) self%entry(k) = entry
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

   !> Remove a name from the result. A file of this name no longer belongs to the result.
   subroutine remove_entry(self, path, error)
      class(manifest_t), intent(inout) :: self
      !> Final name of the file, with or without folder
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      k = writable_entry(self, path, error)
      if (k == 0) return
      call append(self, 'removed '//name_in(path), error)
      if (.not. allocated(error)) call drop_entry(self, k)
   end subroutine remove_entry

end module polydem_manifest
