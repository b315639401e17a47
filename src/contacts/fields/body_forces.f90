!> The forces on bodies that are no contacts, a list, and its factory.
module polydem_body_forces
   use polydem_bodies, only: bodies_t, block_size
   use polydem_body_force, only: body_force_t
   use polydem_changing_gravity, only: changes_gravity, changing_gravity_t, new_changing_gravity
   use polydem_drag, only: drag_t
   use polydem_field_sums, only: add_field, reserve_field, reserve_given
   use polydem_force_sums, only: force_sums_t, of_normal, of_tangential, sum_torque, sum_x, sum_y
   use polydem_given_forces, only: given_forces_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_local_damping, only: local_damping_t
   use polydem_settings, only: forces_settings_t
   implicit none
   private
   public :: body_forces_t, choose_body_forces

   !> A force of any kind
   type :: listed_force_t
      !> The force
      class(body_force_t), allocatable :: force
   end type listed_force_t

   !> The forces that act in a run
   type :: body_forces_t
      !> How gravity changes; not allocated if it is constant
      type(changing_gravity_t), allocatable :: changing
      !> Forces that actions give to bodies; not allocated if there are none
      type(given_forces_t), allocatable :: given
      !> The forces, in the order in which they are added; not allocated if there is none
      type(listed_force_t), allocatable :: list(:)
   contains
      procedure :: apply
      procedure :: act
      procedure :: configure
      procedure :: rate
      procedure :: description
      procedure :: add
      procedure :: give
      procedure :: allow_drag
   end type body_forces_t

contains

   !> Choose the forces that the settings ask for.
   subroutine choose_body_forces(settings, forces)
      type(forces_settings_t), intent(in) :: settings
      type(body_forces_t), intent(out) :: forces

      if (settings%drag > 0.0_wp) call forces%add(drag_t(name='drag'), settings)
      if (changes_gravity(settings)) forces%changing = new_changing_gravity(settings)
      ! It damps the total force, so it is the last one.
      if (settings%local_damping > 0.0_wp) call forces%add(local_damping_t(name='local damping'), settings)
   end subroutine choose_body_forces

   !> Append a force.
   subroutine add(self, force, settings)
      class(body_forces_t), intent(inout) :: self
      class(body_force_t), intent(in) :: force
      type(forces_settings_t), intent(in) :: settings
      type(listed_force_t), allocatable :: longer(:)
      integer :: k, n

      n = 0
      if (allocated(self%list)) n = size(self%list)
      allocate (longer(n + 1))
      do k = 1, n
         call move_alloc(self%list(k)%force, longer(k)%force)
      end do
      allocate (longer(n + 1)%force, source=force)
      call longer(n + 1)%force%configure(settings)
      call move_alloc(longer, self%list)
   end subroutine add

   !> Give forces and torques to bodies, which are held until they are given others.
   subroutine give(self, id, value)
      class(body_forces_t), intent(inout) :: self
      !> Identifiers of the bodies, each once
      integer(ip), intent(in) :: id(:)
      !> Forces along x and y [N/m] and torques [N], (3, body)
      real(wp), intent(in) :: value(:, :)

      if (.not. allocated(self%given)) allocate (self%given)
      call self%given%set(id, value)
   end subroutine give

   !> Let there be a drag, so that its rate can change.
   subroutine allow_drag(self, settings)
      class(body_forces_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      type(body_forces_t) :: longer
      integer :: k

      call longer%add(drag_t(name='drag'), settings)
      if (allocated(self%list)) then
         do k = 1, size(self%list)
            if (self%list(k)%force%name == 'drag') return
            call longer%add(self%list(k)%force, settings)
         end do
      end if
      call move_alloc(longer%list, self%list)
   end subroutine allow_drag

   !> Whether there is any force
   pure logical function act(self)
      class(body_forces_t), intent(in) :: self

      act = allocated(self%list) .or. allocated(self%changing) .or. allocated(self%given)
   end function act

   !> Add the forces on all free bodies to the sums of contact forces.
   subroutine apply(self, gravity, time, bodies, sums)
      class(body_forces_t), intent(in) :: self
      !> Constant acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Simulated time [s]
      real(wp), intent(in) :: time
      !> Bodies with the positions and velocities of this step
      type(bodies_t), intent(in) :: bodies
      !> Sums of the contact forces of this step
      type(force_sums_t), intent(inout) :: sums
      integer(ip) :: low

      if (.not. self%act()) return
      call reserve_field(bodies%n, sums)
      if (allocated(self%given)) call reserve_given(bodies%n, sums)
      if (allocated(self%changing)) sums%acceleration = self%changing%acceleration(gravity, time)
      !$omp parallel do if (size(bodies%free) > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, gravity, bodies, sums) private(low)
      do low = 1_ip, size(bodies%free, kind=ip), block_size
         call apply_block(self, gravity, bodies, &
                          bodies%free(low:min(low + block_size - 1_ip, size(bodies%free, kind=ip))), sums)
      end do
      !$omp end parallel do
   end subroutine apply

   !> Add the forces on up to `block_size` bodies.
   pure subroutine apply_block(self, gravity, bodies, slots, sums)
      type(body_forces_t), intent(in) :: self
      real(wp), intent(in) :: gravity(2)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: slots(:)
      type(force_sums_t), intent(inout) :: sums
      real(wp) :: others(3, block_size), force(3, block_size), given(3, block_size)
      integer :: k

      do k = 1, size(slots)
         associate (value => sums%value(:, slots(k)), m => bodies%mass(slots(k)))
            others(1, k) = value(sum_x(of_normal)) + value(sum_x(of_tangential)) + m*gravity(1)
            others(2, k) = value(sum_y(of_normal)) + value(sum_y(of_tangential)) + m*gravity(2)
            others(3, k) = value(sum_torque(of_normal)) + value(sum_torque(of_tangential))
            force(1:2, k) = m*sums%acceleration
            force(3, k) = 0.0_wp
         end associate
      end do
      if (allocated(self%given)) then
         call self%given%find(bodies, slots, given)
         sums%given(:, slots) = given(:, :size(slots))
         force(:, :size(slots)) = force(:, :size(slots)) + given(:, :size(slots))
      end if
      if (allocated(self%list)) then
         do k = 1, size(self%list)
            call self%list(k)%force%add(others, bodies, slots, force)
         end do
      end if
      call add_field(slots, force(:, :size(slots)), sums)
   end subroutine apply_block

   !> Copy the parameters of all forces from the settings. The forces stay the same.
   subroutine configure(self, settings)
      class(body_forces_t), intent(inout) :: self
      type(forces_settings_t), intent(in) :: settings
      integer :: k

      if (.not. allocated(self%list)) return
      do k = 1, size(self%list)
         call self%list(k)%force%configure(settings)
      end do
   end subroutine configure

   !> Greatest rate at which a force changes velocities [1/s]
   pure real(wp) function rate(self)
      class(body_forces_t), intent(in) :: self
      integer :: k

      rate = 0.0_wp
      if (allocated(self%changing)) rate = self%changing%rate()
      if (.not. allocated(self%list)) return
      do k = 1, size(self%list)
         rate = max(rate, self%list(k)%force%rate)
      end do
   end function rate

   !> Names of the forces, each after a comma; empty if there is none
   pure function description(self) result(text)
      class(body_forces_t), intent(in) :: self
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      if (allocated(self%changing)) text = ', changing gravity'
      if (.not. allocated(self%list)) return
      do k = 1, size(self%list)
         text = text//', '//trim(self%list(k)%force%name)
      end do
   end function description

end module polydem_body_forces
