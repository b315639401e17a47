!> Checkpoints for fuzzing: one of a small run as fields to be spoilt, and a run that goes on from what came of them.
module spoilt_checkpoint
   use hostile_fields, only: field_t, new_field
   use polydem_checkpoint_fields, only: restarts_t, serialize_run
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_errors, only: error_t
   use polydem_file_checksum, only: append_checksum, checksum_length
   use polydem_kinds, only: dp, lp
   use polydem_monitor, only: new_monitor, monitor_t
   use polydem_read_settings, only: read_settings_text
   use polydem_serializer, only: serializer_t
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start, only: new_simulation
   use polydem_text_file, only: read_text_file
   use polydem_time_step, only: advance
   implicit none
   private
   public :: sound_checkpoint, put_behind_seal, go_on_from

   !> Four blocks on each other, with friction, the energy guard and an integrator that has columns of its own
   character(len=*), parameter :: scene = "&scene name = 'stack' bodies = 4 width = 1e-2 height = 1e-2 / "// &
      "&integrate scheme = 'gear' duration = 1 / &guards energy = 'stop' /"
   !> Steps before the checkpoint, and after it
   integer, parameter :: steps_before = 20, steps_after = 3
   !> Hash of the bodies at the start, as far as fields that hold real numbers know
   integer(lp), parameter :: any_hash = 4711_lp
   character(len=*), parameter :: none(*) = [character(len=1) ::]

   !> An archive whose columns become fields
   type, extends(serializer_t) :: field_serializer_t
      !> The columns so far
      type(field_t), allocatable :: fields(:)
   contains
      procedure :: transfer_reals
      procedure :: transfer_longs
   end type field_serializer_t

contains

   !> The columns of a sound checkpoint
   function sound_checkpoint() result(fields)
      type(field_t), allocatable :: fields(:)
      type(field_serializer_t) :: serializer
      type(simulation_t) :: simulation
      type(restarts_t) :: restarts
      type(monitor_t) :: monitor
      type(error_t), allocatable :: error

      call begin(simulation, monitor, error)
      call do_steps(simulation, steps_before, error)
      if (allocated(error)) error stop 'fuzz: the run of the checkpoint fails'
      allocate (serializer%fields(0))
      restarts%scene = any_hash
      call serialize_run(serializer, simulation, restarts)
      call move_alloc(serializer%fields, fields)
   end function sound_checkpoint

   !> Turn an HDF5 file into a sealed one: HDF5 finds its data behind the seal.
   subroutine put_behind_seal(path)
      !> Path of the file
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: bytes
      type(error_t), allocatable :: error
      integer :: unit

      call read_text_file(path, bytes, error)
      if (allocated(error)) error stop 'fuzz: a file that was just written cannot be read'
      open (newunit=unit, file=path, access='stream', form='unformatted', action='write', status='replace')
      write (unit) repeat(' ', checksum_length), bytes
      close (unit)
      call append_checksum(path, error)
   end subroutine put_behind_seal

   !> Let the small run go on from a checkpoint.
   subroutine go_on_from(path, error)
      !> Path of the checkpoint
      character(len=*), intent(in) :: path
      !> Why it was refused, or why the run stopped
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(simulation_t) :: simulation
      type(restarts_t) :: restarts
      type(monitor_t) :: monitor

      call begin(simulation, monitor, error)
      restarts%scene = any_hash
      call file%open(path, error)
      if (allocated(error)) return
      call serialize_run(file, simulation, restarts)
      call file%close(error)
      if (allocated(error)) error%message = path//' does not fit this run: '//error%message
      call do_steps(simulation, steps_after, error)
   end subroutine go_on_from

   subroutine begin(simulation, monitor, error)
      type(simulation_t), intent(out) :: simulation
      type(monitor_t), intent(out) :: monitor
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings

      call read_settings_text('small.nml', scene, none, settings, error)
      if (.not. allocated(error)) call new_simulation(settings, simulation, error)
      if (.not. allocated(error)) call new_monitor(monitor, simulation)
   end subroutine begin

   subroutine do_steps(simulation, n, error)
      type(simulation_t), intent(inout) :: simulation
      integer, intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, n
         if (.not. allocated(error)) call advance(simulation, error)
      end do
   end subroutine do_steps

   !> Take a column of real numbers as a field.
   subroutine transfer_reals(self, name, width, values, unit, meaning)
      class(field_serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      associate (unused => unit//meaning)
      end associate
      if (width == 1) self%fields = [self%fields, new_field(name, [size(values)], values, .false.)]
      if (width > 1) self%fields = [self%fields, new_field(name, [width, size(values)/width], values, .false.)]
   end subroutine transfer_reals

   !> Take a column of integers as a field.
   subroutine transfer_longs(self, name, width, values, unit, meaning)
      class(field_serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      associate (unused => unit//meaning, unused_width => width)
      end associate
      self%fields = [self%fields, new_field(name, [size(values)], real(values, dp), .true.)]
   end subroutine transfer_longs

end module spoilt_checkpoint
