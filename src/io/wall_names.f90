!> The names of walls and materials in the files of a result, texts of the provenance: 'floor 101-103; lid 104 107' and
!> 'glass steel'.
module polydem_wall_names
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_kinds, only: ip
   use polydem_strings, only: split_words, to_text
   use polydem_wall, only: wall_t
   implicit none
   private
   public :: wall_names_text, find_wall_names, find_material_names

contains

   !> Text of the walls with their names and the identifiers of their bodies
   pure function wall_names_text(walls) result(text)
      !> The walls
      type(wall_t), intent(in) :: walls(:)
      character(len=:), allocatable :: text
      integer :: first, k, last

      text = ''
      do k = 1, size(walls)
         if (walls(k)%name == '') cycle
         if (text /= '') text = text//'; '
         text = text//walls(k)%name
         associate (id => walls(k)%id)
            first = 1
            do while (first <= size(id))
               last = first
               do while (last < size(id))
                  if (id(last + 1) /= id(last) + 1_ip) exit
                  last = last + 1
               end do
               text = text//' '//to_text(id(first))
               if (last > first) text = text//'-'//to_text(id(last))
               first = last + 1
            end do
         end associate
      end do
   end function wall_names_text

   !> Find the names of the walls of a result, and their bodies.
   subroutine find_wall_names(path, walls, error)
      !> A file of the result
      character(len=*), intent(in) :: path
      !> The walls; none if the result has no names
      type(wall_t), allocatable, intent(out) :: walls(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text
      type(wall_t) :: wall
      integer :: last

      allocate (walls(0))
      call find_text(path, '/provenance/walls', text, error)
      if (allocated(error)) return
      do while (text /= '')
         last = index(text//';', ';') - 1
         call read_wall(text(:last), wall)
         walls = [walls, wall]
         text = trim(adjustl(text(min(last + 2, len(text) + 1):)))
      end do
   end subroutine find_wall_names

   !> Find the names of the materials of a result.
   subroutine find_material_names(path, text, error)
      !> A file of the result
      character(len=*), intent(in) :: path
      !> The names, separated by blanks; empty if there are none
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(inout) :: error

      call find_text(path, '/provenance/materials', text, error)
   end subroutine find_material_names

   !> Read a text; it is empty if the file does not have it.
   subroutine find_text(path, name, text, error)
      character(len=*), intent(in) :: path, name
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      text = ''
      call file%open(path, error)
      if (allocated(error)) return
      if (file%has(name, error)) call file%read(name, text, error)
      call file%close(error)
   end subroutine find_text

   !> Read the name and the identifiers of a wall.
   subroutine read_wall(text, wall)
      character(len=*), intent(in) :: text
      type(wall_t), intent(out) :: wall
      character(len=:), allocatable :: words(:)
      integer(ip) :: first, id, last
      integer :: dash, k, status

      words = split_words(text)
      wall%name = trim(words(1))
      allocate (wall%id(0))
      do k = 2, size(words)
         dash = index(words(k), '-')
         read (words(k)(:merge(len(words), dash - 1, dash == 0)), *, iostat=status) first
         last = first
         if (dash > 0 .and. status == 0) read (words(k)(dash + 1:), *, iostat=status) last
         if (status == 0) wall%id = [wall%id, [(id, id=first, last)]]
      end do
   end subroutine read_wall

end module polydem_wall_names
