!> One case of each kind: input that was sound and is spoilt, given to the reader that takes it. What is read is used.
module fuzz_cases
   use damaged_text, only: damage, damage_bytes
   use hostile_fields, only: field_t, new_field, new_text, spoil_fields
   use hostile_file, only: write_hostile_file
   use spoilt_checkpoint, only: go_on_from, put_behind_seal, sound_checkpoint
   use polydem_bench_settings, only: bench_settings_t
   use polydem_bodies, only: bodies_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip
   use polydem_namelist_entries, only: choices_of
   use polydem_random, only: random_t
   use polydem_read_bench, only: read_bench_text
   use polydem_read_settings, only: read_settings_text
   use polydem_replay, only: replay_trace
   use polydem_result_info, only: describe_result
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_start, only: new_simulation
   use polydem_time_step, only: advance
   use polydem_trajectory_reader, only: read_packing
   implicit none
   private
   public :: try_namelist, try_override, try_scene, try_bodies, try_trace, try_checkpoint, try_segment, try_bytes, &
      write_sound_file

   !> Spoilt input, and input that was read
   character(len=*), parameter, public :: spoilt_file = 'spoilt.h5'
   !> Steps that a simulation of a spoilt input does
   integer, parameter :: n_steps = 3
   !> Larger scenes are not built
   integer(ip), parameter :: most_bodies = 60_ip
   character(len=*), parameter :: none(*) = [character(len=1) ::]

