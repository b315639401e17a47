!> Loads: a force, a stress or a torque on a named wall, which moves along one direction by Newton's law.
!>
!> A load has one degree of freedom (`polydem_driven`), the displacement of the wall along x or y, or its angle about a
!> pivot. The displacement comes on top of the motions of the wall.
!>
!> The mass of a wall is spread evenly over the area of its bodies, as they are at the start. If the wall has a weight,
!> the gravity that acts on the bodies acts on this mass, too.
!>
!> The force of the contacts is an exact sum over all ranks. So all ranks compute the same bits.
module polydem_wall_load
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_driven, only: along_angle, driven_t
   use polydem_exact_all_reduce, only: all_reduce_exact_sums
   use polydem_exact_sum, only: exact_sum_t
   use polydem_kinds, only: ip, wp
   use polydem_motion, only: turn_about
   use polydem_named_values, only: named_values_t
   use polydem_ramp, only: ramp_t
   use polydem_serializer, only: serializer_t
   use polydem_wall, only: gap, wall_t
   use polydem_wall_terms, only: force_about, wall_terms_t
   implicit none
   private
   public :: wall_load_t, of_load, of_damping, of_contacts, of_kinetic, n_energies
   public :: set_masses, predict_loads, carry_walls, correct_loads, energies_of_loads, serialize_loads, set_load_columns
   public :: wall_mobilities

   !> Energies of a load: its work, that of the damping of its wall and that of the contacts on it, then the kinetic
   !> energy of the wall
   integer, parameter :: of_load = 1, of_damping = 2, of_contacts = 3, of_kinetic = 4, n_energies = 4
   !> Number of saved values of a load
   integer, parameter :: n_saved = 6

   !> A load with its degree of freedom
   type, extends(driven_t) :: wall_load_t
      !> Name of the group &load
      character(len=:), allocatable :: name
      !> Number of its named wall
      integer(ip) :: wall = 0_ip
      !> 1: along x, 2: along y, `along_angle`
      integer :: direction = 1
      !> Force [N/m] or torque [N] besides that of the stress
      real(wp) :: force = 0.0_wp
      !> Stress [N/m2], and the width on which it acts [m]
      real(wp) :: stress = 0.0_wp, width = 0.0_wp
      !> Numbers of two walls whose distance is the width; 0: the width is constant
      integer(ip) :: between(2) = 0_ip
      !> Centre of a turn, (2) [m]
      real(wp) :: pivot(2) = 0.0_wp
      !> Whether gravity acts on the wall
      logical :: has_weight = .false.
      !> The mass on which it acts; 0 without weight [kg/m]
      real(wp) :: heavy = 0.0_wp
      !> Present force of the load, with that of gravity, and of the contacts along the direction; torques of a turn
      real(wp) :: applied = 0.0_wp, contact = 0.0_wp
      !> Number of contacts of the wall in the run
      integer(ip) :: n_contacts = 0_ip
      !> Sums over steps of the powers of load, damping and contacts, and the last ones [W/m]
      real(wp) :: sums(3) = 0.0_wp, last(3) = 0.0_wp
   end type wall_load_t

