!> The table of the verification benchmarks: what was expected, what came out, and whether that is near enough.
!>
!> A benchmark calls `begin` and then one of the `expect_` procedures per quantity; each prints its row at once.
!> `show` records a number without a verdict, such as the same quantity at another stiffness, which tells why a row
!> is off by what it is off.
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
      !> What it should be, or its bound
      character(len=16) :: expected = ''
      !> What it is
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
      !> Rows that missed their tolerance
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

   !> Begin a benchmark: its rows follow.
   subroutine begin(self, benchmark, title)
      class(table_t), intent(inout) :: self
      !> Its name in the table, such as B8
      character(len=*), intent(in) :: benchmark
      !> What it is
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

   !> A quantity that should have a value up to a relative tolerance.
   subroutine expect_relative(self, quantity, expected, got, tolerance)
      class(table_t), intent(inout) :: self
      !> Quantity with its unit
      character(len=*), intent(in) :: quantity
      !> What it should be, not 0
      real(wp), intent(in) :: expected
      !> What it is
      real(wp), intent(in) :: got
      !> Greatest relative error
      real(wp), intent(in) :: tolerance

      call add(self, quantity, number(expected), got, abs(got - expected)/abs(expected), tolerance)
   end subroutine expect_relative

   !> A quantity that should have a value up to a tolerance in its own unit.
   subroutine expect_absolute(self, quantity, expected, got, tolerance)
      class(table_t), intent(inout) :: self
      !> Quantity with its unit
      character(len=*), intent(in) :: quantity
      !> What it should be
      real(wp), intent(in) :: expected
      !> What it is
      real(wp), intent(in) :: got
      !> Greatest error
      real(wp), intent(in) :: tolerance

      call add(self, quantity, number(expected), got, abs(got - expected), tolerance)
   end subroutine expect_absolute

   !> A quantity that must reach a bound, such as an order of convergence.
   subroutine expect_least(self, quantity, bound, got)
      class(table_t), intent(inout) :: self
      !> Quantity with its unit
      character(len=*), intent(in) :: quantity
      !> Least value
      real(wp), intent(in) :: bound
      !> What it is
      real(wp), intent(in) :: got

      type(row_t) :: row

      row%quantity = quantity
      row%expected = '>= '//number(bound)
      row%got = number(got)
      row%verdict = merge('good  ', 'MISSED', got >= bound)
      call append(self, row)
   end subroutine expect_least

   !> Something that must be so.
   subroutine expect_true(self, quantity, condition)
      class(table_t), intent(inout) :: self
      !> What is asked
      character(len=*), intent(in) :: quantity
      !> Whether it is so
      logical, intent(in) :: condition
      type(row_t) :: row

      row%quantity = quantity
      row%expected = 'yes'
      row%got = merge('yes', 'no ', condition)
      row%verdict = merge('good  ', 'MISSED', condition)
      call append(self, row)
   end subroutine expect_true

   !> A number of which nothing is expected.
   subroutine show(self, quantity, got)
      class(table_t), intent(inout) :: self
      !> Quantity with its unit
      character(len=*), intent(in) :: quantity
      !> What it is
      real(wp), intent(in) :: got
      type(row_t) :: row

      row%quantity = quantity
      row%got = number(got)
      row%verdict = 'shown'
      call append(self, row)
   end subroutine show

   !> A row that is missed if a simulation ended with an error, and nothing otherwise.
   subroutine note_error(self, error)
      class(table_t), intent(inout) :: self
      !> Error of a simulation, if it had one
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

   !> A row with an error and its tolerance; NaN fulfils no tolerance.
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

   !> A number with six significant digits, as short as can be
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

   !> Processor time of all threads so far: unlike elapsed time the same on a busy machine [s]
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
