!> Arrays of a simulation by name, copied row after row: bodies, their vertices, contacts, walls, energy and series. On
!> several ranks those of bodies, contacts and energy are collective, and all ranks get the whole.
!>
!> Names, units and meanings are those of the data sets of a result (postproc/file_formats.md): `bodies/position` is the
!> column of /frames. Bodies are in ascending order of identifiers, which their slots have.
module polydem_arrays
   use polydem_bodies, only: bodies_t
   use polydem_body_works, only: find_body_works
   use polydem_communicator, only: communicator_t
   use polydem_contact_columns, only: contact_columns, values_of
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_force_sums, only: total_forces
   use polydem_gathered_rows, only: gather_rows
   use polydem_handles, only: simulation_handle_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_run_output, only: update_balance
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: index_of
   use polydem_wall_forces, only: complete_wall_forces
   use polydem_wall_load, only: wall_load_t
   implicit none
   private
   public :: find_array, kind_absent, kind_integers, kind_reals

   !> Kinds of arrays, as in polydem.h
   integer, parameter :: kind_absent = 0, kind_integers = 1, kind_reals = 2

contains

   !> Keep a copy of an array in the handle. An array that this simulation does not have is absent.
   subroutine find_array(self, name, rows, width, kind, error)
      type(simulation_handle_t), intent(inout) :: self
      !> Name of the array
      character(len=*), intent(in) :: name
      !> Number of rows, and of values per row
      integer(lp), intent(out) :: rows, width
      !> Kind of the array
      integer, intent(out) :: kind
      !> Allocated if there is no such name
      type(error_t), allocatable, intent(inout) :: error
      integer :: slash

      if (allocated(self%reals)) deallocate (self%reals)
      if (allocated(self%integers)) deallocate (self%integers)
      width = 1_lp
      slash = index(name, '/')
      associate (s => self%run%simulation)
         select case (name(:max(slash - 1, 0)))
         case ('bodies')
            ! A step keeps the total forces on fixed bodies only.
            if (any(name(slash + 1:) == [character(len=6) :: 'force', 'torque'])) call find_forces(self%run%comm, s)
            if (any(name(slash + 1:) == [character(len=13) :: 'damping_work', 'friction_work']) .and. &
                s%settings%output%energy_balance) call find_body_works(s%energy_balance, s%dt, s%forces%gravity, &
               s%loop%force_sums, s%loop%walls, s%bodies)
            call find_of_bodies(name(slash + 1:), s%bodies, width, self%integers, self%reals, error)
         case ('contacts')
            call find_of_contacts(name(slash + 1:), s%bodies, s%contacts, width, self%integers, self%reals, error)
         case ('loads')
            call find_of_loads(name(slash + 1:), s%walls%loads, width, self%reals, error)
         case ('cell')
            call find_of_cell(name(slash + 1:), s%bodies, self%reals, error)
         case ('energy')
            call update_balance(self%run)
            if (allocated(self%run%row%value)) self%reals = real(self%run%row%value, wp)
         case ('series')
            call find_of_series(self, name(slash + 1:), width, error)
         case default
            call raise_unknown(name, error)
         end select
         if (.not. allocated(error)) call gather_rows(self%run%comm, name, s%bodies, s%contacts, width, &
                                                       self%integers, self%reals)
      end associate
      kind = kind_absent
      rows = 0_lp
      if (allocated(error)) return
      if (allocated(self%integers)) then
         kind = kind_integers
         rows = size(self%integers, kind=lp)/width
      else if (allocated(self%reals)) then
         kind = kind_reals
         rows = size(self%reals, kind=lp)/width
      end if
   end subroutine find_array

   !> Set the forces on all bodies of this rank, of which it moves the free ones, and of the root rank the fixed ones.
   !> A step that has failed on any rank keeps those that it has.
   subroutine find_forces(comm, s)
      class(communicator_t), intent(inout) :: comm
      type(simulation_t), intent(inout) :: s
      integer(lp) :: has_none(1)

      has_none = merge(1_lp, 0_lp, s%loop%step /= s%step)
      call comm%all_reduce_max(has_none)
      if (has_none(1) == 1_lp) return
      call total_forces(s%forces%gravity, s%loop%force_sums, s%bodies)
      call complete_wall_forces(comm, s%search%neighbours%pairs%first, s%loop%walls, s%bodies)
   end subroutine find_forces

   !> Say that there is no array with a name.
   subroutine raise_unknown(name, error)
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, 'there is no array "'//name//'"')
   end subroutine raise_unknown

   !> Copy a column of the bodies.
   subroutine find_of_bodies(name, bodies, width, integers, reals, error)
      !> Name of the column
      character(len=*), intent(in) :: name
      type(bodies_t), intent(in) :: bodies
      !> Number of values per row
      integer(lp), intent(inout) :: width
      !> One of them is allocated if the bodies have the column
      integer(lp), allocatable, intent(inout) :: integers(:)
      real(wp), allocatable, intent(inout) :: reals(:)
      type(error_t), allocatable, intent(inout) :: error

      associate (n => bodies%n)
         select case (name)
         case ('mass')
            reals = bodies%mass(:n)
         case ('inertia')
            reals = bodies%inertia(:n)
         case ('position')
            call flatten(bodies%position(:, :n))
         case ('velocity')
            call flatten(bodies%velocity(:, :n))
         case ('force')
            call flatten(bodies%force(:, :n))
         case ('vertex')
            call flatten(bodies%pieces%vertex(:, :bodies%pieces%vertex_start(n + 1_ip) - 1_ip))
         case ('angle')
            reals = bodies%angle(:n)
         case ('angular_velocity')
            reals = bodies%angular_velocity(:n)
         case ('torque')
            reals = bodies%torque(:n)
         case ('shear_offset')
            if (allocated(bodies%shear_offset)) reals = bodies%shear_offset(:n)
         case ('damping_work')
            if (allocated(bodies%work)) reals = bodies%work(1, :n)
         case ('friction_work')
            if (allocated(bodies%work)) reals = bodies%work(2, :n)
         case default
            call find_integers_of_bodies(name, bodies, width, integers, error)
         end select
      end associate

   contains

      !> Copy vectors.
      subroutine flatten(vectors)
         !> The vectors, (2, row)
         real(wp), intent(in) :: vectors(:, :)

         width = 2_lp
         reals = reshape(vectors, [size(vectors)])
      end subroutine flatten

   end subroutine find_of_bodies

   !> Copy a column of whole numbers of the bodies.
   subroutine find_integers_of_bodies(name, bodies, width, integers, error)
      !> Name of the column
      character(len=*), intent(in) :: name
      type(bodies_t), intent(in) :: bodies
      !> Number of values per row
      integer(lp), intent(inout) :: width
      !> Allocated if the bodies have the column
      integer(lp), allocatable, intent(inout) :: integers(:)
      type(error_t), allocatable, intent(inout) :: error

      associate (n => bodies%n, pieces => bodies%pieces)
         select case (name)
         case ('id')
            integers = int(bodies%id(:n), lp)
         case ('fixed')
            integers = merge(1_lp, 0_lp, bodies%fixed(:n))
         case ('present')
            if (allocated(bodies%removed)) integers = merge(0_lp, 1_lp, bodies%removed(:n))
         case ('material')
            if (allocated(bodies%material)) integers = int(bodies%material(:n), lp)
         case ('vertex_start')
            integers = int(pieces%vertex_start(:n + 1_ip), lp) - 1_lp
         case ('piece')
            if (pieces%most > 1_ip) integers = int(pieces%number(:pieces%vertex_start(n + 1_ip) - 1_ip), lp)
         case ('image')
            width = 2_lp
            if (allocated(bodies%image)) integers = reshape(transpose(int(bodies%image(:n, :), lp)), [2*n])
         case default
            call raise_unknown('bodies/'//name, error)
         end select
      end associate
   end subroutine find_integers_of_bodies

   !> Copy a column of the contacts.
   subroutine find_of_contacts(name, bodies, contacts, width, integers, reals, error)
      !> Name of the column
      character(len=*), intent(in) :: name
      type(bodies_t), intent(in) :: bodies
      !> Table of the contacts of this step
      type(contacts_t), intent(in) :: contacts
      !> Number of values per row
      integer(lp), intent(inout) :: width
      !> One of them is allocated on return
      integer(lp), allocatable, intent(inout) :: integers(:)
      real(wp), allocatable, intent(inout) :: reals(:)
      type(error_t), allocatable, intent(inout) :: error
      real(dp) :: values(sum(contact_columns%width))
      integer(ip) :: c
      integer :: before, k, n

      select case (name)
      case ('first')
         integers = [(int(bodies%id(contacts%row(c)%first), lp), c=1_ip, contacts%n)]
      case ('second')
         integers = [(int(bodies%id(contacts%row(c)%second), lp), c=1_ip, contacts%n)]
      case default
         k = index_of(name, contact_columns%name)
         if (k == 0) then
            call raise_unknown('contacts/'//name, error)
            return
         end if
         n = contact_columns(k)%width
         before = sum(contact_columns(:k - 1)%width)
         width = int(n, lp)
         allocate (reals(n*contacts%n))
         do c = 1_ip, contacts%n
            values = values_of(bodies, contacts, c)
            reals(n*(c - 1) + 1:n*c) = real(values(before + 1:before + n), wp)
         end do
      end select
   end subroutine find_of_contacts

   !> Copy the state of the loads: displacement, velocity, force of the load, force of the contacts.
   subroutine find_of_loads(name, loads, width, reals, error)
      !> Name of the array
      character(len=*), intent(in) :: name
      type(wall_load_t), allocatable, intent(in) :: loads(:)
      !> Number of values per row
      integer(lp), intent(inout) :: width
      !> Allocated if there are loads
      real(wp), allocatable, intent(inout) :: reals(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (name /= 'value') call raise_unknown('loads/'//name, error)
      if (allocated(error) .or. .not. allocated(loads)) return
      width = 4_lp
      reals = [(loads(k)%place, loads(k)%speed, loads(k)%applied, loads(k)%contact, k=1, size(loads))]
   end subroutine find_of_loads

   !> Copy what describes a periodic cell.
   subroutine find_of_cell(name, bodies, reals, error)
      !> Name of the vector or value
      character(len=*), intent(in) :: name
      type(bodies_t), intent(in) :: bodies
      !> Allocated if the cell has it
      real(wp), allocatable, intent(inout) :: reals(:)
      type(error_t), allocatable, intent(inout) :: error

      select case (name)
      case ('low')
         if (bodies%cell%is_periodic) reals = bodies%cell%low
      case ('size')
         if (bodies%cell%is_periodic) reals = bodies%cell%size
      case ('shift')
         if (bodies%cell%is_sheared) reals = [bodies%cell%shift]
      case ('jump')
         if (bodies%cell%is_sheared) reals = [bodies%cell%jump]
      case default
         call raise_unknown('cell/'//name, error)
      end select
   end subroutine find_of_cell

   !> Copy steps, times or values of the rows of the series that no file has.
   subroutine find_of_series(self, name, width, error)
      !> The handle; its arrays are set
      type(simulation_handle_t), intent(inout) :: self
      !> Name of the array
      character(len=*), intent(in) :: name
      !> Number of values per row
      integer(lp), intent(inout) :: width
      type(error_t), allocatable, intent(inout) :: error

      associate (series => self%run%simulation%series)
         select case (name)
         case ('step')
            if (series%n > 0) self%integers = series%step(:series%n)
         case ('time')
            if (series%n > 0) self%reals = real(series%time(:series%n), wp)
         case ('value')
            if (series%n == 0) return
            width = max(1_lp, size(series%value, 1, kind=lp))
            self%reals = reshape(real(series%value(:, :series%n), wp), [size(series%value, 1)*series%n])
         case default
            call raise_unknown('series/'//name, error)
         end select
      end associate
   end subroutine find_of_series

end module polydem_arrays
