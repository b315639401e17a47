!> What a scene is made of: groups of grains and walls, as the groups &grains and &wall of a namelist describe them.
!>
!> Either the namelist contains the parts, or a recipe makes them from the entries of &scene.
module polydem_parts
   use polydem_kinds, only: wp
   use polydem_settings, only: grains_settings_t, wall_settings_t
   implicit none
   private
   public :: parts_t, new_grains, new_wall_part

   !> The parts of a scene
   type :: parts_t
      !> Name of the recipe that made them; empty: they are those of the namelist
      character(len=:), allocatable :: recipe
      !> Groups of grains in the order in which they are placed
      type(grains_settings_t), allocatable :: grains(:)
      !> Walls
      type(wall_settings_t), allocatable :: walls(:)
   contains
      procedure :: start
      procedure :: add_grains
      procedure :: add_rectangle
      procedure :: add_polygon
      procedure :: add_wall
      procedure :: add_box
   end type parts_t

contains

   !> Begin a list of the parts of a recipe.
   pure subroutine start(self, recipe)
      class(parts_t), intent(inout) :: self
      !> Name of the recipe
      character(len=*), intent(in) :: recipe

      self%recipe = recipe
      if (allocated(self%grains)) deallocate (self%grains)
      if (allocated(self%walls)) deallocate (self%walls)
      allocate (self%grains(0), self%walls(0))
   end subroutine start

   !> A group of loose grains without a place. All other components have the values of unused entries
   pure function new_grains(name) result(grains)
      !> Name of the group
      character(len=*), intent(in) :: name
      type(grains_settings_t) :: grains

      grains%name = name
      grains%region = ''
      grains%arrangement = 'loose'
      grains%shape = 'ellipse'
      grains%sizes = 'uniform'
      grains%size_ratio = 1.0_wp
      grains%momentum = 'random'
      grains%order = 'natural'
      grains%wall = ''
      grains%material = ''
      grains%packing = ''
      grains%outlines = ''
      grains%outline_choice = 'random'
      grains%elongation = 1.0_wp
      grains%size_spread = 1.0_wp
      allocate (grains%vertices(0), grains%outline(0), grains%outline_corners(0), grains%outline_pieces(0), &
                grains%grading(0))
   end function new_grains

   !> A wall without an outline. All other components have the values of unused entries
   pure function new_wall_part(name, outline) result(wall)
      !> Name of the wall, and its outline
      character(len=*), intent(in) :: name, outline
      type(wall_settings_t) :: wall

      wall%name = name
      wall%outline = outline
      wall%material = ''
      allocate (wall%vertices(0), wall%bodies(0))
   end function new_wall_part

   !> Append a group of grains.
   pure subroutine add_grains(self, grains)
      class(parts_t), intent(inout) :: self
      !> The group
      type(grains_settings_t), intent(in) :: grains
      type(grains_settings_t), allocatable :: longer(:)
      integer :: n

      n = size(self%grains)
      allocate (longer(n + 1))
      longer(:n) = self%grains
      longer(n + 1) = grains
      call move_alloc(longer, self%grains)
   end subroutine add_grains

   !> Append a wall.
   pure subroutine add_wall(self, wall)
      class(parts_t), intent(inout) :: self
      !> The wall
      type(wall_settings_t), intent(in) :: wall
      type(wall_settings_t), allocatable :: longer(:)
      integer :: n

      n = size(self%walls)
      allocate (longer(n + 1))
      longer(:n) = self%walls
      longer(n + 1) = wall
      call move_alloc(longer, self%walls)
   end subroutine add_wall

   !> Append a wall that is an upright rectangle.
   pure subroutine add_rectangle(self, name, left, right, bottom, top)
      class(parts_t), intent(inout) :: self
      !> Name of the wall
      character(len=*), intent(in) :: name
      !> Bounds in x and in y [m]
      real(wp), intent(in) :: left, right, bottom, top
      type(wall_settings_t) :: wall

      wall = new_wall_part(name, 'rectangle')
      wall%low = [left, bottom]
      wall%high = [right, top]
      call self%add_wall(wall)
   end subroutine add_rectangle

   !> Append a wall that is a convex polygon.
   pure subroutine add_polygon(self, name, corners)
      class(parts_t), intent(inout) :: self
      !> Name of the wall
      character(len=*), intent(in) :: name
      !> Corners, (2, corner) [m]
      real(wp), intent(in) :: corners(:, :)
      type(wall_settings_t) :: wall

      wall = new_wall_part(name, 'polygon')
      wall%vertices = reshape(corners, [size(corners)])
      call self%add_wall(wall)
   end subroutine add_polygon

   !> Append the walls of a container around an upright rectangle: floor, left, right and, if closed, a lid. They share
   !> edges and do not overlap.
   pure subroutine add_box(self, low, high, thickness, closed)
      class(parts_t), intent(inout) :: self
      !> Lower left and upper right corner of the rectangle, and thickness of the walls [m]
      real(wp), intent(in) :: low(2), high(2), thickness
      !> Whether there is a lid
      logical, intent(in) :: closed
      real(wp) :: top

      associate (left => low(1), right => high(1), bottom => low(2))
         top = high(2)
         call self%add_rectangle('floor', left, right, bottom - thickness, bottom)
         if (closed) top = top + thickness
         call self%add_rectangle('left', left - thickness, left, bottom - thickness, top)
         call self%add_rectangle('right', right, right + thickness, bottom - thickness, top)
         if (closed) call self%add_rectangle('lid', left, right, high(2), top)
      end associate
   end subroutine add_box

end module polydem_parts
