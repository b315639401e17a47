!> Record of the named walls: force, torque, impulse and work, as columns of the series of a run.
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
   use polydem_force_sums, only: n_terms, of_normal, of_tangential, sum_torque, sum_x, sum_y
   use polydem_kinds, only: ip, lp, wp
   use polydem_named_values, only: named_values_t
   use polydem_named_walls, only: named_walls_t
   use polydem_serializer, only: serializer_t
   use polydem_wall_terms, only: wall_terms_t
   implicit none
   private
   public :: wall_record_t, force_about

   !> Rates that are summed over steps: power of the wall [W/m], force on it along x and y [N/m], torque [N]
   integer, parameter :: n_rates = 4

   !> Sums over steps of each wall
   type :: wall_record_t
      !> Sums of the contacts of this rank, (n_rates, wall); not allocated without a record
      type(exact_sum_t), allocatable :: sums(:, :)
   contains
      procedure :: start
      procedure :: accumulate
      procedure :: set_columns
      procedure :: collect
      procedure :: clear
      procedure :: serialize
   end type wall_record_t

contains

   !> Start the record with the contacts of step 0.
   subroutine start(self, walls, bodies, terms)
      class(wall_record_t), intent(inout) :: self
      type(named_walls_t), intent(in) :: walls
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms
      integer :: n

      n = 0
      if (allocated(walls%wall)) n = size(walls%wall)
      if (allocated(self%sums)) deallocate (self%sums)
      allocate (self%sums(n_rates, n))
      call self%accumulate(walls, bodies, terms, 0.5_wp)
   end subroutine start

   !> Accumulate the rates of the contacts of a step, times a weight.
   subroutine accumulate(self, walls, bodies, terms, weight)
      class(wall_record_t), intent(inout) :: self
      type(named_walls_t), intent(in) :: walls
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms
      !> Factor of the rates: 1 for a step
      real(wp), intent(in) :: weight

      if (size(self%sums, 2) > 0) call add_rates(walls, bodies, terms, weight, self%sums)
   end subroutine accumulate

   !> Add the rates of contacts to sums.
   subroutine add_rates(walls, bodies, terms, weight, sums)
      type(named_walls_t), intent(in) :: walls
      type(bodies_t), intent(in) :: bodies
      type(wall_terms_t), intent(in) :: terms
      real(wp), intent(in) :: weight
      type(exact_sum_t), intent(inout) :: sums(:, :)
      real(wp) :: force(3)
      integer(ip) :: c, w

      do c = 1_ip, terms%n
         associate (s => terms%slots(1, c))
            w = walls%wall_of(s)
            if (w == 0_ip) cycle
            force = force_about(path_of(bodies, s), bodies, s, terms%term(:, c))
            call sums(1, w)%add(-weight*((force(1)*bodies%velocity(1, s) + force(2)*bodies%velocity(2, s)) &
                                         + force(3)*bodies%angular_velocity(s)))
            force = force_about(walls%wall(w)%pivot, bodies, s, terms%term(:, c))
            call sums(2, w)%add(weight*force(1))
            call sums(3, w)%add(weight*force(2))
            call sums(4, w)%add(weight*force(3))
         end associate
      end do
   end subroutine add_rates

   !> Force of a contact on a fixed body along x and y [N/m], and its torque about a point [N]. The body is on its path
   !> through the copies of a periodic cell.
   pure function force_about(point, bodies, s, term) result(force)
      !> The point, (2) [m]
      real(wp), intent(in) :: point(2)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the fixed body
      integer(ip), intent(in) :: s
      !> Its term in the contact
      real(wp), intent(in) :: term(n_terms)
      real(wp) :: force(3), arm(2)

      arm = path_of(bodies, s) - point
      force(1) = term(sum_x(of_normal)) + term(sum_x(of_tangential))
      force(2) = term(sum_y(of_normal)) + term(sum_y(of_tangential))
      force(3) = (arm(1)*force(2) - arm(2)*force(1)) &
                 + (term(sum_torque(of_normal)) + term(sum_torque(of_tangential)))
   end function force_about

   !> Set the columns of all walls at the end of a step. Collective.
   subroutine set_columns(self, comm, dt, walls, bodies, terms, row)
      class(wall_record_t), intent(in) :: self
      class(communicator_t), intent(inout) :: comm
      !> Time step [s]
      real(wp), intent(in) :: dt
      type(named_walls_t), intent(in) :: walls
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Contacts with fixed bodies
      type(wall_terms_t), intent(in) :: terms
      !> Row of the series
      type(named_values_t), intent(inout) :: row
      type(exact_sum_t), allocatable :: totals(:, :), list(:)
      character(len=:), allocatable :: name
      real(wp) :: centre(2)
      integer(ip) :: w
      integer :: n

      n = size(self%sums, 2)
      if (n == 0) return
      allocate (totals(n_rates, 2*n))
      totals(:, :n) = self%sums
      call add_rates(walls, bodies, terms, -0.5_wp, totals(:, :n))
      call add_rates(walls, bodies, terms, 1.0_wp, totals(:, n + 1:))
      list = [totals]
      call all_reduce_exact_sums(comm, list)
      totals = reshape(list, shape(totals))
      do w = 1_ip, int(n, ip)
         name = walls%wall(w)%name
         centre = walls%centre(w, bodies)
         associate (now => totals(:, n + w)%value(), sums => dt*totals(:, w)%value())
            call row%set(name//'.x', centre(1), 'm', 'mean of the centres of mass of the bodies of the wall')
            call row%set(name//'.y', centre(2), 'm', 'mean of the centres of mass of the bodies of the wall')
            call row%set(name//'.angle', walls%turn(w, bodies), 'rad', 'angle by which the wall has turned')
            call row%set(name//'.force_x', now(2), 'N/m', 'force of the free bodies on the wall along x')
            call row%set(name//'.force_y', now(3), 'N/m', 'force of the free bodies on the wall along y')
            call row%set(name//'.torque', now(4), 'N', 'its torque about ('//point_text(walls%wall(w)%pivot)//') m')
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
   subroutine collect(self, comm)
      class(wall_record_t), intent(inout) :: self
      class(communicator_t), intent(inout) :: comm
      type(exact_sum_t), allocatable :: list(:)

      if (.not. allocated(self%sums)) return
      list = [self%sums]
      call all_reduce_exact_sums(comm, list)
      self%sums = reshape(list, shape(self%sums))
      if (.not. comm%is_root()) call self%clear()
   end subroutine collect

   !> Set the sums of this rank to zero.
   subroutine clear(self)
      class(wall_record_t), intent(inout) :: self

      if (allocated(self%sums)) self%sums = exact_sum_t()
   end subroutine clear

   !> Serialize the sums, of which the root rank has all.
   subroutine serialize(self, serializer)
      class(wall_record_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer
      integer(lp), allocatable :: words(:)
      integer :: i, k, first

      if (.not. allocated(self%sums)) return
      if (size(self%sums) == 0) return
      allocate (words(n_words*size(self%sums)))
      do k = 1, size(self%sums, 2)
         do i = 1, n_rates
            first = n_words*((k - 1)*n_rates + i - 1)
            call self%sums(i, k)%carry()
            words(first + 1:first + n_words) = self%sums(i, k)%digit
         end do
      end do
      call serializer%field('/run/wall_sums', words, '1', 'exact sums over steps of power, '// &
                            'force and torque of each wall')
      if (.not. serializer%is_reading .or. allocated(serializer%error)) return
      do k = 1, size(self%sums, 2)
         do i = 1, n_rates
            first = n_words*((k - 1)*n_rates + i - 1)
            self%sums(i, k)%digit = words(first + 1:first + n_words)
         end do
      end do
   end subroutine serialize

end module polydem_wall_record
