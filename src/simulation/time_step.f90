!> The time step of a simulation.
module polydem_time_step
   use polydem_bodies, only: turn_bodies
   use polydem_box_maker, only: turn_and_bound
   use polydem_completion, only: complete_step
   use polydem_contact_incidence, only: index_contacts
   use polydem_contact_walk, only: walk_contacts
   use polydem_errors, only: error_t, raise, run_error
   use polydem_force_sums, only: assemble_forces, total_forces
   use polydem_guards, only: check_contacts
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_prediction, only: predict_bodies
   use polydem_redistribution, only: restore_history, redistribute
   use polydem_simulation, only: simulation_t, sum_began, sum_ended
   use polydem_strings, only: to_text
   use polydem_timers, only: stage_boxes, stage_decomposition, stage_forces, stage_integrate, stage_neighbours, &
      stage_overlap
   use polydem_wall_terms, only: select_walls
   implicit none
   private
   public :: advance, compute_forces, tabulate_contacts

contains

   !> Advance by one time step. Collective. An error of one rank reaches all ranks within the step, or at the latest in
   !> the all-reduce of errors after it.
   subroutine advance(self, error)
      type(simulation_t), intent(inout) :: self
      !> Allocated if the run must stop; names the body, its position and the step
      type(error_t), allocatable, intent(inout) :: error
      real(dp) :: boxes_share

      self%step = self%step + 1_lp
      self%energy_balance%is_current = .false.
      self%has_forces = .false.
      call self%timers%start()
      call predict_bodies(self, boxes_share, error)
      call self%timers%divide_lap(stage_boxes, stage_integrate, boxes_share)
      call place_boxes(self, error)
      if (allocated(error)) return
      call sum_forces(self, self%dt, error)
      ! A contact may stop the run here. Then no rank completes the step.
      if (self%settings%overlap%degenerate == 'stop') call self%comm%all_reduce_error(error)
      if (allocated(error)) return
      call complete_step(self, error)
      call self%timers%lap(stage_integrate)
   end subroutine advance

   !> Receive the halo, and update vertices and boxes of all but the free bodies. Redistribute the bodies if necessary.
   subroutine place_boxes(self, error)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      logical :: is_parallel

      is_parallel = self%comm%size > 1_ip
      if (is_parallel) then
         call self%domain%halo%receive_halo(self%comm, self%bodies)
         call self%timers%lap(stage_decomposition)
      end if
      if (.not. allocated(error)) then
         call turn_and_bound(self%maker, self%moving(size(self%bodies%free) + 1:), self%isa, self%bodies, self%boxes)
         call self%timers%lap(stage_boxes)
      end if
      call redistribute(self, error)
      if (.not. is_parallel) return
      self%domain%halo_steps = self%domain%halo_steps + int(size(self%domain%halo%slots), lp)
      call self%timers%lap(stage_decomposition)
   end subroutine place_boxes

   !> Compute the forces on the bodies from their boxes.
   subroutine compute_forces(self, dt, error)
      !> The simulation with updated boxes
      type(simulation_t), intent(inout) :: self
      !> Time step of the force law [s]; 0 at time 0
      real(wp), intent(in) :: dt
      !> Names the step and the contact or the finder that failed
      type(error_t), allocatable, intent(inout) :: error

      call sum_forces(self, dt, error)
      if (allocated(error)) return
      call total_forces(self%settings%forces%gravity, self%force_sums, 1_ip, self%bodies%n, self%bodies)
   end subroutine compute_forces

   !> After a failure, make the table of contacts of this step if the step has not kept it, and the forces on fixed
   !> bodies. Collective. Such a table shows the contacts of the state at the stop, with the forces of a time step of
   !> length 0. It is empty if the step failed before it found contacts.
   subroutine tabulate_contacts(self)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable :: known_error
      integer(lp) :: has_none(1)
      integer(ip) :: k

      ! The finder of one rank may have failed, after which the others found their contacts.
      has_none = merge(1_lp, 0_lp, self%walk%step /= self%step)
      call self%comm%all_reduce_max(has_none)
      if (has_none(1) == 1_lp) then
         self%contacts%n = 0_ip
         return
      end if
      if (self%settings%output%contacts .and. .not. self%keeps_contacts) then
         ! The end of the step changed velocities, and poses with some integrators.
         if (self%comm%size > 1_ip) call self%domain%halo%follow(self%comm, self%bodies)
         call turn_bodies(self%bodies, [(k, k=1_ip, self%bodies%n)], self%isa)
         self%keeps_contacts = .true.
         call sum_forces(self, 0.0_wp, known_error)
      end if
      call total_forces(self%settings%forces%gravity, self%force_sums, 1_ip, self%bodies%n, self%bodies)
   end subroutine tabulate_contacts

   !> Sum the contact forces on the bodies from their boxes: neighbours, contacts, force law. This is the middle of a
   !> step.
   subroutine sum_forces(self, dt, error)
      !> The simulation with updated boxes
      type(simulation_t), intent(inout) :: self
      !> Time step of the force law [s]; 0 at time 0
      real(wp), intent(in) :: dt
      !> Names the step and the contact or the finder that failed
      type(error_t), allocatable, intent(inout) :: error
      real(dp) :: overlap_share

      call self%neighbours%update(self%boxes)
      if (self%neighbours%pairs%contradictions > 0_lp) then
         call raise(error, run_error, 'step '//to_text(self%step)//': finder '// &
                    self%settings%neighbours%finder//' reported changes that contradict its pair list. This is a '// &
                    'program error; use finder all_pairs instead')
         return
      end if
      associate (pairs => self%neighbours%pairs)
         ! Other bodies with pairs are turned already.
         if (self%is_dilute .and. pairs%n_joined > 0_ip) &
            call turn_bodies(self%bodies, pairs%joined(:pairs%n_joined), self%isa)
      end associate
      call carry_history(self)
      call restore_history(self)
      call self%timers%lap(stage_neighbours)
      associate (pairs => self%neighbours%pairs)
         self%sums(sum_began) = self%sums(sum_began) + int(pairs%n_began, lp)
         self%sums(sum_ended) = self%sums(sum_ended) + int(pairs%n_ended, lp)
      end associate
      if (allocated(self%law%constraint)) self%keeps_contacts = .true.
      call walk_contacts(self, dt, overlap_share)
      call self%timers%divide_lap(stage_overlap, stage_forces, overlap_share)
      call check_contacts(self%settings%overlap%degenerate, self%bodies, self%walk%suspects, self%step, error)
      if (self%keeps_contacts) call index_contacts(self%bodies%n, self%contacts, self%walk%incidence)
      if (allocated(self%law%constraint)) call constrain(self, error)
      call self%timers%lap(stage_forces)
   end subroutine sum_forces

   !> Add the forces of a velocity constraint.
   subroutine constrain(self, error)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call total_forces(self%settings%forces%gravity, self%force_sums, 1_ip, self%bodies%n, self%bodies)
      call self%law%constraint%apply(self%dt, self%walk%incidence, self%bodies, self%contacts, self%history, error)
      if (allocated(error)) error%message = 'step '//to_text(self%step)//': '//error%message
      call assemble_forces(self%settings%forces%gravity, self%contacts, self%bodies, self%force_sums)
      call select_walls(self%bodies, self%contacts, self%walk%walls)
   end subroutine constrain

   !> Apply the moves of the pair list to the columns of the contact history.
   subroutine carry_history(self)
      type(simulation_t), intent(inout) :: self
      integer :: k

      associate (pairs => self%neighbours%pairs, history => self%history)
         call pairs%carry(history%memory, 0_ip)
         if (.not. allocated(history%column)) return
         do k = 1, size(history%column)
            call pairs%carry(history%column(k)%value, 0.0_wp)
         end do
      end associate
   end subroutine carry_history

end module polydem_time_step