contains

   !> A namelist of a run or a bench; what is read must give itself again.
   subroutine try_namelist(random, sound, error)
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> A namelist of this repository
      character(len=*), intent(in) :: sound
      !> Why it was refused
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings, again
      type(bench_settings_t) :: bench
      character(len=:), allocatable :: text

      text = sound
      call damage(random, text)
      if (index(sound, '&bench') > 0) then
         call read_bench_text('spoilt.nml', text, none, bench, error)
         return
      end if
      call read_settings_text('spoilt.nml', text, none, settings, error)
      if (allocated(error)) return
      call read_settings_text('spoilt.nml', settings%resolved, none, again, error)
      if (.not. allocated(error)) then
         if (again%resolved == settings%resolved) return
      end if
      error stop 'a namelist that was read does not give itself again'
   end subroutine try_namelist

   !> An override of the command line
   subroutine try_override(random, sound, error)
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> A namelist of a run
      character(len=*), intent(in) :: sound
      !> Why it was refused
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings
      character(len=:), allocatable :: text
      character(len=*), parameter :: overrides(*) = [character(len=40) :: 'forces.gravity=1.5e1,2', 'scene.seed=7', &
         'output.folder=a b', 'neighbours.finder=verlet', 'integrate.dt=1e-5', 'motion.turn.bodies=1,2,3']

      text = trim(overrides(random%whole(1_ip, size(overrides, kind=ip))))
      call damage(random, text)
      call read_settings_text('sound.nml', sound, [text], settings, error)
   end subroutine try_override

   !> A whole simulation of a few bodies of a namelist
   subroutine try_scene(random, sound, error)
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> A namelist of a run
      character(len=*), intent(in) :: sound
      !> Why it was refused or stopped
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings
      character(len=:), allocatable :: text
      character(len=40) :: overrides(2)

      text = sound
      call damage(random, text)
      overrides = ['integrate.duration=1   ', 'output.log_interval=0  ']
      call read_settings_text('spoilt.nml', text, overrides, settings, error)
      if (allocated(error)) return
      settings%scene%bodies = min(settings%scene%bodies, most_bodies)
      settings%scene%boxes = min(settings%scene%boxes, most_bodies)
      if (settings%scene%packing == '') call simulate(settings, error)
   end subroutine try_scene

   !> A bodies file, and a simulation of what it holds
   subroutine try_bodies(random, error)
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> Why it was refused
      type(error_t), allocatable, intent(inout) :: error
      type(field_t) :: fields(9)

      fields = sound_bodies()
      call spoil_fields(random, fields)
      call write_hostile_file(spoilt_file, fields, random, .false.)
      call read_bodies(error)
   end subroutine try_bodies

   !> A trace, and a replay of it through any finder
   subroutine try_trace(random, error)
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> Why it was refused
      type(error_t), allocatable, intent(inout) :: error
      type(field_t) :: fields(8)

      fields = sound_trace()
      call spoil_fields(random, fields)
      call write_hostile_file(spoilt_file, fields, random, random%whole(1_ip, 2_ip) == 1_ip)
      call replay(random, error)
   end subroutine try_trace

   !> A checkpoint whose seal is right, and the run that goes on from it
   subroutine try_checkpoint(random, sound, error)
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> What a sound one holds
      type(field_t), intent(in) :: sound(:)
      !> Why it was refused
      type(error_t), allocatable, intent(inout) :: error
      type(field_t), allocatable :: fields(:)

      fields = sound
      call spoil_fields(random, fields)
      call write_hostile_file(spoilt_file, fields, random, .false.)
      call put_behind_seal(spoilt_file)
      call go_on_from(spoilt_file, error)
   end subroutine try_checkpoint

   !> A segment of a trajectory with the texts of a profile, as a packing or as a result to describe
   subroutine try_segment(kind_of_use, random, error)
      !> packing or result
      character(len=*), intent(in) :: kind_of_use
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> Why it was refused
      type(error_t), allocatable, intent(inout) :: error
      type(field_t) :: fields(12)

      fields = sound_segment()
      call spoil_fields(random, fields)
      call write_hostile_file(spoilt_file, fields, random, .false.)
      call read_segment(kind_of_use, error)
   end subroutine try_segment

   !> A file with spoilt bytes
   subroutine try_bytes(kind_of_file, random, sound, error)
      !> bodies, trace, checkpoint, packing or result
      character(len=*), intent(in) :: kind_of_file
      !> Random numbers
      type(random_t), intent(inout) :: random
      !> The bytes of a sound file
      character(len=*), intent(in) :: sound
      !> Why it was refused
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: bytes
      integer :: unit

      bytes = sound
      call damage_bytes(random, bytes)
      open (newunit=unit, file=spoilt_file, access='stream', form='unformatted', action='write', status='replace')
      write (unit) bytes
      close (unit)
      select case (kind_of_file)
      case ('bodies')
         call read_bodies(error)
      case ('trace')
         call replay(random, error)
      case ('checkpoint')
         call go_on_from(spoilt_file, error)
         if (.not. allocated(error) .and. bytes /= sound) error stop 'a spoilt checkpoint is taken for a sound one'
      case default
         call read_segment(kind_of_file, error)
      end select
   end subroutine try_bytes

   !> Write a sound file.
   subroutine write_sound_file(kind_of_file, path, random)
      !> bodies, trace, checkpoint, packing or result
      character(len=*), intent(in) :: kind_of_file
      !> Where to
      character(len=*), intent(in) :: path
      !> Random numbers, of which none is used
      type(random_t), intent(inout) :: random

      select case (kind_of_file)
      case ('bodies')
         call write_hostile_file(path, sound_bodies(), random, .false.)
      case ('trace')
         call write_hostile_file(path, sound_trace(), random, .false.)
      case ('checkpoint')
         call write_hostile_file(path, sound_checkpoint(), random, .false.)
         call put_behind_seal(path)
      case default
         call write_hostile_file(path, sound_segment(), random, .false.)
      end select
   end subroutine write_sound_file

   subroutine read_segment(kind_of_use, error)
      character(len=*), intent(in) :: kind_of_use
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: bodies

      if (kind_of_use == 'packing') then
         call read_packing(spoilt_file, bodies, error)
         if (allocated(error)) error%message = spoilt_file//': '//error%message
      else
         call describe_result(spoilt_file, error)
      end if
   end subroutine read_segment

   subroutine read_bodies(error)
      type(error_t), allocatable, intent(inout) :: error
      type(settings_t) :: settings

      call read_settings_text('file.nml', "&scene name = 'file' bodies_file = '"//spoilt_file//"' /"// &
                              " &integrate duration = 1 /", none, settings, error)
      if (.not. allocated(error)) call simulate(settings, error)
   end subroutine read_bodies

   subroutine replay(random, error)
      type(random_t), intent(inout) :: random
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: finders(:)

      finders = choices_of('neighbours', 'finder')
      call replay_trace(spoilt_file, trim(finders(random%whole(1_ip, size(finders, kind=ip)))), 1_ip, 1_ip, error)
   end subroutine replay

   subroutine simulate(settings, error)
      type(settings_t), intent(in) :: settings
      type(error_t), allocatable, intent(inout) :: error
      type(simulation_t) :: simulation
      integer :: k

      call new_simulation(settings, simulation, error)
      do k = 1, n_steps
         if (.not. allocated(error)) call advance(simulation, error)
      end do
   end subroutine simulate

   !> A square on a floor, a triangle and a pentagon above
   function sound_bodies() result(fields)
      type(field_t) :: fields(9)
      real(dp), parameter :: zeros(4) = 0.0_dp

      fields(1) = new_field('vertex', [2, 16], [0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 1.0_dp, 1.0_dp, 0.0_dp, 1.0_dp, &
         -5.0_dp, -1.0_dp, 9.0_dp, -1.0_dp, 9.0_dp, 1.0e-3_dp, -5.0_dp, 1.0e-3_dp, &
         2.0_dp, 0.5_dp, 3.0_dp, 0.5_dp, 2.0_dp, 1.5_dp, &
         4.0_dp, 2.0_dp, 5.0_dp, 2.0_dp, 5.5_dp, 3.0_dp, 4.5_dp, 3.5_dp, 3.5_dp, 3.0_dp], .false.)
      fields(2) = new_field('vertex_start', [5], [0.0_dp, 4.0_dp, 8.0_dp, 11.0_dp, 16.0_dp], .true.)
      fields(3) = new_field('fixed', [4], [0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp], .true.)
      fields(4) = new_field('velocity', [2, 4], [zeros, 1.0_dp, 2.0_dp, -1.0_dp, 0.5_dp], .false.)
      fields(5) = new_field('angular_velocity', [4], [1.0_dp, 0.0_dp, -2.0_dp, 3.0_dp], .false.)
      fields(6) = new_field('density', [4], [1.0_dp, 2.0_dp, 1.0e3_dp, 2.0e3_dp], .false.)
      fields(7) = new_field('mass', [4], zeros, .false.)
      fields(8) = new_field('inertia', [4], zeros, .false.)
      fields(9) = new_field('id', [4], [4.0_dp, 3.0_dp, 2.0_dp, 7.0_dp], .true.)
   end function sound_bodies

   !> Two boxes of one fixed body and three of free ones in three steps
   function sound_trace() result(fields)
      type(field_t) :: fields(8)
      real(dp) :: boxes(4, 5), steps(4, 5, 3)
      integer :: k

      boxes = reshape([0.0_dp, -1.0_dp, 4.0_dp, 0.1_dp, 4.0_dp, -1.0_dp, 8.0_dp, 0.1_dp, &
                       1.0_dp, 0.0_dp, 2.0_dp, 1.0_dp, 1.5_dp, 0.5_dp, 2.5_dp, 1.5_dp, &
                       6.0_dp, 3.0_dp, 7.0_dp, 4.0_dp], [4, 5])
      do k = 1, 3
         steps(:, :, k) = boxes
         steps(:, 4:5, k) = boxes(:, 4:5) - 0.7_dp*real(k - 1, dp)
      end do
      fields(1) = new_field('aabb', [4, 5, 3], reshape(steps, [size(steps)]), .false.)
      fields(2) = new_field('is_wall', [5], [1.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp], .true.)
      fields(3) = new_field('body', [5], [1.0_dp, 1.0_dp, 2.0_dp, 3.0_dp, 4.0_dp], .true.)
      fields(4) = new_field('reach', [5], [4.0_dp, 4.0_dp, 0.7_dp, 0.7_dp, 0.7_dp], .false.)
      fields(5) = new_field('npairs', [3], [2.0_dp, 3.0_dp, 3.0_dp], .true.)
      fields(6) = new_field('vertices', [2, 3], [0.0_dp, 0.0_dp, 1.0_dp, 0.0_dp, 0.0_dp, 1.0_dp], .false.)
      fields(7) = new_field('vertex_offset', [6], [0.0_dp, 0.0_dp, 0.0_dp, 3.0_dp, 3.0_dp, 3.0_dp], .true.)
      fields(8) = new_field('other', [1], [0.0_dp], .false.)
   end function sound_trace

   !> Two frames of a square and a triangle, and what a profile says
   function sound_segment() result(fields)
      type(field_t) :: fields(12)

      fields(1) = new_field('bodies/fixed', [2], [0.0_dp, 1.0_dp], .true.)
      fields(2) = new_field('bodies/vertex_start', [3], [0.0_dp, 4.0_dp, 7.0_dp], .true.)
      fields(3) = new_field('bodies/vertex', [2, 7], [-0.5_dp, -0.5_dp, 0.5_dp, -0.5_dp, 0.5_dp, 0.5_dp, &
         -0.5_dp, 0.5_dp, -1.0_dp, -1.0_dp, 2.0_dp, -1.0_dp, -1.0_dp, 2.0_dp], .false.)
      fields(4) = new_field('frames/position', [2, 4], [0.0_dp, 0.0_dp, 3.0_dp, 3.0_dp, &
         0.1_dp, 0.0_dp, 3.0_dp, 3.0_dp], .false.)
      fields(5) = new_field('frames/angle', [4], [0.0_dp, 0.0_dp, 0.2_dp, 0.0_dp], .false.)
      fields(6) = new_field('frames/time', [2], [0.0_dp, 0.5_dp], .false.)
      fields(7) = new_text('state_hash', '0123456789abcdef')
      fields(8) = new_text('status', 'finished')
      fields(9) = new_text('provenance/version', '0.1.0')
      fields(10) = new_text('provenance/revision', 'none')
      fields(11) = new_text('provenance/compiler', repeat('GCC ', 50))
      fields(12) = new_field('frames/start', [3], [0.0_dp, 2.0_dp, 4.0_dp], .true.)
   end function sound_segment

end module fuzz_cases
