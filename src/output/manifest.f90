!> The manifest of a result: `manifest.txt`, a journal of the files that belong to it. Whatever else is in the folder is
!> somebody else's, and is neither changed nor removed.
!>
!>     polydem-manifest 1 HASH
!>     owns NAME HASH                              the result may make, change and remove the file
!>     closed NAME BYTES FILEHASH HASH             the file is complete and will not change any more
!>     closed NAME BYTES FILEHASH FRAMES FIRST LAST HASH    the same of a segment of the trajectory, with the number of
!>                                                 its frames and the steps of the first and the last one
!>     removed NAME HASH                           the file is gone, and the name is free
!>
!> HASH makes each line hang on the one before (polydem_manifest_lines), so a line that was changed, or lost between
!> others, is found. FILEHASH is the hash of all bytes of the file (`hash_file` of polydem_sealed_file). The last line
!> about a file holds: `owns` after `closed` says that the file is about to be changed or removed.
!>
!> `owns` is on the disk before the file is made, and stands for the names that the file has before it is complete as
!> well, NAME.unfinished and NAME.open. `closed` comes when the file has its name. So a kill leaves a file with its name
!> that is not closed, but never a file of the result that the manifest does not know. Segments, profile.h5, trace.h5,
!> steps.h5 and overlaps.csv get closed; log.txt, running.lock, the folder `replaced` (polydem_replaced) and the
!> checkpoints, which have seals of their own, do not.
!>
!> A line is written with one call and brought to disk at once. Of the last one a kill may leave a part without an end,
!> which is ignored, and cut off by the next one who writes.
module polydem_manifest
   use polydem_errors, only: error_t, input_error, io_error, raise
   use polydem_folders, only: is_there, read_bytes
   use polydem_kinds, only: ip, lp
   use polydem_line_writer, only: line_writer_t
   use polydem_manifest_lines, only: chain_line, closing_text, entry_t, read_line
   use polydem_name_forms, only: forms_of, in_the_way, manifest_name
   use polydem_paths, only: remove_file, rename_file, sync_file
   use polydem_result_folder, only: name_in, unfinished
   use polydem_sealed_file, only: hash_file
   use polydem_strings, only: to_text
   implicit none
   private
   public :: manifest_t

   !> How every manifest begins, and what the first line of one that this program understands says
   character(len=*), parameter :: beginning = 'polydem-manifest', first_text = beginning//' 1'
   !> End of a line
   character(len=*), parameter :: line_end = new_line('a')

   !> The manifest of a folder
   type :: manifest_t
      !> Whether there is one
      logical :: is_found = .false.
      !> What is wrong with it; not allocated if nothing is
      character(len=:), allocatable :: problem
      !> Whether it is the file of somebody else
      logical :: is_foreign = .false.
      !> Whether its last line was left in the middle
      logical :: is_torn = .false.
      !> Number of files of the result
      integer :: n = 0
      !> The files, in the order in which the result came to own them; there may be room for more
      type(entry_t), allocatable :: entry(:)
      !> Folder of the result
      character(len=:), allocatable, private :: folder
      !> Its good lines
      character(len=:), allocatable, private :: text
      !> Hash of the last of them
      integer(lp), private :: chain = 0_lp
      !> Whether it is written to; if not, nothing is ever written or removed
      logical, private :: is_active = .false.
      !> Whether a line could not be written
      logical, private :: is_spoilt = .false.
   contains
      procedure :: read => read_manifest
      procedure :: begin
      procedure :: take_up
      procedure :: owns
      procedure :: place_of
      procedure :: own
      procedure :: reopen
      procedure :: close_file
      procedure :: empty
      procedure :: forget
   end type manifest_t

