!> Writes a trajectory and a checkpoint twice, by one rank with all bodies and by all ranks collectively. Compares the
!> numbers, their order, the total forces on fixed bodies and the hashes of state and scene. All ranks read the
!> checkpoint.
!>
!>     mpirun -n 4 write_together
!>
!> No output on success; otherwise a message and exit code 1.
program write_together
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: error_unit
   use compare_files, only: expect_equal_files
   use polydem_bodies, only: state_hash
   use polydem_checkpoint_file, only: checkpoint_file_t
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t, io_error, raise, run_error
   use polydem_global_hash, only: hash_all_bodies, hash_scene
   use polydem_row_distribution, only: row_distribution_t
   use polydem_hdf5_file, only: start_library
   use polydem_kinds, only: ip, lp, wp
   use polydem_named_values, only: named_values_t
   use polydem_ownership, only: order_bodies, order_pairs, order_vertices
   use polydem_posix_processes, only: c_exit
   use polydem_provenance, only: provenance_t
   use polydem_strings, only: to_text
   use polydem_trajectory_writer, only: trajectory_writer_t
   use polydem_wall_forces, only: complete_wall_forces
   use polydem_wall_terms, only: select_walls, wall_terms_t
   use polydem_world_communicator, only: create_world
   use sample, only: sample_provenance, sample_row
   use spread_world, only: part_of_world, whole_world, world_t
   implicit none

   !> Number of frames, and frames per segment
   integer(lp), parameter :: n_frames = 3_lp
   integer(ip), parameter :: per_segment = 2_ip
   !> Data sets that are compared
   character(len=*), parameter :: in_segments(26) = [character(len=24) :: '/bodies/id', '/bodies/fixed', &
      '/bodies/mass', '/bodies/inertia', '/bodies/vertex_start', '/bodies/vertex', '/walls/id', '/walls/force', &
      '/walls/torque', '/frames/start', '/frames/step', '/frames/time', '/frames/position', '/frames/angle', &
      '/frames/velocity', '/frames/angular_velocity', '/contacts/start', '/contacts/first', '/contacts/second', &
      '/contacts/area', '/contacts/point', '/contacts/normal', '/contacts/length', '/contacts/force', &
      '/contacts/couple', '/energy_balance/kinetic']
   character(len=*), parameter :: in_checkpoint(9) = [character(len=24) :: '/run/sums', '/bodies/id', &
      '/bodies/position', '/bodies/angle', '/bodies/force', '/vertices/position', '/pairs/first', '/pairs/second', &
      '/pairs/tangential']

   class(communicator_t), allocatable :: comm
   type(error_t), allocatable :: error
   character(len=:), allocatable :: folder

   call start_library(error)
   call create_world(comm, error)
   folder = 'together_'//to_text(comm%size)
   call write_both(error)
   if (.not. allocated(error)) call read_checkpoint_together(error)
   if (.not. allocated(error)) call compare_hashes(error)
   if (.not. allocated(error)) call refuse_a_bad_folder(error)
   if (allocated(error) .and. comm%is_root()) then
      write (error_unit, '(a)') error%message
      flush (error_unit)
   end if
   call comm%finalize()
   if (allocated(error)) call c_exit(1_c_int)

