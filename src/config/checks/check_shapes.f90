!> Checks of the shape of grains, the entries that several groups have, against each other.
module polydem_check_shapes
   use polydem_blame_entry, only: blame
   use polydem_errors, only: error_t
   use polydem_group_instances, only: instance_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_settings, only: ellipse_settings_t, shape_settings_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_shape, check_ellipse

   !> What is said of two values in the wrong order
   character(len=*), parameter :: order = 'must be in ascending order: the smallest before the largest one'

contains

   !> Check the shape of the grains of a group.
   pure subroutine check_shape(group, instance, error)
      !> The shape
      class(shape_settings_t), intent(in) :: group
      !> Group that has it
      type(instance_t), intent(in) :: instance
      !> First entry that contradicts another
      type(error_t), allocatable, intent(inout) :: error

      if (group%shape == 'cross') call check_cross(group%width, group%arm, instance, error)
      call check_ellipse(group, instance, error)
      if (group%diameter(1) > group%diameter(2)) call blame(instance, 'diameter', order, error)
      if (group%angle(1) > group%angle(2)) call blame(instance, 'angle', order, error)
      if (group%shape == 'rectangle' .and. max(group%width, group%height) > 1.0e6_wp*min(group%width, group%height)) &
         call blame(instance, 'width', 'and ''height'' must not differ by more than a factor of 1e6', error, 'height')
      call check_outlines(group%shape, group%outline, group%outline_corners, group%outline_pieces, group%outlines, &
                          instance, error)
      call check_grading(group%sizes, group%grading, instance, error)
   end subroutine check_shape

   !> Check corners and axes of grains in ellipses.
   pure subroutine check_ellipse(group, instance, error)
      !> Corners and axes; if they are not in use, their defaults, which pass
      class(ellipse_settings_t), intent(in) :: group
      !> Group that has them
      type(instance_t), intent(in) :: instance
      !> First entry that contradicts another
      type(error_t), allocatable, intent(inout) :: error

      if (group%corners(1) > group%corners(2)) call blame(instance, 'corners', 'must be in ascending order: write '// &
         to_text(group%corners(2))//', '//to_text(group%corners(1)), error)
      if (group%long_axis(1) > group%long_axis(2)) call blame(instance, 'long_axis', order, error)
      if (group%short_axis > group%long_axis(1)) call blame(instance, 'short_axis', &
         'must not exceed the first value of ''long_axis''', error, 'long_axis')
      if (group%long_axis(2) > 1.0e6_wp*group%short_axis) call blame(instance, 'long_axis', &
         'must not exceed 1e6 times ''short_axis''', error, 'short_axis')
   end subroutine check_ellipse

   !> Check that there are outlines, and that their corners are as many as their numbers say.
   pure subroutine check_outlines(shape, outline, corners, pieces, outlines, instance, error)
      !> Shape of the grains
      character(len=*), intent(in) :: shape
      !> Corners of the outlines [m]
      real(wp), intent(in) :: outline(:)
      !> Number of corners of each polygon, and number of polygons of each shape
      integer(ip), intent(in) :: corners(:), pieces(:)
      !> Path of a file of outlines
      character(len=*), intent(in) :: outlines
      type(instance_t), intent(in) :: instance
      type(error_t), allocatable, intent(inout) :: error

      if (shape /= 'outline') return
      if (size(outline) == 0 .and. outlines == '') call blame(instance, 'outline', 'is required with shape = '// &
         '''outline'', unless ''outlines'' names a file; for example outline = 0, 0, 0.01, 0, 0.01, 0.01', error)
      if (size(outline) + size(corners) + size(pieces) > 0 .and. outlines /= '') call blame(instance, 'outlines', &
         'cannot be combined with ''outline'' and ''outline_corners''; give only the file or the corners', error)
      if (size(corners) > 0 .and. 2_lp*sum(int(corners, lp)) /= size(outline) .and. outlines == '') call blame( &
         instance, 'outline_corners', 'has '//to_text(sum(int(corners, lp)))//' corners in all, but ''outline'' '// &
         'has '//to_text(size(outline, kind=lp)/2_lp)//'; give the number of corners of each polygon', error, 'outline')
      if (size(pieces) > 0 .and. sum(int(pieces, lp)) /= max(1, size(corners)) .and. outlines == '') call blame( &
         instance, 'outline_pieces', 'has '//to_text(sum(int(pieces, lp)))//' polygons in all, but ''outline'' '// &
         'and ''outline_corners'' have '//to_text(max(1_lp, size(corners, kind=lp)))//'; give the number of '// &
         'polygons of each shape', error, 'outline_corners')
   end subroutine check_outlines

   !> Check the lengths of a cross.
   pure subroutine check_cross(width, arm, instance, error)
      !> Distance of opposite ends, and width of the arms [m]
      real(wp), intent(in) :: width, arm
      type(instance_t), intent(in) :: instance
      type(error_t), allocatable, intent(inout) :: error

      if (arm >= width .or. width > 1.0e6_wp*arm) call blame(instance, 'arm', 'must be less than ''width'', the '// &
         'distance of opposite ends, and not less than a millionth of it', error, 'width')
   end subroutine check_cross

   !> Check a sieve curve.
   pure subroutine check_grading(sizes, grading, instance, error)
      !> Distribution of sizes
      character(len=*), intent(in) :: sizes
      !> Pairs of size factor and fraction
      real(wp), intent(in) :: grading(:)
      type(instance_t), intent(in) :: instance
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: example = '; for example grading = 1, 0, 2, 0.4, 4, 1'
      integer :: n

      if (sizes /= 'grading') return
      n = size(grading)
      if (n < 4 .or. modulo(n, 2) == 1) then
         call blame(instance, 'grading', 'needs pairs of size and fraction, at least two'//example, error)
      else if (.not. grading(1) > 0.0_wp .or. any(.not. grading(3::2) > grading(:n - 2:2))) then
         call blame(instance, 'grading', 'must have sizes above 0 in ascending order'//example, error)
      else if (any(.not. grading(4::2) >= grading(2:n - 2:2)) .or. abs(grading(2)) > 0.0_wp .or. &
               abs(grading(n) - 1.0_wp) > 0.0_wp) then
         call blame(instance, 'grading', 'must have fractions that do not fall, from 0 to 1'//example, error)
      end if
   end subroutine check_grading

end module polydem_check_shapes
