!> The table of the verification benchmarks: expected values, simulated values and tolerances.
!>
!> A benchmark calls `begin` and then one of the `expect_` procedures per quantity; each prints its row at once.
!> `show` records a number without a tolerance, such as the same quantity at another stiffness, which explains an error.
module verification_table
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use, intrinsic :: iso_fortran_env, only: output_unit
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, wp
   implicit none
   private
   public :: table_t

   !> One quantity of one benchmark
   type :: row_t
      !> Benchmark, such as B8
      character(len=8) :: benchmark = ''
      !> Quantity with its unit
      character(len=72) :: quantity = ''
      !> Expected value or bound
      character(len=16) :: expected = ''
      !> Simulated value
      character(len=16) :: got = ''
      !> Distance from the expected value, relative or in the unit of the quantity
      character(len=12) :: error = ''
      !> Greatest error allowed
      character(len=12) :: tolerance = ''
      !> Processor time of all threads since the row before [s]
      real(dp) :: seconds = 0.0_dp
      !> 'good', 'MISSED', or 'shown' where nothing is expected
      character(len=6) :: verdict = ''
   end type row_t

   !> The table
   type :: table_t
      !> Number of rows that missed their tolerance
      integer :: n_missed = 0
      type(row_t), allocatable, private :: rows(:)
      character(len=8), private :: benchmark = ''
      real(dp), private :: clock = 0.0_dp
   contains
      procedure :: begin
      procedure :: expect_relative
      procedure :: expect_absolute
      procedure :: expect_least
      procedure :: expect_true
      procedure :: show
      procedure :: note_error
      procedure :: as_csv
      procedure :: as_markdown
   end type table_t

   character(len=*), parameter :: line_end = new_line('a')

