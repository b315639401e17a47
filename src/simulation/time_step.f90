!> The time step of a simulation.
module polydem_time_step
   use polydem_bodies, only: turn_bodies
   use polydem_box_images, only: place_images
   use polydem_box_maker, only: turn_and_bound
   use polydem_boxes_within, only: have_boxes_within
   use polydem_complete, only: complete_step
   use polydem_contact_history, only: contact_history_t
   use polydem_contact_loop, only: loop_over_contacts
   use polydem_energy_balance, only: expire_balance
   use polydem_errors, only: error_t, raise, run_error
   use polydem_force_sums, only: assemble_forces, total_forces
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_list, only: pair_list_t
   use polydem_participants, only: begin_step, change_bodies, check_contacts, end_step, follow_forces, &
      need_all_ranks, need_table
   use polydem_predict, only: predict_bodies, predict_border
   use polydem_redistribution, only: restore_history, redistribute
   use polydem_simulation, only: simulation_t, sum_began, sum_ended, time_of
   use polydem_strings, only: to_text
   use polydem_timers, only: block_clock_t, stage_boxes, stage_decomposition, stage_forces, stage_integrate, &
      stage_neighbours, stage_overlap
   use polydem_wall_terms, only: select_walls
   implicit none
   private
   public :: advance, compute_forces, tabulate_contacts

