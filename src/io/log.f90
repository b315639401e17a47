!> The log of a run, on the screen and in log.txt. Each line is written at once and thus survives a crash.
!>
!> A failed write does not stop the run; `check` and `close` report it.
module polydem_log
   use polydem_clock, only: wall_seconds
   use polydem_errors, only: error_t
   use polydem_host, only: is_terminal
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_line_writer, only: line_writer_t
   use polydem_result_files, only: log_name
   use polydem_strings, only: printable
   implicit none
   private
   public :: log_t, line_width

   !> Maximum length of a line of the log
   integer, parameter :: line_width = 110
   !> Minimum time between two updates of the progress line [s]
   real(dp), parameter :: live_interval = 0.2_dp
   !> Minimum time between two progress lines where the screen is no terminal [s]
   real(dp), parameter :: plain_interval = 15.0_dp

   !> A log, open for writing
   type :: log_t
      !> Number of warnings since it was opened
      integer(lp) :: warnings = 0_lp
      !> The screen; closed for a quiet log
      type(line_writer_t), private :: screen
      !> The file log.txt; closed if there is none
      type(line_writer_t), private :: file
      !> Whether only the progress line, and no other, is shown on the screen
      logical, private :: is_brief = .false.
      !> Whether the screen is an interactive terminal and shows a progress line
      logical, private :: is_interactive = .false.
      !> Length of the progress line on the screen
      integer, private :: live_length = 0
      !> Wall-clock time of the last update of the progress line [s]
      real(dp), private :: live_seconds = 0.0_dp
      !> Whether the heading of the interval lines is written
      logical, private :: has_heading = .false.
      !> Step of the last interval line
      integer(lp), private :: last_step = 0_lp
      !> Wall-clock time of the last interval line [s]
      real(dp), private :: last_seconds = 0.0_dp
   contains
      procedure :: open => open_log
      procedure :: write_line
      procedure :: write_interval
      procedure :: show_progress
      procedure :: show_line
      procedure :: check => check_log
      procedure :: close => close_log
   end type log_t