contains

   subroutine write_both(error)
      type(error_t), allocatable, intent(inout) :: error
      type(communicator_t) :: alone
      integer(ip) :: k

      if (comm%is_root()) call write_all(alone, folder//'_alone', error)
      call comm%all_reduce_error(error)
      if (allocated(error)) return
      call write_all(comm, folder, error)
      if (comm%is_root() .and. .not. allocated(error)) then
         do k = 1_ip, 2_ip
            call expect_equal_files(folder//'_alone/trajectory_000'//to_text(k)//'.h5', &
                                    folder//'/trajectory_000'//to_text(k)//'.h5', in_segments, error)
         end do
         call expect_equal_files(folder//'_alone/checkpoint_1.h5', folder//'/checkpoint_1.h5', in_checkpoint, error)
         if (.not. allocated(error)) call read_checkpoint(error)
      end if
      call comm%all_reduce_error(error)
   end subroutine write_both

   !> The part of the state of one rank, with total wall forces
   subroutine make_part(comm, step, world)
      class(communicator_t), intent(inout) :: comm
      integer(lp), intent(in) :: step
      type(world_t), intent(out) :: world
      type(wall_terms_t) :: walls

      if (comm%size == 1_ip) call whole_world(step, world)
      if (comm%size > 1_ip) call part_of_world(step, comm%rank, comm%size, world)
      call select_walls(world%bodies, world%contacts, walls)
      call complete_wall_forces(comm, world%contacts%row%first, walls, world%bodies)
   end subroutine make_part

   subroutine write_all(comm, folder, error)
      class(communicator_t), intent(inout) :: comm
      character(len=*), intent(in) :: folder
      type(error_t), allocatable, intent(inout) :: error
      type(trajectory_writer_t) :: trajectory
      type(provenance_t) :: provenance
      type(world_t) :: world
      type(named_values_t) :: row
      integer(lp) :: step

      call comm%all_reduce_error(error)
      call sample_provenance(provenance)
      call trajectory%open(folder, per_segment, provenance, error, comm=comm)
      do step = 1_lp, n_frames
         call make_part(comm, step, world)
         call sample_row(step, row)
         call trajectory%write_frame(step, 0.5_wp*real(step, wp), world%bodies, error, world%contacts, row)
      end do
      call trajectory%close(error)
      if (.not. allocated(error)) call write_checkpoint(comm, folder, provenance, world, error)
   end subroutine write_all

   subroutine write_checkpoint(comm, folder, provenance, world, error)
      class(communicator_t), intent(inout) :: comm
      character(len=*), intent(in) :: folder
      type(provenance_t), intent(in) :: provenance
      type(world_t), intent(inout) :: world
      type(error_t), allocatable, intent(inout) :: error
      type(checkpoint_file_t) :: file
      type(row_distribution_t) :: rows
      integer(lp) :: sums(2)

      call file%create(folder//'/checkpoint_1.h5', provenance, comm)
      associate (bodies => world%bodies, pairs => world%contacts, n => world%contacts%n)
         call order_bodies(comm, bodies, rows)
         call file%set_rows('/bodies/', rows)
         call order_vertices(comm, bodies, rows)
         call file%set_rows('/vertices/', rows)
         call order_pairs(comm, bodies, pairs%row(:n)%first, pairs%row(:n)%second, rows)
         call file%set_rows('/pairs/', rows)
         ! The group /run has the values of the root rank.
         sums = [4_lp, 5_lp] + int(comm%rank, lp)
         call file%field('/run/sums', sums, '1', 'sums')
         call file%match('/bodies/id', int(bodies%id, lp), '1', 'identifiers')
         call file%field('/bodies/position', bodies%position, 'm', 'positions')
         call file%field('/bodies/angle', bodies%angle, 'rad', 'angles')
         call file%field('/bodies/force', bodies%force, 'N/m', 'forces')
         call file%field('/vertices/position', bodies%pieces%vertex, 'm', 'vertices')
         call file%match('/pairs/first', int(bodies%id(pairs%row(:n)%first), lp), '1', 'lower identifier')
         call file%match('/pairs/second', int(bodies%id(pairs%row(:n)%second), lp), '1', 'higher identifier')
         call file%field('/pairs/tangential', world%pair_value, 'N/m', 'memory')
      end associate
      call file%complete(error)
   end subroutine write_checkpoint

   !> Read on one rank a checkpoint that all ranks have written.
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
      call file%field('/bodies/position', position, 'm', 'positions')
      call file%close(error)
      if (any(abs(position - world%bodies%position) > 0.0_wp)) &
         call raise(error, run_error, 'positions read from the checkpoint differ from those written')
   end subroutine read_checkpoint

   !> Read the checkpoint on all ranks: each rank gets the rows of the bodies and pairs that it chooses. An error of one
   !> rank reaches all ranks.
   subroutine read_checkpoint_together(error)
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: expected
      type(checkpoint_file_t) :: file
      type(world_t) :: world, whole
      real(wp), allocatable :: position(:, :), angle(:), force(:, :)
      integer(lp) :: n, second(1)
      integer(ip) :: s

      call make_part(comm, n_frames, world)
      call whole_world(n_frames, whole)
      associate (bodies => world%bodies, contacts => whole%contacts)
         allocate (position(2, bodies%n), force(2, bodies%n), angle(bodies%n), source=-7.0_wp)
         call file%open(folder//'/checkpoint_1.h5', error, comm)
         if (allocated(error)) return
         call file%choose_rows('/bodies/', int(bodies%global_index, lp))
         call file%match('/bodies/id', int(bodies%id, lp), '1', 'identifiers')
         call file%field('/bodies/position', position, 'm', 'positions')
         call file%field('/bodies/angle', angle, 'rad', 'angles')
         call file%count_rows('/pairs/second', n)
         call file%choose_rows('/pairs/', [n - int(comm%rank, lp)])
         call file%field('/pairs/second', second, '1', 'higher identifier')
         ! A rank that expects other bodies fails, and all ranks get its error.
         call file%match('/bodies/id', int(bodies%id, lp) + merge(1_lp, 0_lp, comm%rank == 0_ip), '1', 'identifiers')
         call file%field('/bodies/force', force, 'N/m', 'forces')
         call file%close(expected)
         if (.not. allocated(expected)) call raise(error, run_error, 'a wrong identifier was not reported')
         do s = 1_ip, bodies%n
            if (all(abs(position(:, s) - bodies%position(:, s)) <= 0.0_wp) .and. &
                abs(angle(s) - bodies%angle(s)) <= 0.0_wp) cycle
            call raise(error, run_error, 'rank '//to_text(comm%rank)//' read a wrong pose of body '// &
                       to_text(bodies%id(s)))
         end do
         if (second(1) /= int(whole%bodies%id(contacts%row(contacts%n - comm%rank)%second), lp)) &
            call raise(error, run_error, 'rank '//to_text(comm%rank)//' read a wrong pair')
      end associate
      call comm%all_reduce_error(error)
   end subroutine read_checkpoint_together

   subroutine compare_hashes(error)
      type(error_t), allocatable, intent(inout) :: error
      type(communicator_t) :: alone
      type(world_t) :: whole, world
      integer(lp) :: hash, expected

      call whole_world(2_lp, whole)
      call make_part(comm, 2_lp, world)
      call hash_all_bodies(comm, world%bodies, hash)
      if (hash /= state_hash(whole%bodies)) call raise(error, run_error, 'wrong hash of all bodies on rank '// &
         to_text(comm%rank)//' of '//to_text(comm%size))
      call hash_scene(alone, whole%bodies, expected)
      call hash_scene(comm, world%bodies, hash)
      if (hash /= expected) call raise(error, run_error, 'wrong hash of the scene on rank '//to_text(comm%rank)// &
         ' of '//to_text(comm%size))
      call comm%all_reduce_error(error)
   end subroutine compare_hashes

   !> A failure on one rank must raise an error on all ranks.
   subroutine refuse_a_bad_folder(error)
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: expected
      type(provenance_t) :: provenance
      type(trajectory_writer_t) :: trajectory
      type(checkpoint_file_t) :: file
      type(world_t) :: world

      call sample_provenance(provenance)
      call make_part(comm, 1_lp, world)
      call trajectory%open('/proc/result', 1_ip, provenance, expected, comm=comm)
      if (.not. allocated(expected)) call raise(error, run_error, 'no failure to make a folder in /proc')
      if (allocated(expected)) deallocate (expected)
      call trajectory%write_frame(1_lp, 0.0_wp, world%bodies, expected)
      if (.not. allocated(expected)) call raise(error, run_error, 'no failure to write a segment in /proc')
      if (allocated(expected)) deallocate (expected)
      call file%create('/proc/checkpoint_1.h5', provenance, comm)
      call file%complete(expected)
      if (.not. allocated(expected)) then
         call raise(error, run_error, 'no failure to write a checkpoint in /proc')
      else if (expected%code /= io_error) then
         call raise(error, run_error, 'another failure: '//expected%message)
      end if
      call comm%all_reduce_error(error)
   end subroutine refuse_a_bad_folder

end program write_together
