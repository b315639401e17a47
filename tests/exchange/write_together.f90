!> Writes a trajectory and a checkpoint, once by one process that has all bodies and once by all processes of the run
!> together, and compares: numbers, their order, the sums of forces on fixed bodies, and the hash of the state.
!>
!>     mpirun -n 4 write_together
!>
!> Silent if all is well; else a message and code 1.
program write_together
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: error_unit
   use compare_files, only: expect_equal_files
   use polydem_bodies, only: state_hash
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_common_hash, only: hash_all_bodies
   use polydem_errors, only: error_t, io_error, raise, run_error
   use polydem_hdf5_file, only: start_library
   use polydem_join_team, only: join_team
   use polydem_kinds, only: ip, lp, wp
   use polydem_ledger_row, only: ledger_row_t
   use polydem_lone_team, only: lone_team_t
   use polydem_own_rows, only: lay_out_bodies, lay_out_pairs, lay_out_parts
   use polydem_provenance, only: provenance_t
   use polydem_row_blocks, only: row_blocks_t
   use polydem_strings, only: to_text
   use polydem_team, only: team_t
   use polydem_trajectory, only: trajectory_t
   use polydem_wall_forces, only: complete_wall_forces
   use sample, only: sample_provenance, sample_row
   use spread_world, only: part_of_world, whole_world, world_t
   implicit none

   interface
      !> C exit: ends the program with a code and without a word
      subroutine c_exit(code) bind(C, name='exit')
         import :: c_int
         integer(c_int), value :: code
      end subroutine c_exit
   end interface

   !> Frames, and frames in a segment
   integer(lp), parameter :: n_frames = 3_lp
   integer(ip), parameter :: per_segment = 2_ip
   !> What is compared
   character(len=*), parameter :: in_segments(23) = [character(len=24) :: '/bodies/id', '/bodies/fixed', &
      '/bodies/mass', '/bodies/inertia', '/bodies/vertex_start', '/bodies/vertex', '/walls/id', '/walls/force', &
      '/walls/torque', '/frames/step', '/frames/time', '/frames/position', '/frames/angle', '/frames/velocity', &
      '/frames/angular_velocity', '/contacts/start', '/contacts/first', '/contacts/second', '/contacts/area', &
      '/contacts/point', '/contacts/normal', '/contacts/force', '/ledger/kinetic']
   character(len=*), parameter :: in_checkpoint(9) = [character(len=24) :: '/run/sums', '/bodies/id', &
      '/bodies/position', '/bodies/angle', '/bodies/force', '/boxes/bounds', '/pairs/first', '/pairs/second', &
      '/pairs/tangential']

   class(team_t), allocatable :: team
   type(error_t), allocatable :: error
   character(len=:), allocatable :: folder

   call start_library(error)
   call join_team(team, error)
   folder = 'together_'//to_text(team%size)
   call write_both(error)
   if (.not. allocated(error)) call compare_hashes(error)
   if (.not. allocated(error)) call refuse_a_bad_folder(error)
   if (allocated(error) .and. team%leads()) then
      write (error_unit, '(a)') error%message
      flush (error_unit)
   end if
   call team%leave()
   if (allocated(error)) call c_exit(1_c_int)

