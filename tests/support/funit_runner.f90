!> Runs tests and reports them in pFUnit's words; unlike pFUnit, failures give a non-zero exit code, and
!> so do unknown options and a filter that matches nothing.
module funit_runner
   use, intrinsic :: ieee_arithmetic, only: ieee_all, ieee_get_halting_mode, ieee_set_halting_mode
   use, intrinsic :: iso_fortran_env, only: output_unit
   use funit_exceptions, only: anyExceptions, clear, pending
   implicit none
   private
   public :: runner_t

   !> Exit code of failures
   integer, parameter :: failure = 2
   !> Exit code of a wrong command line
   integer, parameter :: misuse = 3

   abstract interface
      !> A test, or what runs before or after it
      subroutine body()
      end subroutine body
   end interface

   !> A test and its verdict
   type :: test_t
      !> Name of its suite, the module with `_suite` behind it
      character(len=:), allocatable :: suite
      !> Its own name
      character(len=:), allocatable :: name
      !> What runs
      procedure(body), pointer, nopass :: run => null()
      !> What runs before and after it, if anything
      procedure(body), pointer, nopass :: before => null()
      procedure(body), pointer, nopass :: after => null()
      !> Whether the filter lets it through
      logical :: chosen = .true.
      !> What failed, empty if nothing did
      character(len=:), allocatable :: failures
   end type test_t

   !> All tests of a program
   type :: runner_t
      private
      type(test_t), allocatable :: tests(:)
      character(len=:), allocatable :: filter
      character(len=:), allocatable :: output
      logical :: verbose = .false.
      logical :: xml = .false.
   contains
      procedure :: add
      procedure :: run
   end type runner_t