contains

   !> Advance by one time step. Collective. An error of one rank reaches all ranks within the step, or at the latest in
   !> the all-reduce of errors after it.
   subroutine advance(self, error, tabulate)
      type(simulation_t), intent(inout) :: self
      !> Allocated if the run must stop; names the body, its position and the step
      type(error_t), allocatable, intent(inout) :: error
      !> Whether to keep the table of all contacts; default: yes
      logical, intent(in), optional :: tabulate
      type(block_clock_t) :: clock
      logical :: has_left

      call change_bodies(self, error)
      if (allocated(error)) return
      self%step = self%step + 1_lp
      call expire_balance(self%energy_balance)
      call begin_step(self, error)
      associate (timers => self%timers, domain => self%domain)
         call timers%start()
         if (domain%has_halo()) then
            call predict_border(self)
            call timers%lap(stage_integrate)
            call domain%send_border(self%comm, self%bodies)
            call timers%lap(stage_decomposition)
         end if
         call predict_bodies(self, has_left, clock, error)
         call timers%divide_lap(stage_integrate, stage_boxes, clock)
         if (domain%has_halo()) then
            call domain%halo%receive_halo(self%comm, self%bodies)
            call timers%lap(stage_decomposition)
         end if
         call bound_others(self, has_left, error)
         call timers%lap(stage_boxes)
         if (domain%has_zone()) then
            call redistribute(self, has_left, error)
            call domain%count_halo()
            call timers%lap(stage_decomposition)
         end if
         if (allocated(error)) return
         call find_pairs(self, error)
         call timers%lap(stage_neighbours)
         call loop_over_contacts(self, self%dt, needs_table(self, tabulate), clock, error)
         call timers%divide_lap(stage_overlap, stage_forces, clock)
         call check_contacts(self, error)
         call add_other_forces(self, error)
         call timers%lap(stage_forces)
         ! A contact may stop the run here. Then no rank completes the step.
         if (need_all_ranks(self)) call self%comm%all_reduce_error(error)
         if (allocated(error)) return
         call follow_forces(self, self%dt)
         call complete_step(self, error)
         call end_step(self)
         call timers%lap(stage_integrate)
      end associate
   end subroutine advance

   !> Update vertices and boxes of all but the free bodies, and all images.
   subroutine bound_others(self, has_left, error)
      type(simulation_t), intent(inout) :: self
      !> Becomes true if a box of a wall leaves its padded box, for which its images are chosen
      logical, intent(inout) :: has_left
      !> An error of the step, after which nothing is done
      type(error_t), allocatable, intent(in) :: error

      integer :: k

      if (allocated(error)) return
      call turn_and_bound(self%search%maker, self%moving(size(self%bodies%free) + 1:), self%bodies, self%search%boxes)
      if (.not. self%bodies%cell%is_periodic) return
      call place_images(self%search%maker%images, self%bodies%cell, self%search%boxes)
      if (.not. allocated(self%domain%reference)) return
      has_left = has_left .or. self%domain%is_off(self%bodies%cell)
      do k = 1, size(self%walls%wall)
         if (.not. self%walls%wall(k)%is_driven()) cycle
         has_left = has_left .or. .not. have_boxes_within( &
            self%search%maker, self%walls%wall(k)%slots, self%search%boxes, self%domain%rank_bounds%zone, &
            self%domain%reference)
      end do
   end subroutine bound_others

   !> Update the pairs of bodies whose boxes overlap, and move their contact history with them.
   subroutine find_pairs(self, error)
      type(simulation_t), intent(inout) :: self
      !> Names the step and the finder that failed
      type(error_t), allocatable, intent(inout) :: error

      call self%search%neighbours%update(self%search%boxes)
      if (self%search%neighbours%pairs%contradictions > 0_lp) then
         call raise(error, run_error, 'step '//to_text(self%step)//': finder '// &
                    self%settings%neighbours%finder//' reported changes that contradict its pair list. This is a '// &
                    'program error; use finder all_pairs instead')
         return
      end if
      call self%motion%flight%turn_joined(self%search%neighbours%pairs, self%bodies)
      call carry_history(self%search%neighbours%pairs, self%history)
      call restore_history(self%received_history, self%bodies, self%search%neighbours%pairs, self%history)
      associate (pairs => self%search%neighbours%pairs)
         self%sums(sum_began) = self%sums(sum_began) + int(pairs%n_began, lp)
         self%sums(sum_ended) = self%sums(sum_ended) + int(pairs%n_ended, lp)
      end associate
   end subroutine find_pairs

   !> Whether the loop over the contacts keeps the table of all contacts: for the caller, a constraint or a participant
   pure logical function needs_table(self, tabulate)
      type(simulation_t), intent(in) :: self
      !> Whether the caller needs it; absent: yes
      logical, intent(in), optional :: tabulate

      needs_table = .true.
      if (present(tabulate)) needs_table = tabulate .or. allocated(self%law%constraint) .or. need_table(self)
   end function needs_table

   !> Add forces on bodies that are no contacts, and the forces of a velocity constraint, if there are any.
   subroutine add_other_forces(self, error)
      type(simulation_t), intent(inout) :: self
      !> Names the step; on entry an error of the step, after which nothing is done
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      call self%body_forces%apply(self%forces%gravity, time_of(self), self%bodies, self%loop%force_sums)
      if (.not. allocated(self%law%constraint)) return
      call total_forces(self%forces%gravity, self%loop%force_sums, self%bodies)
      call self%law%constraint%apply(self%dt, self%loop%incidence, self%bodies, self%contacts, self%history, error)
      if (allocated(error)) error%message = 'step '//to_text(self%step)//': '//error%message
      call assemble_forces(self%forces%gravity, self%contacts, self%bodies, self%loop%force_sums)
      call self%body_forces%apply(self%forces%gravity, time_of(self), self%bodies, self%loop%force_sums)
      call select_walls(self%bodies, self%contacts, self%loop%walls)
   end subroutine add_other_forces

   !> Compute the forces on the bodies at time 0 from their boxes.
   subroutine compute_forces(self, error)
      !> The simulation with updated boxes
      type(simulation_t), intent(inout) :: self
      !> Names the contact or the finder that failed
      type(error_t), allocatable, intent(inout) :: error
      type(block_clock_t) :: clock

      call find_pairs(self, error)
      call loop_over_contacts(self, 0.0_wp, needs_table(self), clock, error)
      call check_contacts(self, error)
      call add_other_forces(self, error)
      if (allocated(error)) return
      call total_forces(self%forces%gravity, self%loop%force_sums, self%bodies)
   end subroutine compute_forces

   !> After a failure, make the table of contacts of this step, and the forces on fixed bodies. Collective. The table
   !> shows the contacts of the state at the stop, with the forces of a time step of length 0, whoever needed a table in
   !> this step. A velocity constraint keeps its own. The table is empty if the step failed before it found contacts.
   subroutine tabulate_contacts(self)
      type(simulation_t), intent(inout) :: self
      type(error_t), allocatable :: known_error
      type(block_clock_t) :: clock
      integer(lp) :: has_none(1)
      integer(ip) :: k

      ! The finder of one rank may have failed, after which the others found their contacts.
      has_none = merge(1_lp, 0_lp, self%loop%step /= self%step)
      call self%comm%all_reduce_max(has_none)
      if (has_none(1) == 1_lp) then
         self%contacts%n = 0_ip
         return
      end if
      if (self%settings%output%contacts .and. .not. allocated(self%law%constraint)) then
         ! The end of the step changed velocities, and poses with some integrators.
         if (self%domain%has_halo()) call self%domain%halo%follow(self%comm, self%bodies)
         call turn_bodies(self%bodies, [(k, k=1_ip, self%bodies%n)])
         call loop_over_contacts(self, 0.0_wp, needs_table(self), clock, known_error)
         call check_contacts(self, known_error)
         call add_other_forces(self, known_error)
      end if
      call total_forces(self%forces%gravity, self%loop%force_sums, self%bodies)
   end subroutine tabulate_contacts

   !> Apply the moves of the pair list to the columns of the contact history.
   subroutine carry_history(pairs, history)
      type(pair_list_t), intent(inout) :: pairs
      type(contact_history_t), intent(inout) :: history
      integer :: k

      call pairs%carry(history%features, 0_ip)
      if (.not. allocated(history%column)) return
      do k = 1, size(history%column)
         call pairs%carry(history%column(k)%value, 0.0_wp)
      end do
   end subroutine carry_history

end module polydem_time_step
