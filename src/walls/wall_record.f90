!> Record of the walls with names: force, torque, impulse and work, as columns of the series of a run.
!>
!> Work and impulse are sums over steps of what the contacts do, by the trapezoidal rule between the ends of steps, as
!> in the energy balance: the first rate has the weight 1/2, and a row subtracts half of the last one. All sums are
!> exact, so their bits do not depend on ranks, threads and restarts.
module polydem_wall_record
   use polydem_bodies, only: bodies_t
   use polydem_bodies_in_cell, only: path_of
   use polydem_communicator, only: communicator_t
   use polydem_exact_all_reduce, only: all_reduce_exact_sums
   use polydem_exact_sum, only: exact_sum_t, n_words
   use polydem_kinds, only: ip, lp, wp
   use polydem_named_values, only: named_values_t
   use polydem_serializer, only: serializer_t
   use polydem_wall, only: wall_t
   use polydem_wall_load, only: set_load_columns
   use polydem_wall_terms, only: force_about, wall_terms_t
   use polydem_walls, only: walls_t
   implicit none
   private
   public :: start_record, add_step, set_wall_columns, collect_record, clear_record, serialize_record

   !> Rates that are summed over steps: power of the wall [W/m], force on it along x and y [N/m], torque [N]
   integer, parameter :: n_rates = 4