contains

   !> Append a test.
   subroutine add(self, suite, name, test, before, after)
      class(runner_t), intent(inout) :: self
      !> Name of its suite
      character(len=*), intent(in) :: suite
      !> Its own name
      character(len=*), intent(in) :: name
      !> What runs
      procedure(body) :: test
      !> What runs before it
      procedure(body), optional :: before
      !> What runs after it
      procedure(body), optional :: after
      type(test_t) :: new

      new%suite = suite
      new%name = name
      new%failures = ''
      new%run => test
      if (present(before)) new%before => before
      if (present(after)) new%after => after
      if (.not. allocated(self%tests)) allocate (self%tests(0))
      self%tests = [self%tests, new]
   end subroutine add

   !> Run the tests that the command line chooses, report, and end the program.
   subroutine run(self)
      class(runner_t), intent(inout) :: self
      integer :: k, unit
      logical :: any_failed

      if (.not. allocated(self%tests)) allocate (self%tests(0))
      call read_command_line(self)
      if (.not. any(self%tests%chosen)) call abort_all('no test matches "'//self%filter//'"')
      unit = output_unit
      if (len(self%output) > 0) open (newunit=unit, file=self%output, status='replace', action='write')
      do k = 1, size(self%tests)
         if (self%tests(k)%chosen) call run_test(self%tests(k), unit, self%verbose, self%xml)
      end do
      any_failed = failed(self%tests) > 0
      if (self%xml) then
         call write_xml(unit, self%tests)
      else
         call write_text(unit, self%tests)
      end if
      if (any_failed) then
         write (output_unit, '(a)') ' *** Encountered 1 or more failures/errors during testing. ***'
         flush (output_unit)
         stop failure
      end if
   end subroutine run

   !> Set the options; `-f` compares with `suite.test`.
   subroutine read_command_line(self)
      class(runner_t), intent(inout) :: self
      character(len=:), allocatable :: word
      integer :: k

      self%filter = ''
      self%output = ''
      k = 1
      do while (k <= command_argument_count())
         word = argument(k)
         select case (word)
         case ('-v', '--verbose')
            self%verbose = .true.
         case ('-x', '--xml')
            self%xml = .true.
         case ('-f', '--filter')
            k = k + 1
            self%filter = argument(k)
         case ('-o', '--output')
            k = k + 1
            self%output = argument(k)
         case ('-h', '--help')
            write (output_unit, '(a)') 'options: -f TEXT (only tests whose suite.name contains it), '// &
               '-v (names), -x (JUnit XML), -o FILE (where to write), -h'
            stop
         case default
            call abort_all('unknown option '//word)
         end select
         k = k + 1
      end do
      do k = 1, size(self%tests)
         self%tests(k)%chosen = index(full_name(self%tests(k)), self%filter) > 0
      end do
   end subroutine read_command_line

   !> One word of the command line
   function argument(place) result(word)
      integer, intent(in) :: place
      character(len=:), allocatable :: word
      integer :: length

      if (place > command_argument_count()) call abort_all('the last option lacks its value')
      call get_command_argument(place, length=length)
      allocate (character(len=length) :: word)
      call get_command_argument(place, word)
   end function argument

   !> End the program because of its command line.
   subroutine abort_all(message)
      character(len=*), intent(in) :: message

      write (output_unit, '(a)') 'tests: '//message
      flush (output_unit)
      stop misuse
   end subroutine abort_all

   !> Before, test and after; after also if the test failed, neither if before did. A test may switch off that invalid
   !> operations end the program.
   subroutine run_test(test, unit, verbose, quiet)
      type(test_t), intent(inout) :: test
      integer, intent(in) :: unit
      logical, intent(in) :: verbose, quiet
      logical :: halting(size(ieee_all))

      call ieee_get_halting_mode(ieee_all, halting)
      call clear()
      if (verbose .and. .not. quiet) then
         write (unit, '(a)') 'Start: <'//full_name(test)//'>'
         flush (unit)
      end if
      if (associated(test%before)) call test%before()
      if (.not. anyExceptions()) then
         call test%run()
         if (associated(test%after)) call test%after()
      end if
      call ieee_set_halting_mode(ieee_all, halting)
      test%failures = pending()
      if (quiet) return
      if (verbose) then
         write (unit, '(a)') '  End: <'//full_name(test)//'>'
      else
         write (unit, '(a)', advance='no') merge('F', '.', len(test%failures) > 0)
      end if
      flush (unit)
   end subroutine run_test

   !> suite.name
   function full_name(test) result(name)
      type(test_t), intent(in) :: test
      character(len=:), allocatable :: name

      name = test%suite//'.'//test%name
   end function full_name

   !> How many tests failed
   integer function failed(tests)
      type(test_t), intent(in) :: tests(:)
      integer :: k

      failed = 0
      do k = 1, size(tests)
         if (len(tests(k)%failures) > 0) failed = failed + 1
      end do
   end function failed

   !> The report for people.
   subroutine write_text(unit, tests)
      integer, intent(in) :: unit
      type(test_t), intent(in) :: tests(:)
      integer :: k, n_run

      n_run = count(tests%chosen)
      write (unit, '(a)') ''
      do k = 1, size(tests)
         if (len(tests(k)%failures) == 0) cycle
         write (unit, '(a)') 'Failure', ' in: '//full_name(tests(k)), tests(k)%failures, ''
      end do
      if (failed(tests) > 0) then
         write (unit, '(a)') ' FAILURES!!!'
         write (unit, '(a, i0, a, i0, a)') 'Tests run: ', n_run, ', Failures: ', failed(tests), ', Errors: 0'
      else
         write (unit, '(a)') ' OK'
         write (unit, '(a, i0, a)') ' (', n_run, trim(merge(' test ', ' tests', n_run == 1))//')'
      end if
      flush (unit)
   end subroutine write_text

   !> The report for machines, in the form of JUnit.
   subroutine write_xml(unit, tests)
      integer, intent(in) :: unit
      type(test_t), intent(in) :: tests(:)
      integer :: k

      write (unit, '(a)') '<?xml version="1.0" encoding="UTF-8"?>'
      write (unit, '(a, 2(i0, a))') '<testsuite name="all" tests="', count(tests%chosen), &
         '" failures="', failed(tests), '" errors="0">'
      do k = 1, size(tests)
         if (.not. tests(k)%chosen) cycle
         write (unit, '(a)') '<testcase classname="'//tests(k)%suite//'" name="'//tests(k)%name//'">'
         if (len(tests(k)%failures) > 0) then
            write (unit, '(a)') '<failure message="'//escaped(tests(k)%failures)//'"/>'
         end if
         write (unit, '(a)') '</testcase>'
      end do
      write (unit, '(a)') '</testsuite>'
      flush (unit)
   end subroutine write_xml

   !> Text fit for an attribute in XML
   function escaped(text) result(safe)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: safe
      integer :: k

      safe = ''
      do k = 1, len(text)
         select case (text(k:k))
         case ('<')
            safe = safe//'&lt;'
         case ('>')
            safe = safe//'&gt;'
         case ('&')
            safe = safe//'&amp;'
         case ('"')
            safe = safe//'&quot;'
         case (new_line('a'))
            safe = safe//'&#10;'
         case default
            safe = safe//text(k:k)
         end select
      end do
   end function escaped

end module funit_runner
