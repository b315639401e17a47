!> Outlines of grains: those of a list, or of the free bodies of a bodies file or of the last frame of a result.
module polydem_outline_file
   use polydem_bodies, only: bodies_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, wp
   use polydem_polygon, only: clean_polygon
   use polydem_settings, only: grains_settings_t, settings_t
   use polydem_source_locations, only: place_of
   use polydem_trajectory_reader, only: read_packing
   use polydem_wall_outlines, only: check_corners, problem_t
   implicit none
   private
   public :: find_outlines, read_outlines

contains

   !> Read the outlines of a group if they are in a file, and check them.
   subroutine find_outlines(settings, group, problem, error)
      !> Settings, for the places of entries
      type(settings_t), intent(in) :: settings
      !> A group with outlines; they are set
      type(grains_settings_t), intent(inout) :: group
      !> Its text is allocated if an outline is no convex polygon
      type(problem_t), intent(inout) :: problem
      !> Allocated if the file cannot be read
      type(error_t), allocatable, intent(inout) :: error

      if (group%outlines /= '') call read_outlines(group%outlines, group%outline, group%outline_corners, error)
      if (allocated(error)) then
         error%message = place_of(settings, 'grains.'//group%name, 'outlines')//': &grains '//group%name// &
            ': outlines: '//error%message
      else
         call check_outlines(group, problem)
      end if
   end subroutine find_outlines

   !> Read all outlines, each relative to the centre of mass of its body.
   subroutine read_outlines(path, outline, corners, error)
      !> Bodies file, result folder, or segment of a trajectory
      character(len=*), intent(in) :: path
      !> Corners x1, y1, x2, y2, ... of one outline after the other [m]
      real(wp), allocatable, intent(inout) :: outline(:)
      !> Number of corners of each outline
      integer(ip), allocatable, intent(inout) :: corners(:)
      !> Names the path and the defect
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: bodies
      integer(ip) :: k, n

      if (index(path, '.csv', back=.true.) == max(1, len(path) - 3)) then
         call raise(error, input_error, path//' is a text file; ./polydem import makes a bodies file of it')
         return
      end if
      call read_packing(path, bodies, error)
      if (allocated(error)) return
      if (bodies%pieces%most > 1_ip) call raise(error, input_error, path//' has bodies of several pieces; outlines '// &
         'must be convex')
      if (size(bodies%free) == 0) call raise(error, input_error, path//' has no free bodies')
      if (allocated(error)) return
      n = size(bodies%free, kind=ip)
      deallocate (outline, corners)
      allocate (corners(n), outline(2_ip*sum([(bodies%pieces%vertex_start(bodies%free(k) + 1_ip) &
                                               - bodies%pieces%vertex_start(bodies%free(k)), k=1_ip, n)])))
      n = 0_ip
      do k = 1_ip, size(corners, kind=ip)
         associate (shape => bodies%pieces%turned_polygon(bodies%free(k)))
            corners(k) = size(shape, 2, kind=ip)
            outline(n + 1_ip:n + 2_ip*corners(k)) = reshape(shape, [2_ip*corners(k)])
            n = n + 2_ip*corners(k)
         end associate
      end do
   end subroutine read_outlines

   !> Check that the outlines of grains are convex polygons.
   subroutine check_outlines(group, problem)
      type(grains_settings_t), intent(in) :: group
      type(problem_t), intent(inout) :: problem
      real(wp), allocatable :: cleaned(:, :)
      integer(ip), allocatable :: corners(:)
      integer(ip) :: first, k

      call check_corners(group%outline, 3, 'outline', problem)
      corners = group%outline_corners
      if (size(corners) == 0) corners = [size(group%outline, kind=ip)/2_ip]
      first = 0_ip
      do k = 1_ip, size(corners, kind=ip)
         if (allocated(problem%text)) return
         call clean_polygon(reshape(group%outline(first + 1_ip:first + 2_ip*corners(k)), [2_ip, corners(k)]), cleaned, &
                            problem%text)
         if (allocated(problem%text)) problem%text = problem%text//'; give convex grains, for example '// &
            '0, 0, 0.01, 0, 0.01, 0.01'
         first = first + 2_ip*corners(k)
      end do
   end subroutine check_outlines

end module polydem_outline_file
