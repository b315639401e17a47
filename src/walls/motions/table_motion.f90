!> Motion that follows a table of poses: it turns bodies by the angle of the table, then shifts them.
module polydem_table_motion
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t
   use polydem_hash, only: mix_word
   use polydem_kinds, only: dp, lp, wp
   use polydem_motion, only: motion_limits_t, motion_t, placement_t
   use polydem_motion_table, only: evaluate_table, greatest_rates, greatest_values, motion_table_t
   use polydem_settings, only: settings_t
   use polydem_table_file, only: read_motion_table
   implicit none
   private
   public :: table_motion_t

   !> A motion with a table
   type, extends(motion_t) :: table_motion_t
      !> Its poses
      type(motion_table_t) :: table
   contains
      procedure :: configure
      procedure :: placement
      procedure :: limits
   end type table_motion_t

contains

   !> Read the table.
   subroutine configure(self, settings, number, error)
      class(table_motion_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      integer, intent(in) :: number
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, j

      call read_motion_table(settings, settings%motion(number), self%table, error)
      if (allocated(error)) return
      self%has_pivot = .true.
      associate (table => self%table)
         self%rests_after = table%time(size(table%time))
         do j = 1, size(table%time)
            self%hash = mix_word(self%hash, transfer(real(table%time(j), dp), 0_lp))
            do i = 1, 3
               self%hash = mix_word(self%hash, transfer(real(table%value(i, j), dp), 0_lp))
            end do
         end do
      end associate
   end subroutine configure

   !> Turn and shift at a time
   function placement(self, time) result(at)
      class(table_motion_t), intent(in) :: self
      real(wp), intent(in) :: time
      type(placement_t) :: at
      real(wp) :: value(3), rate(3), growth(3)

      call evaluate_table(self%table, min(time, self%end) - self%start, value, rate, growth)
      if (time >= self%end) then
         rate = 0.0_wp
         growth = 0.0_wp
      end if
      at%turns = any(abs(self%table%value(3, :)) > 0.0_wp)
      at%shifts = .true.
      at%turn = [value(3), rate(3), growth(3)]
      at%shift = reshape([value(:2), rate(:2), growth(:2)], [2, 3])
   end function placement

   !> The greatest rates and values of the table
   pure function limits(self)
      class(table_motion_t), intent(in) :: self
      type(motion_limits_t) :: limits
      real(wp) :: rates(3), values(3)

      rates = greatest_rates(self%table)
      values = greatest_values(self%table)
      limits%spin = rates(3)
      limits%speed = hypotenuse(rates(1), rates(2))
      limits%shift = hypotenuse(values(1), values(2))
      limits%moves = values > 0.0_wp
   end function limits

end module polydem_table_motion
