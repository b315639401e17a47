!> Motion that follows a table of poses: it turns bodies by the angle of the table, then shifts them.
module polydem_table_motion
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t
   use polydem_hash, only: mix_word
   use polydem_kinds, only: dp, lp, wp
   use polydem_motion, only: motion_t, placement_t
   use polydem_motion_table, only: evaluate_table, greatest_rates, greatest_values, motion_table_t
   use polydem_settings, only: motion_settings_t, settings_t
   use polydem_table_file, only: read_motion_table
   implicit none
   private
   public :: table_motion_t

   !> A motion with a table
   type, extends(motion_t) :: table_motion_t
      !> Its poses
      type(motion_table_t) :: table
      !> Greatest displacements along x and y [m] and angle [rad]
      real(wp) :: values(3) = 0.0_wp
   contains
      procedure :: configure
      procedure :: placement
      procedure :: add_bounds
      procedure :: moves
      procedure :: has_pivot
      procedure :: rests_from
      procedure :: hash_of_table
   end type table_motion_t

contains

   !> Read the table.
   subroutine configure(self, settings, given, error)
      class(table_motion_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings
      type(motion_settings_t), intent(in) :: given
      type(error_t), allocatable, intent(inout) :: error

      call read_motion_table(settings, given, self%table, error)
      if (.not. allocated(error)) self%values = greatest_values(self%table)
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

   !> Add the greatest rates and values of the table.
   pure subroutine add_bounds(self, arm, duration, speed, reach)
      class(table_motion_t), intent(in) :: self
      real(wp), intent(in) :: arm, duration
      real(wp), intent(inout) :: speed, reach
      real(wp) :: rates(3)

      associate (unused => duration)
      end associate
      rates = greatest_rates(self%table)
      speed = speed + rates(3)*(arm + reach) + hypotenuse(rates(1), rates(2))
      if (self%values(3) > 0.0_wp) reach = reach + 2.0_wp*(arm + reach)
      reach = reach + hypotenuse(self%values(1), self%values(2))
   end subroutine add_bounds

   !> Whether the table has other values than 0 for a direction
   pure logical function moves(self, direction)
      class(table_motion_t), intent(in) :: self
      integer, intent(in) :: direction

      moves = self%values(direction) > 0.0_wp
   end function moves

   !> It turns about its pivot.
   pure logical function has_pivot(self)
      class(table_motion_t), intent(in) :: self

      associate (unused => self)
      end associate
      has_pivot = .true.
   end function has_pivot

   !> The time of the last row
   pure real(wp) function rests_from(self)
      class(table_motion_t), intent(in) :: self

      rests_from = self%start + self%table%time(size(self%table%time))
   end function rests_from

   !> Hash of all rows
   pure integer(lp) function hash_of_table(self, before) result(hash)
      class(table_motion_t), intent(in) :: self
      integer(lp), intent(in) :: before
      integer :: i, j

      hash = before
      do j = 1, size(self%table%time)
         hash = mix_word(hash, transfer(real(self%table%time(j), dp), 0_lp))
         do i = 1, 3
            hash = mix_word(hash, transfer(real(self%table%value(i, j), dp), 0_lp))
         end do
      end do
   end function hash_of_table

end module polydem_table_motion
