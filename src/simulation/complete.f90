!> The second pass of a step over the bodies: completion after the forces are computed.
!>
!> The pass does all that it can do for a block of bodies while the block is in the cache.
module polydem_complete
   use polydem_bodies, only: block_size, bodies_t
   use polydem_body_motion, only: body_motion_t
   use polydem_body_runs, only: find_run, number_of_parts
   use polydem_energy_balance, only: accumulate_bodies, accumulate_walls, count_step, energy_balance_t
   use polydem_errors, only: error_t
   use polydem_force_sums, only: find_forces, force_sums_t, set_force
   use polydem_guard, only: respond_to_motion
   use polydem_kinds, only: ip, wp
   use polydem_motion_tests, only: move_within_limit
   use polydem_simulation, only: simulation_t
   use polydem_thread_changes, only: part
   use polydem_loop_results, only: loop_results_t
   implicit none
   private
   public :: complete_step

contains

   !> Complete the step from the sums of the contact forces: total forces, final velocities, energy balance, and a
   !> test of the motion, in one pass over the bodies. Of the total forces, only those on fixed bodies are kept.
   subroutine complete_step(self, error)
      !> The simulation with the sums of the contact forces
      type(simulation_t), intent(inout) :: self
      !> Names a body that moves too far
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: n, low, high, k, done
      integer :: n_parts, p
      logical :: good

      n = size(self%bodies%free, kind=ip)
      n_parts = number_of_parts(n)
      good = .true.
      !$omp parallel do if (n_parts > 1) schedule(static, 1) default(none) shared(self, n, n_parts) &
      !$omp    private(p, low, high) reduction(.and.:good)
      do p = 1, n_parts
         call part(n, n_parts, p, low, high)
         call complete_part(self%dt, self%forces%gravity, low, high, self%motion, self%loop, self%bodies, &
                            self%energy_balance, good)
      end do
      !$omp end parallel do
      done = 0_ip
      if (n > 0_ip) done = self%bodies%free(n)
      call keep_fixed(done + 1_ip, self%bodies%n, self%loop%force_sums, self%bodies)
      if (allocated(self%energy_balance%power_sum)) call count_step(self%energy_balance)
      do k = n + 1_ip, self%n_moving
         good = good .and. move_within_limit(self%motion%limit, self%bodies, self%moving(k), self%moving(k), self%dt)
      end do
      if (.not. good) call respond_to_motion(self, error)
   end subroutine complete_step

   !> Complete the step of a part of the free bodies, block by block, and keep the forces on fixed bodies between them.
   subroutine complete_part(dt, gravity, low, high, motion, loop, bodies, balance, good)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> Index of the first and of the last body in the list of free bodies
      integer(ip), intent(in) :: low, high
      type(body_motion_t), intent(inout) :: motion
      !> Contacts of the step
      type(loop_results_t), intent(in) :: loop
      type(bodies_t), intent(inout) :: bodies
      !> Balance of energy; not started if the run computes none
      type(energy_balance_t), intent(inout) :: balance
      !> Becomes false if a body moves too far
      logical, intent(inout) :: good
      integer(ip) :: k, end_of_block, next, done, first, last, n_chosen, chosen(block_size)
      logical :: corrects_all

      if (high < low) return
      corrects_all = motion%flight%corrects_all()
      associate (sums => loop%force_sums)
         do k = low, high, block_size
            end_of_block = min(k + block_size - 1_ip, high)
            done = 0_ip
            if (k > 1_ip) done = bodies%free(k - 1_ip)
            next = k
            do while (next <= end_of_block)
               call find_run(bodies%free, end_of_block, next, first, last)
               call keep_fixed(done + 1_ip, first - 1_ip, sums, bodies)
               done = last
               if (corrects_all) call complete_run(dt, gravity, first, last, sums, motion, bodies, balance, good)
            end do
            if (corrects_all) cycle
            call motion%flight%list_accelerated(end_of_block - k + 1_ip, bodies%free(k:end_of_block), &
                                                sums%has_terms, n_chosen, chosen)
            next = 1_ip
            do while (next <= n_chosen)
               call find_run(chosen, n_chosen, next, first, last)
               call complete_run(dt, gravity, first, last, sums, motion, bodies, balance, good)
            end do
         end do
      end associate
      if (allocated(balance%power_sum)) &
         call accumulate_walls(balance, bodies, loop%walls, bodies%free(low), bodies%free(high))
   end subroutine complete_part

   !> Set the total forces on those bodies of a run that are fixed. The run has no free bodies of this rank. Its halo
   !> bodies keep former forces, which nothing reads, until `total_forces`.
   pure subroutine keep_fixed(first, last, sums, bodies)
      !> First and last slot
      integer(ip), intent(in) :: first, last
      !> Sums of the contact forces
      type(force_sums_t), intent(in) :: sums
      !> Bodies; `force` and `torque` of the fixed ones are set
      type(bodies_t), intent(inout) :: bodies
      integer(ip) :: s

      do s = first, last
         if (bodies%fixed(s)) call set_force(sums%value(:, s), s, bodies)
      end do
   end subroutine keep_fixed

   !> Compute final velocities of a run of free bodies, accumulate their energy balance, and check their motion.
   subroutine complete_run(dt, gravity, first, last, sums, motion, bodies, balance, good)
      !> Time step [s]
      real(wp), intent(in) :: dt
      !> Acceleration of gravity, (2) [m/s2]
      real(wp), intent(in) :: gravity(2)
      !> First and last slot, at most `block_size` bodies
      integer(ip), intent(in) :: first, last
      !> Sums of the contact forces
      type(force_sums_t), intent(in) :: sums
      type(body_motion_t), intent(inout) :: motion
      type(bodies_t), intent(inout) :: bodies
      !> Balance of energy; not started if the run computes none
      type(energy_balance_t), intent(inout) :: balance
      !> Becomes false if a body moves too far
      logical, intent(inout) :: good
      real(wp) :: force(3, block_size)

      call find_forces(gravity, first, last, bodies%mass, sums%value, sums%has_terms, force)
      call motion%integrator%correct(dt, first, last, force, bodies)
      if (allocated(balance%power_sum)) &
         call accumulate_bodies(balance, 1.0_wp, gravity, bodies, sums, first, last)
      good = good .and. move_within_limit(motion%limit, bodies, first, last, dt)
   end subroutine complete_run

end module polydem_complete
