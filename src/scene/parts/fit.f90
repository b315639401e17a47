!> What to do about grains that do not fit into their region: a number and a size with which they do.
module polydem_fit
   use polydem_arrange, only: arrange_grains, region_t
   use polydem_errors, only: error_t
   use polydem_grain_list, only: grains_t
   use polydem_grains, only: greatest_length
   use polydem_kinds, only: ip, wp
   use polydem_random, only: new_random, random_t
   use polydem_settings, only: grains_settings_t
   use polydem_strings, only: to_text
   use polydem_wall_outlines, only: problem_t
   implicit none
   private
   public :: explain

contains

   !> Say that the grains of a group do not fit, and which number or size fits.
   subroutine explain(recipe, given, group, region, seed, n_found, problem)
      !> Name of the recipe, empty if the group is one of the namelist
      character(len=*), intent(in) :: recipe
      !> The group as it is given, and with its number
      type(grains_settings_t), intent(in) :: given, group
      !> Region of the group with its obstacles
      type(region_t), intent(in) :: region
      !> Seed of the group
      integer(ip), intent(in) :: seed
      !> Number of grains that fit; 0 if it is not known
      integer(ip), intent(in) :: n_found
      !> The message
      type(problem_t), intent(inout) :: problem
      type(grains_settings_t) :: other
      real(wp) :: share
      integer(ip) :: number

      problem%key = 'number'
      if (given%number == 0_ip) problem%key = 'solid_fraction'
      if (recipe /= '') then
         problem%text = recipe_text(recipe, group, n_found)
         return
      end if
      number = n_found
      if (number == 0_ip) number = int(0.9_wp*real(group%number, wp), ip)
      other = group
      do while (number > 0_ip)
         other%number = number
         if (do_fit(other, region, seed)) exit
         number = int(0.9_wp*real(number, wp), ip)
      end do
      problem%text = 'asks for '//to_text(group%number)//' grains, but the region has room for '//to_text(number)
      if (number == 0_ip) problem%text = problem%text//size_text(group, region)
      if (number > 0_ip .and. given%number > 0_ip) problem%text = problem%text//'; lower it to '//to_text(number)
      if (number > 0_ip .and. given%number == 0_ip) problem%text = problem%text//'; give number = '//to_text(number)// &
         ' in its place'
      ! The fraction that fits does not depend on the size of the grains.
      if (group%arrangement == 'packing' .or. given%number == 0_ip) return
      share = 0.95_wp
      do while (share > 1.0e-2_wp)
         other = shrunk(group, rounded(share))
         if (do_fit(other, region, seed)) exit
         share = 0.95_wp*share
      end do
      if (share > 1.0e-2_wp) problem%text = problem%text//', or multiply all lengths of the grains by '// &
         to_text(rounded(share), 2)
   end subroutine explain

   !> Clause about grains that are longer than their region; empty if they are not
   pure function size_text(group, region) result(text)
      type(grains_settings_t), intent(in) :: group
      type(region_t), intent(in) :: region
      character(len=:), allocatable :: text

      text = ''
      associate (extent => maxval(region%corners, 2) - minval(region%corners, 2), length => greatest_length(group))
         if (length > minval(extent)) text = ': its grains are up to '//to_text(length, 3)// &
            ' m long, the region is '//to_text(extent(1), 3)//' m wide and '//to_text(extent(2), 3)// &
            ' m high. Lengths are in m, not in mm'
      end associate
   end function size_text

   !> A number with the two digits that a message has
   real(wp) function rounded(number)
      real(wp), intent(in) :: number
      character(len=:), allocatable :: text

      text = to_text(number, 2)
      read (text, *) rounded
   end function rounded

   !> The group with all lengths of its grains multiplied by a factor
   pure function shrunk(group, factor) result(other)
      type(grains_settings_t), intent(in) :: group
      real(wp), intent(in) :: factor
      type(grains_settings_t) :: other

      other = group
      other%short_axis = factor*group%short_axis
      other%long_axis = factor*group%long_axis
      other%diameter = factor*group%diameter
      other%width = factor*group%width
      other%height = factor*group%height
      other%outline = factor*group%outline
   end function shrunk

   !> Whether the grains of a group fit into its region
   logical function do_fit(group, region, seed)
      type(grains_settings_t), intent(in) :: group
      type(region_t), intent(in) :: region
      integer(ip), intent(in) :: seed
      type(random_t) :: random
      type(grains_t) :: grains
      type(error_t), allocatable :: error
      real(wp), allocatable :: centres(:, :)
      integer(ip) :: n_found

      random = new_random(seed)
      allocate (centres(2, group%number))
      call arrange_grains(group, region, seed, random, grains, centres, n_found, error)
      do_fit = n_found == group%number .and. .not. allocated(error)
   end function do_fit

   !> What is said of grains of a recipe that do not fit
   pure function recipe_text(recipe, group, n_found) result(text)
      character(len=*), intent(in) :: recipe
      type(grains_settings_t), intent(in) :: group
      integer(ip), intent(in) :: n_found
      character(len=:), allocatable :: text, entries

      select case (recipe)
      case ('drum')
         entries = 'radius'
      case ('hopper')
         entries = 'opening, width'
      case default
         entries = 'width'
      end select
      text = 'the container has room for '//to_text(n_found)//' '
      if (group%arrangement == 'packing') then
         text = text//'packed grains, not for '//to_text(group%number)//'; enlarge the container or reduce the '// &
            'number of grains'
      else if (group%size_ratio > 1.0_wp) then
         text = 'the container has no room for grains of such different sizes; enlarge the container ('//entries// &
            '), or lower bodies or size_ratio'
      else
         text = text//'loose grains, not for '//to_text(group%number)//'; enlarge the container ('//entries// &
            '), or lower bodies or long_axis'
      end if
   end function recipe_text

end module polydem_fit
