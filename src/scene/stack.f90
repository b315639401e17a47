!> Scene stack: blocks on top of each other at rest. The depth of each contact carries the weight above it.
module polydem_stack
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_settings, only: settings_t
   use polydem_static_depth, only: resting_block_t, static_depth
   use polydem_walls, only: rectangle
   implicit none
   private
   public :: list_stack

   !> Width of the floor over width of a block
   real(wp), parameter :: floor_width = 10.0_wp

contains

   !> List the bodies of the stack: blocks from the bottom up, then the floor. The floor is as thick as a block and its
   !> top is at y = 0.
   subroutine list_stack(settings, list, error)
      !> Settings: bodies (blocks), width and height of a block; gravity, stiffness and law
      type(settings_t), intent(in) :: settings
      type(body_list_t), intent(inout) :: list
      !> Allocated if the blocks are too heavy for the stiffness
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: weight, bottom, support, depth
      integer(ip) :: k

      bottom = 0.0_wp
      associate (n => settings%scene%bodies, width => settings%scene%width, height => settings%scene%height)
         weight = settings%scene%density*width*height*max(0.0_wp, -settings%forces%gravity(2))
         support = floor_width*width
         do k = 1_ip, n
            call static_depth(settings%forces, resting_block_t(real(n - k + 1_ip, wp)*weight, width, height, support, &
                                                               height), depth, error)
            if (allocated(error)) return
            bottom = bottom - depth
            call list%append(rectangle(-0.5_wp*width, 0.5_wp*width, bottom, bottom + height), &
                             density=settings%scene%density)
            bottom = bottom + height
            support = width
         end do
         call list%append(rectangle(-0.5_wp*floor_width*width, 0.5_wp*floor_width*width, -height, 0.0_wp), &
                          fixed=.true.)
      end associate
   end subroutine list_stack

end module polydem_stack
