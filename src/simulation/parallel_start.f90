!> Start of a parallel run: the root rank broadcasts the fixed bodies, their prescribed motions and global numbers. The
!> free bodies are distributed by the first step (polydem_redistribution).
module polydem_parallel_start
   use polydem_broadcast_scene, only: broadcast_fixed_bodies, broadcast_motions
   use polydem_choose_instruction_set, only: choose_instruction_set
   use polydem_communicator, only: communicator_t
   use polydem_contact_incidence, only: index_contacts
   use polydem_domain, only: new_domain
   use polydem_errors, only: error_t
   use polydem_integrator_factory, only: new_integrator
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_local_bodies, only: fit_to_bodies
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   implicit none
   private
   public :: start_on_all_ranks

contains

   !> Set up the simulation on all ranks from that of the root rank; collective.
   subroutine start_on_all_ranks(settings, comm, self, error)
      !> Settings of the run, the same on all ranks
      type(settings_t), intent(in) :: settings
      !> Communicator of the run; a copy becomes that of the simulation
      class(communicator_t), intent(inout) :: comm
      !> On entry complete on the root rank, before or between steps; on return set up on all ranks
      type(simulation_t), intent(inout) :: self
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: counts(4)
      real(dp) :: numbers(4)

      if (comm%is_root()) then
         counts = [int(self%bodies%n_all, lp), self%n_steps, size(self%motions, kind=lp), self%step]
         numbers = real([self%dt, self%expected_stable_step, self%maker%median_diameter, self%guard%limit], dp)
      end if
      if (comm%size > 1_ip) then
         call comm%broadcast(counts)
         call comm%broadcast(numbers)
         if (.not. comm%is_root()) then
            self%settings = settings
            self%n_steps = counts(2)
            self%step = counts(4)
            self%dt = real(numbers(1), wp)
            self%expected_stable_step = real(numbers(2), wp)
            self%guard%limit = real(numbers(4), wp)
            ! The limit is that of the whole run. It does not depend on the bodies of this rank.
            self%generation = 1_ip
            call choose_instruction_set(self%isa, error)
            call new_integrator(settings%integrate, self%integrator)
            allocate (self%motions(counts(3)))
         end if
         call broadcast_fixed_bodies(comm, int(counts(1), ip), self%bodies)
         call broadcast_motions(comm, self%motions)
         if (.not. comm%is_root()) call begin_without_free_bodies(self, real(numbers(3), wp), error)
      end if
      call new_domain(self%domain, settings%decomposition, self%maker%median_diameter, comm, error)
      if (allocated(self%comm)) deallocate (self%comm)
      allocate (self%comm, source=comm)
   end subroutine start_on_all_ranks

   !> Set up the rest of the simulation of a rank that has only fixed bodies.
   subroutine begin_without_free_bodies(self, median_diameter, error)
      type(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: median_diameter
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: k, j, s

      do k = 1_ip, size(self%motions, kind=ip)
         do j = 1_ip, size(self%motions(k)%slots, kind=ip)
            do s = 1_ip, self%bodies%n
               if (self%bodies%global_index(s) == self%motions(k)%slots(j)) exit
            end do
            self%motions(k)%slots(j) = s
         end do
      end do
      call fit_to_bodies(self, error, median_diameter)
      if (allocated(error)) return
      call index_contacts(self%bodies%n, self%contacts, self%incidence)
      call self%integrator%start(self%bodies)
   end subroutine begin_without_free_bodies

end module polydem_parallel_start
