!> Bodies leave and enter a simulation between two steps, on all ranks.
!>
!>     mpirun -n 3 replaced_bodies
!>
!> The pile is a heap of polygons with friction between shaken walls, with contacts that open and close. A far body
!> flies alone. The output is one line, a hash that depends neither on ranks nor threads; a failure is a message and
!> exit code 1.
program replaced_bodies
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: error_unit
   use omp_lib, only: omp_set_num_threads
   use polydem_bodies, only: bodies_t, state_words
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_communicator, only: communicator_t
   use polydem_elementary, only: cosine, sine
   use polydem_errors, only: error_t
   use polydem_global_hash, only: hash_all_bodies
   use polydem_hash, only: hexadecimal, mix_word
   use polydem_hdf5_file, only: start_library
   use polydem_kinds, only: ip, lp, wp
   use polydem_posix_processes, only: c_exit
   use polydem_oscillation, only: oscillation_t
   use polydem_read_settings, only: read_settings_text
   use polydem_replace_bodies, only: replace_bodies
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t, sum_began, sum_ended
   use polydem_simulation_counters, only: collect_counts, count_contacts
   use polydem_start_simulation, only: start_with_bodies
   use polydem_time_step, only: advance
   use polydem_world_communicator, only: create_world
   implicit none

   !> Settings; the scene is not used
   character(len=*), parameter :: text = "&scene name = 'gas' bodies = 1 speed = 1 / &forces stiffness = 1e5 "// &
      'friction_coefficient = 0.4 / &integrate dt = 2e-5 duration = 1 / &decomposition margin = 2e-3 /'
   !> Finders and schemes of integration that are tried
   character(len=*), parameter :: finders(3) = [character(len=16) :: 'two_level', 'sort_and_sweep', 'verlet']
   character(len=*), parameter :: schemes(4) = [character(len=40) :: 'integrate.scheme=velocity_verlet', &
      'integrate.scheme=gear', 'integrate.accumulation=compensated', 'forces.drag=30']
   !> Rows and columns of the heap, and number of bodies of the pile: the heap and three walls
   integer(ip), parameter :: n_rows = 6_ip, n_columns = 7_ip, n_pile = n_rows*n_columns + 3_ip
   !> Steps of a run, and the step before which bodies are replaced
   integer, parameter :: n_steps = 900, middle = 450
   class(communicator_t), allocatable :: comm
   type(error_t), allocatable :: error
   type(simulation_t) :: whole, pile
   character(len=:), allocatable :: option
   integer(lp) :: whole_hash, pile_hash, hash, last
   integer :: k

   call start_library(error)
   call create_world(comm, error)
   call omp_set_num_threads(1)
   call run('neighbours.finder=two_level', .true., 0, whole)
   call hash_all(whole, whole_hash)
   call run('neighbours.finder=two_level', .false., 0, pile)
   call hash_pile(pile, pile_hash)
   call hash_pile(whole, hash)
   call expect(hash == pile_hash, 'a far body changes the pile')
   call expect_contacts(pile)
   last = 0_lp
   do k = 1, size(finders)
      if (allocated(error)) exit
      option = 'neighbours.finder='//trim(finders(k))
      call omp_set_num_threads(k)
      call replace_nothing()
      call remove_and_add_far()
      call remove_and_add_near(hash)
      call expect((k == 1 .or. hash == last), 'another finder or number of threads gives other bits')
      last = hash
   end do
   do k = 1, size(schemes)
      if (allocated(error)) exit
      option = trim(schemes(k))
      call add_flying()
   end do
   if (.not. allocated(error) .and. comm%is_root()) print '(a)', hexadecimal(last)
   if (allocated(error) .and. comm%is_root()) write (error_unit, '(a)') error%message
   call comm%finalize()
   if (allocated(error)) call c_exit(1_c_int)