contains

   subroutine write_both(error)
      type(error_t), allocatable, intent(inout) :: error
      type(lone_team_t) :: alone
      integer(ip) :: k

      if (team%leads()) call write_all(alone, folder//'_alone', error)
      call team%agree(error)
      if (allocated(error)) return
      call write_all(team, folder, error)
      if (team%leads() .and. .not. allocated(error)) then
         do k = 1_ip, 2_ip
            call expect_equal_files(folder//'_alone/trajectory_000'//to_text(k)//'.h5', &
                                    folder//'/trajectory_000'//to_text(k)//'.h5', in_segments, error)
         end do
         call expect_equal_files(folder//'_alone/checkpoint_1.h5', folder//'/checkpoint_1.h5', in_checkpoint, error)
         if (.not. allocated(error)) call read_checkpoint(error)
      end if
      call team%agree(error)
   end subroutine write_both

   !> The part of the world of a process, complete
   subroutine make_part(team, step, world)
      class(team_t), intent(inout) :: team
      integer(lp), intent(in) :: step
      type(world_t), intent(out) :: world

      if (team%size == 1_ip) call whole_world(step, world)
      if (team%size > 1_ip) call part_of_world(step, team%rank, team%size, world)
      call complete_wall_forces(team, world%bodies, world%contacts)
   end subroutine make_part

   subroutine write_all(team, folder, error)
      class(team_t), intent(inout) :: team
      character(len=*), intent(in) :: folder
      type(error_t), allocatable, intent(inout) :: error
      type(trajectory_t) :: trajectory
      type(provenance_t) :: provenance
      type(world_t) :: world
      type(ledger_row_t) :: row
      integer(lp) :: step

      call team%agree(error)
      call sample_provenance(provenance)
      call trajectory%open(folder, per_segment, provenance, error, team=team)
      do step = 1_lp, n_frames
         call make_part(team, step, world)
         call sample_row(step, row)
         call trajectory%write_frame(step, 0.5_wp*real(step, wp), world%bodies, error, world%contacts, row)
      end do
      call trajectory%close(error)
      if (.not. allocated(error)) call write_checkpoint(team, folder, provenance, world, error)
   end subroutine write_all

   subroutine write_checkpoint(team, folder, provenance, world, error)
      class(team_t), intent(inout) :: team
      character(len=*), intent(in) :: folder
      type(provenance_t), intent(in) :: provenance
      type(world_t), intent(inout) :: world
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(row_blocks_t) :: rows
      integer(lp) :: sums(2)

      call file%create(folder//'/checkpoint_1.h5', provenance, team)
      associate (bodies => world%bodies, pairs => world%contacts, n => world%contacts%n)
         call lay_out_bodies(team, bodies, rows)
         call file%set_rows('/bodies/', rows)
         call lay_out_parts(team, bodies, world%box_body, rows)
         call file%set_rows('/boxes/', rows)
         call lay_out_pairs(team, bodies, pairs%first(:n), pairs%second(:n), rows)
         call file%set_rows('/pairs/', rows)
         ! What belongs to the run is that of the leader.
         sums = [4_lp, 5_lp] + int(team%rank, lp)
         call file%keep('/run/sums', sums, '1', 'sums')
         call file%match('/bodies/id', int(bodies%id, lp), '1', 'identifiers')
         call file%keep('/bodies/position', bodies%position, 'm', 'positions')
         call file%keep('/bodies/angle', bodies%angle, 'rad', 'angles')
         call file%keep('/bodies/force', bodies%force, 'N/m', 'forces')
         call file%keep('/boxes/bounds', world%box_value, 'm', 'bounds')
         call file%match('/pairs/first', int(bodies%id(pairs%first(:n)), lp), '1', 'lower identifier')
         call file%match('/pairs/second', int(bodies%id(pairs%second(:n)), lp), '1', 'higher identifier')
         call file%keep('/pairs/tangential', world%pair_value, 'N/m', 'memory')
      end associate
      call file%complete(error)
   end subroutine write_checkpoint

   !> What was written together is given back to a process on its own.
   subroutine read_checkpoint(error)
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(world_t) :: world
      real(wp), allocatable :: position(:, :)

      call whole_world(n_frames, world)
      allocate (position(2, world%bodies%n))
      position = 0.0_wp
      call file%open(folder//'/checkpoint_1.h5', error)
      if (allocated(error)) return
      call file%match('/bodies/id', int(world%bodies%id, lp), '1', 'identifiers')
      call file%keep('/bodies/position', position, 'm', 'positions')
      call file%close(error)
      if (any(abs(position - world%bodies%position) > 0.0_wp)) &
         call raise(error, run_error, 'positions that were given back are not those that were kept')
   end subroutine read_checkpoint

   subroutine compare_hashes(error)
      type(error_t), allocatable, intent(inout) :: error
      type(world_t) :: whole, world
      integer(lp) :: hash

      call whole_world(2_lp, whole)
      call make_part(team, 2_lp, world)
      call hash_all_bodies(team, world%bodies, hash)
      if (hash /= state_hash(whole%bodies)) call raise(error, run_error, 'hash of all bodies on process '// &
         to_text(team%rank)//' of '//to_text(team%size))
      call team%agree(error)
   end subroutine compare_hashes

   !> A failure of one process must be known to all.
   subroutine refuse_a_bad_folder(error)
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: expected
      type(provenance_t) :: provenance
      type(trajectory_t) :: trajectory
      type(checkpoint_file_t) :: file
      type(world_t) :: world

      call sample_provenance(provenance)
      call make_part(team, 1_lp, world)
      call trajectory%open('/proc/result', 1_ip, provenance, expected, team=team)
      if (.not. allocated(expected)) call raise(error, run_error, 'no failure to make a folder in /proc')
      if (allocated(expected)) deallocate (expected)
      call trajectory%write_frame(1_lp, 0.0_wp, world%bodies, expected)
      if (.not. allocated(expected)) call raise(error, run_error, 'no failure to write a segment in /proc')
      if (allocated(expected)) deallocate (expected)
      call file%create('/proc/checkpoint_1.h5', provenance, team)
      call file%complete(expected)
      if (.not. allocated(expected)) then
         call raise(error, run_error, 'no failure to write a checkpoint in /proc')
      else if (expected%code /= io_error) then
         call raise(error, run_error, 'another failure: '//expected%message)
      end if
      call team%agree(error)
   end subroutine refuse_a_bad_folder

end program write_together