contains

   !> Open a log.
   subroutine open_log(self, folder, error, quiet, appended, brief)
      class(log_t), intent(inout) :: self
      !> Folder of the result, which must exist; empty: no log.txt
      character(len=*), intent(in) :: folder
      type(error_t), allocatable, intent(inout) :: error
      !> Whether nothing is written on the screen; default: false
      logical, intent(in), optional :: quiet
      !> Whether lines are appended to the log of a previous start; default: false
      logical, intent(in), optional :: appended
      !> Whether the screen shows nothing but the progress line; default: false
      logical, intent(in), optional :: brief
      logical :: on_screen

      on_screen = .true.
      if (present(quiet)) on_screen = .not. quiet
      if (on_screen) call self%screen%open_screen()
      self%is_interactive = is_terminal() .and. on_screen
      self%is_brief = .false.
      if (present(brief)) self%is_brief = brief
      self%has_heading = .false.
      if (folder /= '') call self%file%open(folder//'/'//log_name, error, appended)
   end subroutine open_log

   !> Write one or several lines on the screen and into the file. Control characters are replaced.
   subroutine write_line(self, text)
      class(log_t), intent(inout) :: self
      !> The text, without the last line end
      character(len=*), intent(in) :: text

      if (index(text, 'warning: ') == 1) self%warnings = self%warnings + 1_lp
      if (self%live_length > 0) call write_live(self, repeat(' ', self%live_length))
      if (self%live_length > 0) call self%screen%put(achar(13))
      self%live_length = 0
      if (.not. self%is_brief) call self%screen%put_line(printable(text, keeps_lines=.true.))
      call self%file%put_line(printable(text, keeps_lines=.true.))
   end subroutine write_line

   !> Write the line of an interval, with the step rate since the last interval line and the remaining time at this
   !> rate.
   subroutine write_interval(self, step, n_steps, time, dt, contacts, energies)
      class(log_t), intent(inout) :: self
      !> Current step
      integer(lp), intent(in) :: step
      !> Number of steps of the whole run
      integer(lp), intent(in) :: n_steps
      !> Simulated time [s]
      real(wp), intent(in) :: time
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Number of contacts
      integer(ip), intent(in) :: contacts
      !> Kinetic energy and potential energy of gravity [J/m]; absent if the run does not compute them
      real(wp), intent(in), optional :: energies(2)
      character(len=line_width) :: line
      character(len=12) :: energy_texts(2)
      character(len=12) :: rate_text
      real(dp) :: rate, now

      if (.not. self%has_heading) then
         write (line, '(a10,6a12,a10,a11)') 'step', 'time [s]', 'dt [s]', 'kin. [J/m]', 'pot. [J/m]', &
            'contacts', 'steps/s', 'to go', 'done'
         call self%write_line(trim(line))
         self%last_step = step
      end if
      now = wall_seconds()
      rate = rate_until(self, step, now)
      rate_text = '-'
      if (rate > 0.0_dp) write (rate_text, '(f12.1)') min(rate, 9.9e8_dp)
      energy_texts = repeat(' ', 11)//'-'
      if (present(energies)) write (energy_texts, '(es12.4)') energies
      write (line, '(i10,es12.4,es12.3,2a12,i12,a12,a10,f10.1,a)') step, time, dt, energy_texts, &
         contacts, adjustr(rate_text), time_to_go(n_steps - step, rate), percent(step, n_steps), '%'
      call self%write_line(trim(line))
      self%has_heading = .true.
      self%last_step = step
      self%last_seconds = now
   end subroutine write_interval

   !> Update the progress line, a few times per second at most. A no-op unless the screen is an interactive terminal.
   subroutine show_progress(self, step, n_steps, stage)
      class(log_t), intent(inout) :: self
      !> Current step
      integer(lp), intent(in) :: step
      !> Number of steps of the whole run
      integer(lp), intent(in) :: n_steps
      !> Name of the present stage of the run; absent: there are no stages
      character(len=*), intent(in), optional :: stage
      character(len=64) :: text
      real(dp) :: now, rate

      if (.not. self%is_interactive) return
      now = wall_seconds()
      if (now - self%live_seconds < live_interval) return
      rate = rate_until(self, step, now)
      write (text, '(i10,a,i0,a,f5.1,2a)') step, ' of ', n_steps, ' steps,', percent(step, n_steps), &
         '%, to go', time_to_go(n_steps - step, rate)
      if (present(stage)) then
         call write_live(self, trim(text)//', '//stage)
      else
         call write_live(self, trim(text))
      end if
      self%live_seconds = now
   end subroutine show_progress

   !> Show a line of progress: rewritten on a terminal a few times per second, else written now and then.
   subroutine show_line(self, text)
      class(log_t), intent(inout) :: self
      !> The line
      character(len=*), intent(in) :: text
      real(dp) :: now

      now = wall_seconds()
      if (now - self%live_seconds < merge(live_interval, plain_interval, self%is_interactive)) return
      if (self%is_interactive) call write_live(self, text(:min(len(text), line_width)))
      if (.not. self%is_interactive) call self%write_line(text)
      self%live_seconds = now
   end subroutine show_line

   !> Report a failed write to log.txt early, to let the run end soon.
   subroutine check_log(self, error)
      class(log_t), intent(in) :: self
      !> Allocated if a line could not be written
      type(error_t), allocatable, intent(inout) :: error

      call self%file%check(error)
   end subroutine check_log

   !> Close the log.
   subroutine close_log(self, error)
      class(log_t), intent(inout) :: self
      !> Allocated if a line could not be written to the file or the screen
      type(error_t), allocatable, intent(inout), optional :: error
      type(error_t), allocatable :: failure

      call self%file%close(failure)
      call self%screen%close(failure)
      if (.not. present(error) .or. .not. allocated(failure)) return
      if (.not. allocated(error)) call move_alloc(failure, error)
   end subroutine close_log

   !> Overwrite the progress line.
   subroutine write_live(self, text)
      type(log_t), intent(inout) :: self
      character(len=*), intent(in) :: text

      call self%screen%put(achar(13)//text//repeat(' ', max(0, self%live_length - len(text))))
      self%live_length = len(text)
   end subroutine write_live

   !> Steps per second since the last interval line; 0 if unknown
   pure real(dp) function rate_until(self, step, now)
      type(log_t), intent(in) :: self
      !> Current step
      integer(lp), intent(in) :: step
      !> Wall-clock time [s]
      real(dp), intent(in) :: now

      rate_until = 0.0_dp
      if (self%has_heading .and. step > self%last_step .and. now > self%last_seconds) &
         rate_until = real(step - self%last_step, dp)/(now - self%last_seconds)
   end function rate_until

   !> Progress of the run [%]
   pure real(dp) function percent(step, n_steps)
      integer(lp), intent(in) :: step, n_steps

      percent = 100.0_dp*real(step, dp)/real(max(1_lp, n_steps), dp)
   end function percent

   !> Remaining time as hours, minutes and seconds; '-' if the rate is unknown
   pure function time_to_go(steps, rate) result(text)
      integer(lp), intent(in) :: steps
      real(dp), intent(in) :: rate
      character(len=10) :: text
      integer(lp) :: seconds

      text = '         -'
      if (rate <= 0.0_dp) return
      seconds = nint(min(real(steps, dp)/rate, 3.59e6_dp), lp)
      write (text, '(i4,a,i2.2,a,i2.2)') seconds/3600_lp, ':', mod(seconds/60_lp, 60_lp), ':', &
         mod(seconds, 60_lp)
   end function time_to_go

end module polydem_log