contains

   !> Nothing leaves and nothing enters, several times: the run is the same.
   subroutine replace_nothing()
      type(simulation_t) :: simulation
      type(bodies_t) :: none
      integer :: step

      call run(option, .true., -1, simulation)
      do step = 1, n_steps
         if (step == 2 .or. step == middle .or. step == middle + 1) &
            call replace(simulation, [integer(ip) ::], none)
         call go_on(simulation, step)
      end do
      call hash_all(simulation, hash)
      call expect(hash == whole_hash, option//': replacing nothing changes the bodies')
      if (allocated(error)) return
      call collect_counts(simulation)
      call collect_counts(whole)
      call expect(comm%size > 1_ip .or. all(simulation%sums == whole%sums), &
                  option//': replacing nothing changes counts')
   end subroutine replace_nothing

   !> The far body leaves while contacts last, and others come and go: the pile does not notice.
   subroutine remove_and_add_far()
      type(simulation_t) :: simulation
      type(bodies_t) :: added
      integer(lp) :: expected

      call run(option, .true., middle, simulation)
      call make(comm, .false., .true., added)
      call replace(simulation, [n_pile + 1_ip], added)
      call expect(simulation%bodies%n_all == n_pile + 1_ip .and. simulation%bodies%last_id == n_pile + 2_ip, &
                  'wrong number of bodies, or identifier')
      call go_on(simulation, middle + 100)
      call make(comm, .false., .true., added)
      call replace(simulation, [n_pile + 2_ip], added)
      call replace(simulation, [n_pile + 3_ip], bodies_t())   ! before the next step
      call expect(simulation%bodies%n_all == n_pile .and. simulation%bodies%last_id == n_pile + 3_ip, &
                  'an identifier is used twice')
      call go_on(simulation, n_steps)
      call hash_pile(simulation, hash)
      call expect(hash == pile_hash, option//': the pile notices a far body that comes or goes')
      call hash_all(simulation, hash)
      call hash_all(pile, expected)
      call expect(hash == expected, option//': a body is left over')
   end subroutine remove_and_add_far

   !> Bodies of the heap and a shaken wall leave in contact, and others enter among the heap.
   subroutine remove_and_add_near(hash)
      !> Hash of all bodies at the end
      integer(lp), intent(out) :: hash
      type(simulation_t) :: simulation
      type(bodies_t) :: added

      hash = 0_lp
      call run(option, .true., middle, simulation)
      call make(comm, .false., .true., added)
      call replace(simulation, [4_ip, 11_ip, n_pile - 1_ip], added)
      if (allocated(error)) return
      call expect(size(simulation%walls%wall(1)%slots) == 1, 'a wall keeps a body that left')
      call go_on(simulation, n_steps)
      call hash_all(simulation, hash)
      call expect_contacts(simulation)
      if (allocated(error)) return
      call collect_counts(simulation)
      call expect(comm%size > 1_ip .or. simulation%sums(sum_began) - simulation%sums(sum_ended) == &
                  int(simulation%search%neighbours%pairs%n, lp), 'pairs of bodies that leave do not end')
   end subroutine remove_and_add_near

   !> A body that enters and flies alone moves like one that starts then.
   subroutine add_flying()
      type(simulation_t) :: simulation, alone
      type(bodies_t) :: added
      integer(lp) :: flight, expected

      call run(option, .false., middle, simulation)
      call make(comm, .false., .true., added)
      call replace(simulation, [integer(ip) ::], added)
      call go_on(simulation, middle + 250)
      call start(option, .false., .true., alone)
      call go_on(alone, 250)
      call hash_of(simulation, n_pile + 1_ip, n_pile + 1_ip, n_pile, flight)
      call hash_of(alone, 1_ip, 1_ip, 0_ip, expected)
      call expect(flight == expected, option//': a body that enters flies otherwise')
   end subroutine add_flying

   !> Start a run and do some steps: 0 all, negative none.
   subroutine run(option, with_far, steps, simulation)
      character(len=*), intent(in) :: option
      logical, intent(in) :: with_far
      integer, intent(in) :: steps
      type(simulation_t), intent(out) :: simulation

      call start(option, .true., with_far, simulation)
      if (steps > 0) call go_on(simulation, steps)
      if (steps == 0) call go_on(simulation, n_steps)
   end subroutine run

   !> Start a simulation of the pile, of the far body, or of both.
   subroutine start(option, with_pile, with_far, simulation)
      character(len=*), intent(in) :: option
      logical, intent(in) :: with_pile, with_far
      type(simulation_t), intent(out) :: simulation
      type(settings_t) :: settings
      type(oscillation_t) :: motion
      integer(ip), allocatable :: slots(:)
      integer(ip) :: s

      call read_settings_text('pile.nml', text, [option], settings, error)
      if (allocated(error)) return
      call make(comm, with_pile, with_far, simulation%bodies)
      slots = pack([(s, s=1_ip, simulation%bodies%n)], simulation%bodies%fixed)
      allocate (simulation%walls%wall(0), simulation%walls%motions(1))
      motion%amplitude = [1.0e-3_wp, 5.0e-4_wp]
      motion%frequency = 400.0_wp
      allocate (simulation%walls%motions(1)%motion, source=motion)
      if (with_pile) call simulation%walls%append(simulation%bodies, &
         simulation%bodies%id(slots(2:)), [1], [integer ::])
      call start_with_bodies(settings, comm, simulation, error)
      call comm%all_reduce_error(error)
   end subroutine start

   !> Make the bodies of this rank: heap, floor and two side walls, and a far body that flies and spins.
   subroutine make(comm, with_pile, with_far, bodies)
      class(communicator_t), intent(in) :: comm
      logical, intent(in) :: with_pile, with_far
      type(bodies_t), intent(out) :: bodies
      type(body_list_t) :: list
      real(wp) :: centre(2)
      integer(ip) :: i, j

      list%rank = comm%rank
      list%n_ranks = comm%size
      if (with_pile) then
         do j = 1_ip, n_rows
            do i = 1_ip, n_columns
               centre = [0.0095_wp*real(i, wp) + 0.002_wp*real(mod(j, 2_ip), wp), 0.0093_wp*real(j, wp)]
               call list%append(shape_at(centre, 3_ip + mod(i + 2_ip*j, 5_ip)), &
                                velocity=[0.1_wp*real(mod(i, 3_ip) - 1_ip, wp), -0.2_wp], &
                                angular_velocity=real(mod(j, 4_ip), wp))
            end do
         end do
         call list%append(box(-0.02_wp, -0.02_wp, 0.1_wp, 0.004_wp), fixed=.true.)
         call list%append(box(-0.02_wp, 0.0_wp, 0.004_wp, 0.2_wp), fixed=.true.)
         call list%append(box(0.074_wp, 0.0_wp, 0.1_wp, 0.2_wp), fixed=.true.)
      end if
      if (with_far) call list%append(shape_at([5.0_wp, 3.0_wp], 5_ip), velocity=[0.3_wp, 1.0_wp], &
                                     angular_velocity=7.0_wp)
      call new_bodies(list, bodies, error)
   end subroutine make

   !> A regular polygon with a radius of 5 mm
   pure function shape_at(centre, n) result(vertices)
      real(wp), intent(in) :: centre(2)
      integer(ip), intent(in) :: n
      real(wp) :: vertices(2, n), angle
      integer(ip) :: k

      do k = 1_ip, n
         angle = 0.3_wp + 6.283185307_wp*real(k, wp)/real(n, wp)
         vertices(:, k) = centre + 0.0052_wp*[cosine(angle), sine(angle)]
      end do
   end function shape_at

   !> A rectangle
   pure function box(left, bottom, right, top) result(vertices)
      real(wp), intent(in) :: left, bottom, right, top
      real(wp) :: vertices(2, 4)

      vertices = reshape([left, bottom, right, bottom, right, top, left, top], [2, 4])
   end function box

   !> Replace bodies: those with some identifiers leave.
   subroutine replace(simulation, ids, added)
      type(simulation_t), intent(inout) :: simulation
      integer(ip), intent(in) :: ids(:)
      type(bodies_t), intent(in) :: added
      type(bodies_t) :: entering
      logical, allocatable :: kept(:)
      integer(ip) :: s

      entering = added
      if (allocated(error)) return
      kept = [(all(ids /= simulation%bodies%id(s)), s=1_ip, simulation%bodies%n)]
      call replace_bodies(simulation, kept, entering, error)
   end subroutine replace

   !> Do steps up to the given one.
   subroutine go_on(simulation, last)
      type(simulation_t), intent(inout) :: simulation
      integer, intent(in) :: last

      do while (simulation%step < int(last, lp) .and. .not. allocated(error))
         call advance(simulation, error)
         call comm%all_reduce_error(error)
      end do
   end subroutine go_on

   !> Hash of all bodies
   subroutine hash_all(simulation, hash)
      type(simulation_t), intent(in) :: simulation
      integer(lp), intent(out) :: hash

      hash = 0_lp
      if (.not. allocated(error)) call hash_all_bodies(comm, simulation%bodies, hash)
   end subroutine hash_all

   !> Hash of the pile
   subroutine hash_pile(simulation, hash)
      type(simulation_t), intent(in) :: simulation
      integer(lp), intent(out) :: hash

      call hash_of(simulation, 1_ip, n_pile, 0_ip, hash)
   end subroutine hash_pile

   !> Hash of the free bodies with some identifiers, in any order
   subroutine hash_of(simulation, low, high, shift, hash)
      type(simulation_t), intent(in) :: simulation
      !> Least and greatest identifier, and what is subtracted from an identifier before it is hashed
      integer(ip), intent(in) :: low, high, shift
      integer(lp), intent(out) :: hash
      integer(lp) :: words(7), one, total(1)
      integer(ip) :: k, s
      integer :: j

      total = 0_lp
      hash = 0_lp
      if (allocated(error)) return
      do k = 1_ip, size(simulation%bodies%free, kind=ip)
         s = simulation%bodies%free(k)
         if (simulation%bodies%id(s) < low .or. simulation%bodies%id(s) > high) cycle
         words = state_words(simulation%bodies, s)
         one = words(1) - int(shift, lp)
         do j = 2, size(words)
            one = mix_word(one, words(j))
         end do
         total = total + shiftr(one, 16)
      end do
      call comm%all_reduce_sum(total)
      hash = total(1)
   end subroutine hash_of

   !> A heap without contacts or friction would show nothing.
   subroutine expect_contacts(simulation)
      type(simulation_t), intent(inout) :: simulation
      integer(ip) :: n

      if (allocated(error)) return
      call count_contacts(simulation%comm, simulation%loop%n_contacts, n)
      call expect(n > 30_ip, 'the heap has too few contacts')
   end subroutine expect_contacts

   !> Raise an error unless a condition holds on all ranks.
   subroutine expect(condition, message)
      logical, intent(in) :: condition
      !> What is wrong
      character(len=*), intent(in) :: message

      if (.not. condition .and. .not. allocated(error)) then
         allocate (error)
         error%message = message
      end if
      call comm%all_reduce_error(error)
   end subroutine expect

end program replaced_bodies