contains

   !> Start the record with the contacts of step 0.
   subroutine start_record(walls, bodies, terms)
      !> All walls
      type(walls_t), intent(inout) :: walls
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms

      if (allocated(walls%sums)) deallocate (walls%sums)
      allocate (walls%sums(n_rates, walls%n_named))
      if (walls%n_named > 0_ip) call add_rates(walls%wall, walls%wall_of, bodies, terms, 0.5_wp, walls%sums)
   end subroutine start_record

   !> Add a step to the record.
   subroutine add_step(walls, bodies, terms)
      !> Walls with a record
      type(walls_t), intent(inout) :: walls
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms

      if (walls%n_named > 0_ip) call add_rates(walls%wall, walls%wall_of, bodies, terms, 1.0_wp, walls%sums)
   end subroutine add_step

   !> Add the rates of contacts to sums.
   subroutine add_rates(wall, wall_of, bodies, terms, weight, sums)
      !> All walls
      type(wall_t), intent(in) :: wall(:)
      !> Wall of each body, (slot)
      integer(ip), intent(in) :: wall_of(:)
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms
      !> Factor of the rates: 1 for a step
      real(wp), intent(in) :: weight
      !> The sums, (n_rates, wall)
      type(exact_sum_t), intent(inout) :: sums(:, :)
      real(wp) :: force(3)
      integer(ip) :: c, w

      do c = 1_ip, terms%n
         associate (s => terms%slots(1, c))
            w = wall_of(s)
            if (w == 0_ip) cycle
            force = force_about(path_of(bodies, s), bodies, s, terms%term(:, c))
            call sums(1, w)%add(-weight*((force(1)*bodies%velocity(1, s) + force(2)*bodies%velocity(2, s)) &
                                         + force(3)*bodies%angular_velocity(s)))
            force = force_about(wall(w)%pivot, bodies, s, terms%term(:, c))
            call sums(2, w)%add(weight*force(1))
            call sums(3, w)%add(weight*force(2))
            call sums(4, w)%add(weight*force(3))
         end associate
      end do
   end subroutine add_rates

   !> Set the columns of all walls and loads in a row of the series at the end of a step. Collective.
   subroutine set_wall_columns(walls, comm, dt, bodies, terms, row)
      !> Walls with a record
      type(walls_t), intent(in) :: walls
      class(communicator_t), intent(inout) :: comm
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms
      !> Row of the series
      type(named_values_t), intent(inout) :: row

      if (walls%n_named > 0_ip) call set_columns(walls%wall(:walls%n_named), walls%wall_of, comm, dt, walls%sums, &
                                                 bodies, terms, row)
      if (allocated(walls%loads)) call set_load_columns(walls%loads, dt, row)
   end subroutine set_wall_columns

   !> Set the columns of all walls with names.
   subroutine set_columns(wall, wall_of, comm, dt, so_far, bodies, terms, row)
      !> The walls
      type(wall_t), intent(in) :: wall(:)
      !> Wall of each body, (slot)
      integer(ip), intent(in) :: wall_of(:)
      class(communicator_t), intent(inout) :: comm
      real(wp), intent(in) :: dt
      !> The sums of this rank, (n_rates, wall)
      type(exact_sum_t), intent(in) :: so_far(:, :)
      type(bodies_t), intent(in) :: bodies
      type(wall_terms_t), intent(in) :: terms
      type(named_values_t), intent(inout) :: row
      type(exact_sum_t), allocatable :: totals(:, :), list(:)
      character(len=:), allocatable :: name
      real(wp) :: centre(2)
      integer :: n, w

      n = size(wall)
      allocate (totals(n_rates, 2*n))
      totals(:, :n) = so_far
      call add_rates(wall, wall_of, bodies, terms, -0.5_wp, totals(:, :n))
      call add_rates(wall, wall_of, bodies, terms, 1.0_wp, totals(:, n + 1:))
      list = [totals]
      call all_reduce_exact_sums(comm, list)
      totals = reshape(list, shape(totals))
      do w = 1, n
         name = wall(w)%name
         centre = wall(w)%centre(bodies)
         associate (now => totals(:, n + w)%value(), sums => dt*totals(:, w)%value())
            call row%set(name//'.x', centre(1), 'm', 'mean of the centres of mass of the bodies of the wall')
            call row%set(name//'.y', centre(2), 'm', 'mean of the centres of mass of the bodies of the wall')
            call row%set(name//'.angle', wall(w)%turn(bodies), 'rad', 'angle by which the wall has turned')
            call row%set(name//'.force_x', now(2), 'N/m', 'force of the free bodies on the wall along x')
            call row%set(name//'.force_y', now(3), 'N/m', 'force of the free bodies on the wall along y')
            call row%set(name//'.torque', now(4), 'N', 'its torque about ('//point_text(wall(w)%pivot)//') m')
            call row%set(name//'.work', sums(1), 'J/m', 'work of the wall on the free bodies so far')
            call row%set(name//'.impulse_x', sums(2), 'N s/m', 'impulse of the force along x so far')
            call row%set(name//'.impulse_y', sums(3), 'N s/m', 'impulse of the force along y so far')
            call row%set(name//'.angular_impulse', sums(4), 'N s', 'impulse of the torque so far')
         end associate
      end do
   end subroutine set_columns

   !> A point as text
   pure function point_text(point) result(text)
      real(wp), intent(in) :: point(2)
      character(len=:), allocatable :: text
      character(len=24) :: word

      write (word, '(es10.3, ", ", es10.3)') point
      text = trim(adjustl(word))
   end function point_text

   !> Add up the sums of all ranks on the root rank, and reset them to zero on the other ranks. Collective.
   subroutine collect_record(walls, comm)
      !> Walls with or without a record
      type(walls_t), intent(inout) :: walls
      class(communicator_t), intent(inout) :: comm
      type(exact_sum_t), allocatable :: list(:)

      if (.not. allocated(walls%sums)) return
      list = [walls%sums]
      call all_reduce_exact_sums(comm, list)
      walls%sums = reshape(list, shape(walls%sums))
      if (.not. comm%is_root()) call clear_record(walls)
   end subroutine collect_record

   !> Set the sums of this rank to zero.
   subroutine clear_record(walls)
      !> Walls with or without a record
      type(walls_t), intent(inout) :: walls

      if (allocated(walls%sums)) walls%sums = exact_sum_t()
   end subroutine clear_record

   !> Serialize the sums, of which the root rank has all.
   subroutine serialize_record(walls, serializer)
      !> Walls with or without a record
      type(walls_t), intent(inout) :: walls
      class(serializer_t), intent(inout) :: serializer
      integer(lp), allocatable :: words(:)
      integer :: i, k, first

      if (.not. allocated(walls%sums)) return
      if (size(walls%sums) == 0) return
      allocate (words(n_words*size(walls%sums)))
      do k = 1, size(walls%sums, 2)
         do i = 1, n_rates
            first = n_words*((k - 1)*n_rates + i - 1)
            call walls%sums(i, k)%carry()
            words(first + 1:first + n_words) = walls%sums(i, k)%digit
         end do
      end do
      call serializer%field('/run/wall_sums', words, '1', 'exact sums over steps of power, '// &
                            'force and torque of each wall')
      if (.not. serializer%is_reading .or. allocated(serializer%error)) return
      do k = 1, size(walls%sums, 2)
         do i = 1, n_rates
            first = n_words*((k - 1)*n_rates + i - 1)
            walls%sums(i, k)%digit = words(first + 1:first + n_words)
         end do
      end do
   end subroutine serialize_record

end module polydem_wall_record