contains

   !> Read the manifest of a folder, if there is one; changes nothing.
   subroutine read_manifest(self, folder, name)
      class(manifest_t), intent(inout) :: self
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Name of the file; manifest.txt if absent
      character(len=*), intent(in), optional :: name
      character(len=:), allocatable :: path, text, problem

      path = folder//'/'//manifest_name
      if (present(name)) path = folder//'/'//name
      self%folder = folder
      self%text = ''
      self%chain = 0_lp
      self%is_active = .false.
      self%is_spoilt = .false.
      self%is_torn = .false.
      self%is_foreign = .false.
      if (allocated(self%problem)) deallocate (self%problem)
      self%n = 0
      if (.not. allocated(self%entry)) allocate (self%entry(16))
      self%is_found = is_there(path)
      if (.not. self%is_found) return
      call read_bytes(path, text, problem)
      if (.not. allocated(problem)) call read_lines(self, text, problem)
      if (.not. allocated(problem)) return
      self%problem = path//': '//problem
   end subroutine read_manifest

   subroutine read_lines(self, text, problem)
      type(manifest_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      character(len=:), allocatable, intent(inout) :: problem
      character(len=:), allocatable :: line
      integer(lp) :: chain
      integer(ip) :: number
      integer :: first, last

      chain = 0_lp
      call chain_line(first_text, chain, line)
      self%is_foreign = text(:min(len(text), len(beginning))) /= beginning(:min(len(text), len(beginning)))
      if (self%is_foreign) then
         problem = 'is no manifest of this program'
      else if (index(text, line//line_end) /= 1) then
         problem = 'its first line is not '//line//': it was changed, or made by another version of this program'
      end if
      if (allocated(problem)) return
      self%chain = chain
      first = len(line) + 2
      number = 1_ip
      do
         last = index(text(first:), line_end)
         if (last == 0) exit
         number = number + 1_ip
         if (.not. is_taken(self, text(first:first + last - 2))) then
            problem = 'line '//to_text(number)//' is not what was written, or a line before it is missing'
            return
         end if
         first = first + last
      end do
      self%text = text(:first - 1)
      self%is_torn = first <= len(text)
      if (.not. self%is_torn) return
      ! A part of a line is what a kill leaves. A whole one with something else than its end is not.
      if (is_taken(self, text(first:len(text) - 1))) problem = 'the end of its last line is not what was written'
   end subroutine read_lines

   !> Take in what a line says, if it is a good one.
   logical function is_taken(self, line)
      type(manifest_t), intent(inout) :: self
      character(len=*), intent(in) :: line
      character(len=:), allocatable :: verb
      type(entry_t) :: entry
      integer :: k

      call read_line(line, self%chain, verb, entry, is_taken)
      if (.not. is_taken) return
      k = self%place_of(trim(entry%name))
      select case (verb)
      case ('owns')
         if (k > 0) self%entry(k) = entry
         if (k == 0) call add_entry(self, entry)
      case ('closed')
         is_taken = k > 0
         if (k > 0) self%entry(k) = entry
      case ('removed')
         is_taken = k > 0
         if (k > 0) call drop_entry(self, k)
      case default
         is_taken = .false.
      end select
   end function is_taken

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

   !> Begin the manifest of a new result, which owns some files from the start; there must be none.
   subroutine begin(self, folder, names, error)
      class(manifest_t), intent(inout) :: self
      !> Folder of the result, which is locked
      character(len=*), intent(in) :: folder
      !> Names of the files, blank-padded
      character(len=*), intent(in) :: names(:)
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: line
      integer :: k

      self%folder = folder
      self%is_torn = .false.
      self%is_spoilt = .false.
      self%chain = 0_lp
      self%n = 0
      if (.not. allocated(self%entry)) allocate (self%entry(16))
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

   !> Go on writing to a good manifest that was read.
   subroutine take_up(self)
      class(manifest_t), intent(inout) :: self

      self%is_active = self%is_found .and. .not. allocated(self%problem)
   end subroutine take_up

   !> Write the good lines at once, in place of what is there.
   subroutine write_whole(self, error)
      type(manifest_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: file
      character(len=:), allocatable :: draft, problem, path
      integer :: n

      path = self%folder//'/'//manifest_name
      if (is_there(path//unfinished)) then
         call read_bytes(path//unfinished, draft, problem)
         n = min(len(beginning), len(draft))
         if (draft(:n) /= beginning(:n)) call raise(error, input_error, in_the_way(path//unfinished))
         if (allocated(error)) return
      end if
      call file%open(path//unfinished, error)
      call file%put(self%text)
      call file%close(error)
      if (.not. allocated(error)) call sync_file(path//unfinished, error)
      if (.not. allocated(error)) call rename_file(path//unfinished, path, error)
      if (.not. allocated(error)) call sync_file(self%folder, error)
   end subroutine write_whole

   !> Write a line behind the others.
   subroutine append(self, text, error)
      type(manifest_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: file
      character(len=:), allocatable :: line, path

      path = self%folder//'/'//manifest_name
      if (self%is_spoilt) call raise(error, io_error, path//': a line could not be written')
      if (self%is_torn .and. .not. allocated(error)) call write_whole(self, error)
      if (allocated(error)) return
      self%is_torn = .false.
      self%is_spoilt = .true.
      call chain_line(text, self%chain, line)
      call file%open(path, error, appended=.true.)
      call file%put_line(line)
      call file%close(error)
      if (.not. allocated(error)) call sync_file(path, error)
      self%is_spoilt = allocated(error)
   end subroutine append

   !> Whether a file belongs to the result
   pure logical function owns(self, name)
      class(manifest_t), intent(in) :: self
      !> Its name when it is complete
      character(len=*), intent(in) :: name

      owns = self%place_of(name) > 0
   end function owns

   !> Place of a file in the list of entries; 0 if it does not belong to the result
   pure integer function place_of(self, name)
      class(manifest_t), intent(in) :: self
      !> Its name when it is complete
      character(len=*), intent(in) :: name
      integer :: k

      place_of = 0
      do k = self%n, 1, -1
         if (self%entry(k)%name == name) place_of = k
         if (place_of > 0) exit
      end do
   end function place_of

   !> Make a name one of the result, before its file is made; nothing happens if it is one.
   subroutine own(self, path, error)
      class(manifest_t), intent(inout) :: self
      !> The name, also with the folder before it
      character(len=*), intent(in) :: path
      !> Allocated if there is a file of this name, or on failure
      type(error_t), allocatable, intent(inout) :: error
      character(len=len(path) + len(unfinished)) :: forms(3)
      integer :: k

      if (.not. self%is_active .or. allocated(error)) return
      if (self%owns(name_in(path))) return
      forms = forms_of(name_in(path))
      do k = 1, size(forms)
         if (is_there(self%folder//'/'//trim(forms(k)))) call raise(error, input_error, &
            in_the_way(self%folder//'/'//trim(forms(k))))
      end do
      if (.not. allocated(error)) call append(self, 'owns '//name_in(path), error)
      if (.not. allocated(error)) call add_entry(self, entry_t(name=name_in(path)))
   end subroutine own

   !> Say that a closed file is about to be changed; nothing happens if it is not closed.
   subroutine reopen(self, path, error)
      class(manifest_t), intent(inout) :: self
      !> Its name, also with the folder before it
      character(len=*), intent(in) :: path
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      k = self%place_of(name_in(path))
      if (k == 0 .or. .not. self%is_active .or. allocated(error)) return
      if (self%entry(k)%is_closed) call append(self, 'owns '//name_in(path), error)
      if (.not. allocated(error)) self%entry(k) = entry_t(name=name_in(path))
   end subroutine reopen

   !> Write down length and hash of a file that will not change any more; nothing happens if it is not there.
   subroutine close_file(self, path, error, frames)
      class(manifest_t), intent(inout) :: self
      !> Its name, also with the folder before it
      character(len=*), intent(in) :: path
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      !> Of a segment: the number of frames, and the steps of the first and the last one
      integer(lp), intent(in), optional :: frames(3)
      type(entry_t) :: entry
      character(len=:), allocatable :: problem
      integer :: k

      k = self%place_of(name_in(path))
      if (k == 0 .or. .not. self%is_active .or. allocated(error)) return
      entry = entry_t(name=name_in(path), is_closed=.true.)
      if (.not. is_there(self%folder//'/'//trim(entry%name))) return
      if (present(frames)) entry%frames = frames
      call hash_file(self%folder//'/'//trim(entry%name), entry%bytes, entry%hash, problem)
      if (allocated(problem)) call raise(error, io_error, self%folder//'/'//trim(entry%name)//': '//problem)
      if (.not. allocated(error)) call append(self, closing_text(entry), error)
      if (.not. allocated(error)) self%entry(k) = entry
   end subroutine close_file

   !> Remove what a file of the result has of unfinished forms, and the file itself unless that is to stay.
   subroutine empty(self, path, error, stays)
      class(manifest_t), intent(inout) :: self
      !> Its name, also with the folder before it; it stays one of the result
      character(len=*), intent(in) :: path
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      !> Whether the file with its complete name stays; no if absent
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
         if (is_there(self%folder//'/'//trim(forms(k)))) call remove_file(self%folder//'/'//trim(forms(k)), error)
      end do
   end subroutine empty

   !> Give a name up; its file, if there is one, is somebody else's from now on.
   subroutine forget(self, path, error)
      class(manifest_t), intent(inout) :: self
      !> The name, also with the folder before it
      character(len=*), intent(in) :: path
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      k = self%place_of(name_in(path))
      if (k == 0 .or. .not. self%is_active .or. allocated(error)) return
      call append(self, 'removed '//name_in(path), error)
      if (.not. allocated(error)) call drop_entry(self, k)
   end subroutine forget

end module polydem_manifest