contains

   !> Set masses and dampings that follow from the free bodies and the stiffness.
   pure subroutine set_masses(loads, walls, bodies, usual, stiffness)
      !> All loads
      type(wall_load_t), intent(inout) :: loads(:)
      !> All walls
      type(wall_t), intent(in) :: walls(:)
      !> Bodies at the start
      type(bodies_t), intent(in) :: bodies
      !> Mass of a wall without a mass of its own [kg/m]
      real(wp), intent(in) :: usual
      !> Stiffness E of the contacts [N/m2]
      real(wp), intent(in) :: stiffness
      real(wp) :: square
      integer :: k

      do k = 1, size(loads)
         associate (load => loads(k))
            square = 1.0_wp
            if (load%direction == along_angle) square = walls(load%wall)%gyration_square(load%pivot, bodies)
            if (load%has_weight) load%heavy = merge(load%mass, usual, load%mass > 0.0_wp)
            call load%set_mass(usual, stiffness, square)
         end associate
      end do
   end subroutine set_masses

   !> Move the degrees of freedom to the end of the step, and predict their velocities there.
   pure subroutine predict_loads(dt, loads)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> All loads
      type(wall_load_t), intent(inout) :: loads(:)
      integer :: k

      do k = 1, size(loads)
         call loads(k)%predict(dt)
      end do
   end subroutine predict_loads

   !> Displace the bodies of the walls, which motions have placed, by the degrees of freedom.
   pure subroutine carry_walls(loads, walls, bodies)
      !> All loads
      type(wall_load_t), intent(in) :: loads(:)
      !> All walls
      type(wall_t), intent(in) :: walls(:)
      !> Bodies; poses, velocities and accelerations of those of the walls change
      type(bodies_t), intent(inout) :: bodies
      integer :: j, k

      do k = 1, size(loads)
         associate (load => loads(k), slots => walls(loads(k)%wall)%slots)
            if (load%direction == along_angle) then
               call turn_about(load%pivot, [load%place, load%speed, load%change], slots, bodies)
               cycle
            end if
            do j = 1, size(slots)
               associate (axis => load%direction, s => slots(j))
                  bodies%position(axis, s) = bodies%position(axis, s) + load%place
                  bodies%velocity(axis, s) = bodies%velocity(axis, s) + load%speed
                  bodies%acceleration(axis, s) = bodies%acceleration(axis, s) + load%change
               end associate
            end do
         end associate
      end do
   end subroutine carry_walls

   !> Find the forces at the end of the step, and the velocities there. Collective: no rank may be absent.
   subroutine correct_loads(loads, comm, dt, time, gravity, walls, wall_of, bodies, terms)
      !> All loads
      type(wall_load_t), intent(inout) :: loads(:)
      class(communicator_t), intent(inout) :: comm
      !> Time step; 0 at the start of the run [s]
      real(wp), intent(in) :: dt
      !> Time at the end of the step [s]
      real(wp), intent(in) :: time
      !> Acceleration of gravity at this time, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> All walls
      type(wall_t), intent(in) :: walls(:)
      !> Wall of each body, (slot)
      integer(ip), intent(in) :: wall_of(:)
      type(bodies_t), intent(in) :: bodies
      !> Contacts of this rank with fixed bodies
      type(wall_terms_t), intent(in) :: terms
      integer :: k

      call find_contact_forces(loads, comm, wall_of, bodies, terms)
      do k = 1, size(loads)
         associate (load => loads(k))
            load%applied = applied_force(load, walls, bodies, time, gravity)
            ! What stops a moving wall takes its kinetic energy, as a damping does, and the work of half a step that the
            ! sums have since then.
            if (dt > 0.0_wp .and. .not. load%is_open(time)) load%sums(of_damping) = load%sums(of_damping) &
               - 0.5_wp*load%mass*(load%half**2 - (0.5_wp*dt*load%change)**2)/dt
            call load%correct(dt, time, load%applied + load%contact)
            load%last = [load%applied*load%speed, -load%damping*load%speed**2, load%contact*load%speed]
            if (dt > 0.0_wp) load%sums = load%sums + load%last
            if (.not. dt > 0.0_wp) load%sums = 0.5_wp*load%last
         end associate
      end do
   end subroutine correct_loads

   !> Find the force of the contacts along the direction of each load, and their number.
   subroutine find_contact_forces(loads, comm, wall_of, bodies, terms)
      !> All loads
      type(wall_load_t), intent(inout) :: loads(:)
      class(communicator_t), intent(inout) :: comm
      !> Wall of each body, (slot)
      integer(ip), intent(in) :: wall_of(:)
      type(bodies_t), intent(in) :: bodies
      type(wall_terms_t), intent(in) :: terms
      type(exact_sum_t) :: sums(2*size(loads))
      real(wp) :: force(3)
      integer(ip) :: c
      integer :: k

      do c = 1_ip, terms%n
         do k = 1, size(loads)
            associate (s => terms%slots(1, c))
               if (wall_of(s) /= loads(k)%wall) cycle
               force = force_about(loads(k)%pivot, bodies, s, terms%term(:, c))
               call sums(2*k - 1)%add(force(loads(k)%direction))
               call sums(2*k)%add(1.0_wp)
            end associate
         end do
      end do
      call all_reduce_exact_sums(comm, sums)
      do k = 1, size(loads)
         loads(k)%contact = sums(2*k - 1)%value()
         loads(k)%n_contacts = nint(sums(2*k)%value(), ip)
      end do
   end subroutine find_contact_forces

   !> Force [N/m] or torque [N] of a load and of gravity at a time; 0 while the wall is not controlled
   pure real(wp) function applied_force(load, walls, bodies, time, gravity) result(force)
      type(wall_load_t), intent(in) :: load
      type(wall_t), intent(in) :: walls(:)
      !> Bodies with turned vertices
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: time
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      type(ramp_t) :: ramp
      real(wp) :: width

      force = 0.0_wp
      if (.not. load%is_open(time)) return
      width = load%width
      if (all(load%between > 0_ip)) width = max(0.0_wp, gap(walls(load%between(1)), walls(load%between(2)), &
                                                               3 - load%direction, bodies))
      ramp = load%ramp_at(time)
      force = (load%force + load%stress*width)*ramp%factor
      if (load%has_weight) force = force + weight_of(load, walls, bodies, gravity)
   end function applied_force

   !> Force of gravity on a wall along the direction of a load [N/m], or its torque about the pivot [N]
   pure real(wp) function weight_of(load, walls, bodies, gravity) result(weight)
      type(wall_load_t), intent(in) :: load
      type(wall_t), intent(in) :: walls(:)
      type(bodies_t), intent(in) :: bodies
      real(wp), intent(in) :: gravity(2)
      real(wp) :: arm(2)

      if (load%direction == along_angle) then
         arm = walls(load%wall)%centre_of_area(bodies) - load%pivot
         weight = load%heavy*(arm(1)*gravity(2) - arm(2)*gravity(1))
      else
         weight = load%heavy*gravity(load%direction)
      end if
   end function weight_of

   !> Energies of all loads together at the end of a step, (n_energies) [J/m]
   pure function energies_of_loads(loads, dt) result(energies)
      !> All loads
      type(wall_load_t), intent(in) :: loads(:)
      !> Time step [s]
      real(wp), intent(in) :: dt
      real(wp) :: energies(n_energies)
      integer :: k

      energies = 0.0_wp
      do k = 1, size(loads)
         energies = energies + energies_of(loads(k), dt)
      end do
   end function energies_of_loads

   !> Energies of a load at the end of a step, (n_energies) [J/m]
   pure function energies_of(load, dt) result(energies)
      type(wall_load_t), intent(in) :: load
      real(wp), intent(in) :: dt
      real(wp) :: energies(n_energies)

      energies(:3) = dt*(load%sums - 0.5_wp*load%last)
      energies(of_kinetic) = 0.5_wp*load%mass*load%speed**2
   end function energies_of

   !> Set the columns of all loads at the end of a step.
   subroutine set_load_columns(loads, dt, row)
      !> All loads
      type(wall_load_t), intent(in) :: loads(:)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Row of the series
      type(named_values_t), intent(inout) :: row
      real(wp) :: energies(n_energies)
      character(len=:), allocatable :: name, per, length
      integer :: k

      do k = 1, size(loads)
         name = loads(k)%name
         length = 'm'
         per = 'N/m'
         if (loads(k)%direction == along_angle) then
            length = 'rad'
            per = 'N'
         end if
         energies = energies_of(loads(k), dt)
         call row%set(name//'.displacement', loads(k)%place, length, 'displacement of the wall by the load')
         call row%set(name//'.velocity', loads(k)%speed, length//'/s', 'its rate')
         call row%set(name//'.load', loads(k)%applied, per, 'force or torque of the load along its direction, with '// &
                      'the weight')
         call row%set(name//'.contacts', loads(k)%contact, per, 'force or torque of the contacts on the wall')
         call row%set(name//'.work', energies(of_load), 'J/m', 'work of the load so far')
         call row%set(name//'.damping_work', energies(of_damping), 'J/m', 'work of the damping of the wall so far')
         call row%set(name//'.kinetic', energies(of_kinetic), 'J/m', 'kinetic energy of the wall')
      end do
   end subroutine set_load_columns

   !> Serialize the degrees of freedom, which are the same on all ranks.
   subroutine serialize_loads(loads, serializer)
      !> All loads
      type(wall_load_t), intent(inout) :: loads(:)
      class(serializer_t), intent(inout) :: serializer
      real(wp) :: values(n_saved*size(loads))
      integer :: k

      do k = 1, size(loads)
         values(n_saved*(k - 1) + 1:n_saved*k) = [loads(k)%place, loads(k)%speed, loads(k)%change, loads(k)%sums]
      end do
      call serializer%field('/run/loads', values, '1', 'displacement, velocity, acceleration and sums of powers of '// &
                            'each load, in SI units')
      if (.not. serializer%is_reading .or. allocated(serializer%error)) return
      do k = 1, size(loads)
         associate (load => loads(k), saved => values(n_saved*(k - 1) + 1:n_saved*k))
            load%place = saved(1)
            load%speed = saved(2)
            load%change = saved(3)
            load%sums = saved(4:)
            load%last = 0.0_wp
         end associate
      end do
   end subroutine serialize_loads

   !> Mobility of the bodies of load-controlled walls, for the stable step: each contact of a wall has its share of the
   !> mass, (slot) [m/kg]
   pure function wall_mobilities(loads, walls, bodies) result(mobility)
      !> All loads
      type(wall_load_t), intent(in) :: loads(:)
      !> All walls
      type(wall_t), intent(in) :: walls(:)
      type(bodies_t), intent(in) :: bodies
      real(wp) :: mobility(bodies%n)
      real(wp) :: arm
      integer :: k

      mobility = 0.0_wp
      do k = 1, size(loads)
         associate (slots => walls(loads(k)%wall)%slots)
            arm = 1.0_wp
            if (loads(k)%direction == along_angle) arm = walls(loads(k)%wall)%greatest_arm(loads(k)%pivot, bodies)
            mobility(slots) = mobility(slots) + real(max(1_ip, loads(k)%n_contacts), wp)*arm**2/loads(k)%mass
         end associate
      end do
   end function wall_mobilities

end module polydem_wall_load
