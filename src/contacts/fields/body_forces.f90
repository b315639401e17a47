!> The forces on bodies that are no contacts, a list, and its factory.
module polydem_body_forces
   use polydem_bodies, only: bodies_t, block_size
   use polydem_body_force, only: body_force_t
   use polydem_drag, only: drag_t
   use polydem_field_sums, only: add_field, reserve_field
   use polydem_force_sums, only: force_sums_t
   use polydem_kinds, only: ip, wp, min_parallel_size
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
      !> The forces, in the order in which they are added; not allocated if there is none
      type(listed_force_t), allocatable :: list(:)
   contains
      procedure :: apply
      procedure :: configure
      procedure :: rate
      procedure :: description
      procedure :: add
   end type body_forces_t

contains

   !> Choose the forces that the settings ask for.
   subroutine choose_body_forces(settings, forces)
      type(forces_settings_t), intent(in) :: settings
      type(body_forces_t), intent(out) :: forces

      if (settings%drag > 0.0_wp) call forces%add(drag_t(name='drag'), settings)
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

   !> Add the forces on all free bodies to the sums of contact forces.
   subroutine apply(self, bodies, sums)
      class(body_forces_t), intent(in) :: self
      !> Bodies with the positions and velocities of this step
      type(bodies_t), intent(in) :: bodies
      !> Sums of the contact forces of this step
      type(force_sums_t), intent(inout) :: sums
      integer(ip) :: low

      if (.not. allocated(self%list)) return
      call reserve_field(bodies%n, sums)
      !$omp parallel do if (size(bodies%free) > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(self, bodies, sums) private(low)
      do low = 1_ip, size(bodies%free, kind=ip), block_size
         call apply_block(self, bodies, bodies%free(low:min(low + block_size - 1_ip, size(bodies%free, kind=ip))), sums)
      end do
      !$omp end parallel do
   end subroutine apply

   !> Add the forces on up to `block_size` bodies.
   pure subroutine apply_block(self, bodies, slots, sums)
      type(body_forces_t), intent(in) :: self
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: slots(:)
      type(force_sums_t), intent(inout) :: sums
      real(wp) :: force(3, block_size)
      integer :: k

      force = 0.0_wp
      do k = 1, size(self%list)
         call self%list(k)%force%add(bodies, slots, force)
      end do
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
      if (.not. allocated(self%list)) return
      do k = 1, size(self%list)
         text = text//', '//trim(self%list(k)%force%name)
      end do
   end function description

end module polydem_body_forces
