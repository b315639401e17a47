!> Outlines of grains: those of a list, or of the free bodies of a bodies file or of the last frame of a result.
module polydem_outline_file
   use polydem_bodies, only: bodies_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_grains, only: corners_of_polygons, pieces_of_outlines
   use polydem_kinds, only: ip, wp
   use polydem_outlines, only: as_corners
   use polydem_piece_properties, only: join_pieces
   use polydem_polygon, only: clean_polygon
   use polydem_settings, only: grains_settings_t, settings_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: to_text
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

      if (group%outlines /= '') call read_outlines(group%outlines, group%outline, group%outline_corners, &
                                                   group%outline_pieces, error)
      if (allocated(error)) then
         error%message = place_of(settings, 'grains.'//group%name, 'outlines')//': &grains '//group%name// &
            ': outlines: '//error%message
      else
         call check_outlines(group, problem)
      end if
   end subroutine find_outlines

   !> Read all outlines, each relative to the centre of mass of its body.
   subroutine read_outlines(path, outline, corners, pieces, error)
      !> Bodies file, result folder, or segment of a trajectory
      character(len=*), intent(in) :: path
      !> Corners x1, y1, x2, y2, ... of one piece after the other [m]
      real(wp), allocatable, intent(inout) :: outline(:)
      !> Number of corners of each piece, and number of pieces of each outline
      integer(ip), allocatable, intent(inout) :: corners(:), pieces(:)
      !> Names the path and the defect
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: bodies
      integer(ip) :: k, p

      if (index(path, '.csv', back=.true.) == max(1, len(path) - 3)) then
         call raise(error, input_error, path//' is a text file; ./polydem import makes a bodies file of it')
         return
      end if
      call read_packing(path, bodies, error)
      if (allocated(error)) return
      if (size(bodies%free) == 0) call raise(error, input_error, path//' has no free bodies')
      if (allocated(error)) return
      deallocate (outline, corners, pieces)
      allocate (outline(0), corners(0), pieces(0))
      do k = 1_ip, size(bodies%free, kind=ip)
         associate (s => bodies%free(k), shape => bodies%pieces%turned_polygon(bodies%free(k)), &
                    number => bodies%pieces%numbers_of(bodies%free(k)))
            outline = [outline, reshape(shape, [size(shape)])]
            pieces = [pieces, maxval(number) + 1_ip]
            corners = [corners, [(int(count(number == p), ip), p=0_ip, maxval(number))]]
         end associate
      end do
   end subroutine read_outlines

   !> Check that the outlines of grains are convex polygons, or several that do not overlap.
   subroutine check_outlines(group, problem)
      type(grains_settings_t), intent(in) :: group
      type(problem_t), intent(inout) :: problem
      real(wp), allocatable :: cleaned(:, :)
      integer(ip), allocatable :: corners(:), number(:), pieces(:)
      real(wp) :: area, centroid(2), second_moment
      integer(ip) :: before, first, k, p

      call check_corners(group%outline, 3, 'outline', problem)
      if (allocated(problem%text)) return
      corners = corners_of_polygons(group)
      pieces = pieces_of_outlines(group)
      before = 0_ip
      first = 0_ip
      do k = 1_ip, size(pieces, kind=ip)
         associate (mine => corners(before + 1_ip:before + pieces(k)))
            associate (shape => as_corners(group%outline(2_ip*first + 1_ip:2_ip*(first + sum(mine)))))
               if (pieces(k) == 1_ip) then
                  call clean_polygon(shape, cleaned, problem%text)
                  if (allocated(problem%text)) problem%text = problem%text//'; give convex grains, for example '// &
                     '0, 0, 0.01, 0, 0.01, 0.01, or concave ones as convex pieces (''outline_pieces'')'
               else
                  call join_pieces(shape, [(sum(mine(:p)), p=0_ip, pieces(k))], cleaned, number, area, centroid, &
                                   second_moment, problem%text)
                  if (allocated(problem%text)) problem%text = 'is wrong in outline '//to_text(k)//': '//problem%text
               end if
            end associate
            first = first + sum(mine)
         end associate
         if (allocated(problem%text)) return
         before = before + pieces(k)
      end do
   end subroutine check_outlines

end module polydem_outline_file
