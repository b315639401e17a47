!> Start of a simulation at time 0. All ranks start alike, one or many.
module polydem_start_simulation
   use polydem_begin_stage, only: continue_stages, prepare_stages
   use polydem_bodies, only: bodies_t, greatest_identifier
   use polydem_box_maker, only: update_boxes
   use polydem_check_traffic, only: check_traffic, draw_sample
   use polydem_choose_instruction_set, only: choose_instruction_set
   use polydem_choose_methods, only: choose_methods
   use polydem_choose_step, only: choose_step
   use polydem_communicator, only: communicator_t
   use polydem_domain, only: new_domain
   use polydem_enter_cell, only: check_constraint, enter_cell
   use polydem_errors, only: error_t, input_error, raise
   use polydem_global_reductions, only: find_median
   use polydem_guard, only: set_global_limits
   use polydem_kinds, only: ip, wp
   use polydem_local_data, only: rebuild_local_data
   use polydem_redistribution, only: redistribute
   use polydem_relaxation, only: relax_bodies
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_source_locations, only: place_of
   use polydem_start_forces, only: start_forces
   use polydem_static_pressure, only: choose_stiffness, find_static_pressure
   use polydem_strings, only: to_text
   implicit none
   private
   public :: start_with_bodies, place_bodies

contains

   !> Set up a simulation with the bodies that it has: all fixed bodies, and any share of the free bodies of the run.
   !> Then compute the forces at time 0. Collective; all ranks get the same error.
   subroutine start_with_bodies(settings, comm, self, error)
      !> Checked settings; the group &scene is not used
      type(settings_t), intent(in) :: settings
      class(communicator_t), intent(in) :: comm
      !> On entry with bodies and walls, and with a time step if it is not to be chosen; on return ready to advance
      type(simulation_t), intent(inout) :: self
      !> Allocated if bodies or settings are invalid
      type(error_t), allocatable, intent(inout) :: error

      call place_bodies(settings, comm, self, error)
      if (.not. allocated(error)) call start_forces(self, error)
   end subroutine start_with_bodies

   !> The first part of `start_with_bodies`: all but the forces. Collective; all ranks get the same error.
   subroutine place_bodies(settings, comm, self, error)
      !> Checked settings
      type(settings_t), intent(in) :: settings
      class(communicator_t), intent(in) :: comm
      !> On entry with bodies and walls
      type(simulation_t), intent(inout) :: self
      !> Allocated if bodies or settings are invalid
      type(error_t), allocatable, intent(inout) :: error
      type(bodies_t) :: sample
      real(wp) :: median_diameter

      call choose_instruction_set(self%bodies%isa, error)
      if (allocated(error)) return
      allocate (self%comm, source=comm)
      self%settings = settings
      call enter_cell(self, error)
      if (allocated(error)) return
      call prepare_stages(self%settings, self%stages)
      call find_static_pressure(self)
      call choose_stiffness(self, error)
      if (allocated(error)) return
      call choose_methods(self, error)
      if (allocated(error)) return
      call draw_sample(self, sample, error)
      if (allocated(error)) return
      call self%bodies%pieces%allow(sample%pieces%most)
      call check_identifiers(self, error)
      if (allocated(error)) return
      call choose_step(self, sample, error)
      if (allocated(error)) return
      call self%body_forces%configure(self%settings%forces)
      call find_median(self%comm, self%bodies%diameter(self%bodies%free), median_diameter)
      if (median_diameter >= huge(1.0_wp)) call find_median(self%comm, sample%diameter, median_diameter)
      call new_domain(self%domain, settings%decomposition, median_diameter, self%comm, self%bodies%cell)
      if (.not. allocated(error)) call rebuild_local_data(self, error, median_diameter)
      if (.not. allocated(error)) call check_constraint(self, error)
      call self%comm%all_reduce_error(error)
      if (allocated(error)) return
      call set_global_limits(self)
      call self%motion%integrator%start(self%bodies)
      if (settings%scene%remove_overlap > 0.0_wp) call relax_bodies(self, error)
      if (allocated(error)) return
      call continue_stages(self, error)
      call self%walls%move(0.0_wp, self%bodies)
      call update_boxes(self%search%maker, self%bodies, self%moving, self%search%boxes)
      if (.not. allocated(error)) call check_traffic(self, error)
      call redistribute(self, .false., error)
      call self%comm%all_reduce_error(error)
   end subroutine place_bodies

   !> Check that the pieces of all bodies have identifiers, also once sources have made as many bodies as they count.
   subroutine check_identifiers(self, error)
      type(simulation_t), intent(in) :: self
      !> Names the file of the bodies
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: origin
      integer(ip) :: coming, k

      coming = 0_ip
      associate (settings => self%settings, last => self%bodies%last_id, most => self%bodies%pieces%most)
         do k = 1_ip, size(settings%source, kind=ip)
            coming = max(coming, settings%source(k)%count - self%bodies%n_all)
         end do
         if (most == 1_ip .and. coming == 0_ip) return
         if (last <= greatest_identifier(most) - coming) return
         origin = settings%file
         if (settings%scene%bodies_file /= '') origin = place_of(settings, 'scene', 'bodies_file')
         if (settings%scene%name == 'result') origin = place_of(settings, 'scene', 'start_from')
         call raise(error, input_error, origin//': body '//to_text(last)//': with up to '//to_text(most)// &
                    ' pieces of a body and '//to_text(coming)//' more bodies, identifiers must be at most '// &
                    to_text(greatest_identifier(most) - coming)//'; number the bodies anew, from 1')
      end associate
   end subroutine check_identifiers

end module polydem_start_simulation
