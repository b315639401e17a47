!> Walls of a run: which bodies move as one, what moves them, and the record of the forces on them.
module polydem_walls
   use polydem_bodies, only: bodies_t
   use polydem_bodies_in_cell, only: put_into_cell
   use polydem_communicator, only: communicator_t
   use polydem_kinds, only: ip, wp
   use polydem_named_values, only: named_values_t
   use polydem_named_walls, only: named_walls_t
   use polydem_wall, only: move_wall, wall_t
   use polydem_wall_load, only: carry_walls, correct_loads, energies_of_loads, n_energies, predict_loads, &
      set_load_columns, wall_load_t
   use polydem_wall_record, only: wall_record_t
   use polydem_wall_terms, only: wall_terms_t
   implicit none
   private
   public :: walls_t

   !> Walls of a run
   type :: walls_t
      !> Fixed bodies that motions or loads drive; other fixed bodies are at rest
      type(wall_t), allocatable :: driven(:)
      !> Walls by name
      type(named_walls_t) :: named
      !> Loads on named walls; not allocated if there are none
      type(wall_load_t), allocatable :: loads(:)
      !> Record of the named walls, if there is a series
      type(wall_record_t) :: record
   contains
      procedure :: predict
      procedure :: accelerate
      procedure :: move
      procedure :: energies
      procedure :: accumulate
      procedure :: set_columns
   end type walls_t

contains

   !> Move the walls to the end of a step. The velocities of load-controlled ones are predicted.
   subroutine predict(self, dt, time, bodies)
      class(walls_t), intent(inout) :: self
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Simulated time at the end of the step [s]
      real(wp), intent(in) :: time
      !> Bodies; poses, velocities and accelerations of those of the walls change
      type(bodies_t), intent(inout) :: bodies

      if (allocated(self%loads)) call predict_loads(dt, self%loads)
      call self%move(time, bodies)
   end subroutine predict

   !> Find the velocities of the load-controlled walls from the contacts. Their places do not change. Collective.
   subroutine accelerate(self, comm, dt, time, gravity, bodies, terms)
      !> Walls with loads
      class(walls_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      !> Time step; 0 at the start [s]
      real(wp), intent(in) :: dt
      !> Simulated time at the end of the step [s]
      real(wp), intent(in) :: time
      !> Acceleration of gravity at this time, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Bodies; velocities and accelerations of those of the walls change
      type(bodies_t), intent(inout) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms

      call correct_loads(self%loads, comm, dt, time, gravity, self%named, bodies, terms)
      call self%move(time, bodies)
   end subroutine accelerate

   !> Move the bodies of the walls to their poses at a given time, and displace them by loads. Those that have left a
   !> periodic cell return to it.
   subroutine move(self, time, bodies)
      class(walls_t), intent(in) :: self
      !> Simulated time [s]
      real(wp), intent(in) :: time
      !> Bodies; poses, velocities and accelerations of those of the walls change
      type(bodies_t), intent(inout) :: bodies
      integer :: k

      do k = 1, size(self%driven)
         call move_wall(self%driven(k), time, bodies)
      end do
      if (allocated(self%loads)) call carry_walls(self%loads, self%named, bodies)
      if (.not. bodies%cell%is_periodic) return
      do k = 1, size(self%driven)
         bodies%image(self%driven(k)%slots, :) = 0_ip
         call put_into_cell(bodies, self%driven(k)%slots)
      end do
   end subroutine move

   !> Energies of all loads together at the end of a step, (`n_energies`) [J/m]
   pure function energies(self, dt)
      !> Walls with loads
      class(walls_t), intent(in) :: self
      !> Time step [s]
      real(wp), intent(in) :: dt
      real(wp) :: energies(n_energies)

      energies = energies_of_loads(self%loads, dt)
   end function energies

   !> Add a step to the record, if there is one.
   subroutine accumulate(self, bodies, terms)
      class(walls_t), intent(inout) :: self
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms

      if (allocated(self%record%sums)) call self%record%accumulate(self%named, bodies, terms, 1.0_wp)
   end subroutine accumulate

   !> Set the columns of all walls and loads in a row of the series at the end of a step. Collective.
   subroutine set_columns(self, comm, dt, bodies, terms, row)
      !> Walls with a record
      class(walls_t), intent(in) :: self
      class(communicator_t), intent(inout) :: comm
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms
      !> Row of the series
      type(named_values_t), intent(inout) :: row

      call self%record%set_columns(comm, dt, self%named, bodies, terms, row)
      if (allocated(self%loads)) call set_load_columns(self%loads, dt, row)
   end subroutine set_columns

end module polydem_walls
