!> Serial runs of namelists with walls
module walled_run
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_named_values, only: named_values_t
   use polydem_read_settings, only: read_settings_text
   use polydem_series_row, only: collect_row
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start, only: new_simulation
   use polydem_time_step, only: advance
   implicit none
   private
   public :: start, go, column, message_of

contains

   !> Start a run; `|` is a line end.
   subroutine start(text, simulation, message)
      character(len=*), intent(in) :: text
      type(simulation_t), intent(out) :: simulation
      !> Message of the error; empty if there is none
      character(len=:), allocatable, intent(out) :: message
      type(settings_t) :: settings
      type(error_t), allocatable :: error
      character(len=len(text)) :: lines
      integer :: k

      lines = text
      do k = 1, len(text)
         if (text(k:k) == '|') lines(k:k) = new_line('a')
      end do
      call read_settings_text('t.nml', lines, [character(len=1) ::], settings, error)
      if (.not. allocated(error)) call new_simulation(settings, simulation, error)
      message = ''
      if (allocated(error)) message = error%message
   end subroutine start

   !> Message of the error of a namelist; empty if it starts a run
   function message_of(text) result(message)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: message
      type(simulation_t) :: simulation

      call start(text, simulation, message)
   end function message_of

   !> Advance by some steps; the message of an error is empty if there is none.
   subroutine go(simulation, n, message)
      type(simulation_t), intent(inout) :: simulation
      integer, intent(in) :: n
      character(len=:), allocatable, intent(out) :: message
      type(error_t), allocatable :: error
      integer :: k

      do k = 1, n
         call advance(simulation, error)
         if (allocated(error)) exit
      end do
      message = ''
      if (allocated(error)) message = error%message
   end subroutine go

   !> A column of the series at the end of the last step
   real(wp) function column(simulation, name)
      type(simulation_t), intent(inout) :: simulation
      character(len=*), intent(in) :: name
      integer(ip) :: k

      call collect_row(simulation)
      column = huge(column)
      associate (row => simulation%series%row)
         do k = 1_ip, size(row%label, kind=ip)
            if (row%label(k)%name == name) column = real(row%value(k), wp)
         end do
      end associate
   end function column

end module walled_run