contains

   !> Begin a benchmark. Its rows follow.
   subroutine begin(self, benchmark, title)
      class(table_t), intent(inout) :: self
      !> Name in the table, such as B8
      character(len=*), intent(in) :: benchmark
      !> Title of the benchmark
      character(len=*), intent(in) :: title

      if (.not. allocated(self%rows)) then
         allocate (self%rows(0))
         call print_columns(row_t(benchmark='', quantity='', expected='expected', got='got', error='error', &
                                  tolerance='tolerance', verdict=''), '      s')
      end if
      self%benchmark = benchmark
      self%clock = processor_seconds()
      write (output_unit, '(4a)') trim(benchmark), '  ', title
      flush (output_unit)
   end subroutine begin

   !> Expect a value within a relative tolerance.
   subroutine expect_relative(self, quantity, expected, got, tolerance)
      class(table_t), intent(inout) :: self
      !> Quantity with its unit
      character(len=*), intent(in) :: quantity
      !> Expected value, not 0
      real(wp), intent(in) :: expected
      !> Simulated value
      real(wp), intent(in) :: got
      !> Greatest relative error
      real(wp), intent(in) :: tolerance

      call add(self, quantity, number(expected), got, abs(got - expected)/abs(expected), tolerance)
   end subroutine expect_relative

   !> Expect a value within a tolerance in its own unit.
   subroutine expect_absolute(self, quantity, expected, got, tolerance)
      class(table_t), intent(inout) :: self
      !> Quantity with its unit
      character(len=*), intent(in) :: quantity
      !> Expected value
      real(wp), intent(in) :: expected
      !> Simulated value
      real(wp), intent(in) :: got
      !> Greatest error
      real(wp), intent(in) :: tolerance

      call add(self, quantity, number(expected), got, abs(got - expected), tolerance)
   end subroutine expect_absolute

   !> Expect a value of at least a bound, such as an order of convergence.
   subroutine expect_least(self, quantity, bound, got)
      class(table_t), intent(inout) :: self
      !> Quantity with its unit
      character(len=*), intent(in) :: quantity
      !> Least accepted value
      real(wp), intent(in) :: bound
      !> Simulated value
      real(wp), intent(in) :: got

      type(row_t) :: row

      row%quantity = quantity
      row%expected = '>= '//number(bound)
      row%got = number(got)
      row%verdict = merge('good  ', 'MISSED', got >= bound)
      call append(self, row)
   end subroutine expect_least

   !> Expect a condition to be true.
   subroutine expect_true(self, quantity, condition)
      class(table_t), intent(inout) :: self
      !> The condition in words
      character(len=*), intent(in) :: quantity
      !> Whether it is true
      logical, intent(in) :: condition
      type(row_t) :: row

      row%quantity = quantity
      row%expected = 'yes'
      row%got = merge('yes', 'no ', condition)
      row%verdict = merge('good  ', 'MISSED', condition)
      call append(self, row)
   end subroutine expect_true

   !> Show a number without an expected value.
   subroutine show(self, quantity, got)
      class(table_t), intent(inout) :: self
      !> Quantity with its unit
      character(len=*), intent(in) :: quantity
      !> Simulated value
      real(wp), intent(in) :: got
      type(row_t) :: row

      row%quantity = quantity
      row%got = number(got)
      row%verdict = 'shown'
      call append(self, row)
   end subroutine show

   !> Add a missed row if a simulation ended with an error.
   subroutine note_error(self, error)
      class(table_t), intent(inout) :: self
      !> Error of the simulation; not allocated if there is none
      type(error_t), allocatable, intent(in) :: error
      type(row_t) :: row

      if (.not. allocated(error)) return
      write (output_unit, '(2a)') '     ', error%message
      row%quantity = 'runs to its end'
      row%expected = 'yes'
      row%got = 'no'
      row%verdict = 'MISSED'
      call append(self, row)
   end subroutine note_error

   !> The table with commas between its columns, and a line of headings
   pure function as_csv(self) result(text)
      class(table_t), intent(in) :: self
      character(len=:), allocatable :: text
      integer :: k

      text = 'benchmark,quantity,expected,got,error,tolerance,seconds,verdict'//line_end
      do k = 1, size(self%rows)
         associate (row => self%rows(k))
            text = text//trim(row%benchmark)//',"'//trim(row%quantity)//'",'//trim(row%expected)//','//trim(row%got)// &
               ','//trim(row%error)//','//trim(row%tolerance)//','//seconds_text(row%seconds)//','// &
               trim(row%verdict)//line_end
         end associate
      end do
   end function as_csv

   !> The table for Markdown
   pure function as_markdown(self) result(text)
      class(table_t), intent(in) :: self
      character(len=:), allocatable :: text
      integer :: k

      text = '| benchmark | quantity | expected | got | error | tolerance | s | verdict |'//line_end// &
         '|---|---|--:|--:|--:|--:|--:|---|'//line_end
      do k = 1, size(self%rows)
         associate (row => self%rows(k))
            text = text//'| '//trim(row%benchmark)//' | '//trim(row%quantity)//' | '//trim(row%expected)//' | '// &
               trim(row%got)//' | '//trim(row%error)//' | '//trim(row%tolerance)//' | '// &
               seconds_text(row%seconds)//' | '//trim(row%verdict)//' |'//line_end
         end associate
      end do
   end function as_markdown

   !> Add a row with an error and its tolerance; NaN exceeds any tolerance.
   subroutine add(self, quantity, expected, got, error, tolerance)
      type(table_t), intent(inout) :: self
      character(len=*), intent(in) :: quantity, expected
      real(wp), intent(in) :: got, error, tolerance
      type(row_t) :: row

      row%quantity = quantity
      row%expected = expected
      row%got = number(got)
      write (row%error, '(es8.1)') error
      write (row%tolerance, '(es8.1)') tolerance
      row%error = adjustl(row%error)
      row%tolerance = adjustl(row%tolerance)
      row%verdict = merge('good  ', 'MISSED', error <= tolerance)
      call append(self, row)
   end subroutine add

   subroutine append(self, row)
      type(table_t), intent(inout) :: self
      type(row_t), intent(in) :: row
      type(row_t) :: finished
      type(row_t), allocatable :: longer(:)

      finished = row
      finished%benchmark = self%benchmark
      finished%seconds = processor_seconds() - self%clock
      self%clock = processor_seconds()
      if (finished%verdict == 'MISSED') self%n_missed = self%n_missed + 1
      allocate (longer(size(self%rows) + 1))
      longer(:size(self%rows)) = self%rows
      longer(size(longer)) = finished
      call move_alloc(longer, self%rows)
      call print_columns(finished, seconds_text(finished%seconds))
   end subroutine append

   subroutine print_columns(row, seconds)
      type(row_t), intent(in) :: row
      character(len=*), intent(in) :: seconds
      character(len=7) :: right

      right = seconds
      right = adjustr(right)
      write (output_unit, '(a5, 1x, a72, 1x, a12, 1x, a12, 1x, a8, 1x, a9, 1x, a7, 1x, a)') row%benchmark, &
         row%quantity, row%expected, row%got, row%error, row%tolerance, right, trim(row%verdict)
      flush (output_unit)
   end subroutine print_columns

   !> A number with six significant digits in the shortest form
   pure function number(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=16) :: buffer

      if (abs(value) < 0.1_wp .or. abs(value) >= 1.0e6_wp) then
         write (buffer, '(es12.4)') value
      else
         write (buffer, '(g0.6)') value
      end if
      if (.not. abs(value) > 0.0_wp) buffer = '0'
      if (ieee_is_nan(value)) buffer = 'NaN'
      text = trim(adjustl(buffer))
   end function number

   !> Processor time of all threads so far [s]. Unlike elapsed time it does not depend on the load of the machine
   real(dp) function processor_seconds()
      call cpu_time(processor_seconds)
   end function processor_seconds

   pure function seconds_text(seconds) result(text)
      real(dp), intent(in) :: seconds
      character(len=:), allocatable :: text
      character(len=12) :: buffer

      write (buffer, '(f10.2)') seconds
      text = trim(adjustl(buffer))
   end function seconds_text

end module verification_table
