!> Exact counters of a simulation, summed over all ranks.
module polydem_simulation_counters
   use polydem_communicator, only: communicator_t
   use polydem_communication_counters, only: report_communication
   use polydem_counters, only: counters_t, over_steps
   use polydem_kinds, only: ip, lp
   use polydem_simulation, only: simulation_t, sum_contacts, sum_began, sum_ended, sum_degenerate
   use polydem_wall_record, only: collect_record
   implicit none
   private
   public :: collect_counts, report_counters, count_contacts

contains

   !> Add up the counts of all ranks and the record of walls on the root rank, and reset them to zero on the other
   !> ranks. Collective.
   subroutine collect_counts(self)
      type(simulation_t), intent(inout) :: self
      integer(lp), allocatable :: counts(:)

      if (self%comm%size == 1_ip) return
      call collect_record(self%walls, self%comm)
      associate (value => self%search%neighbours%finder%work%value, n => size(self%sums))
         counts = [self%sums, value]
         call self%comm%all_reduce_sum(counts)
         if (.not. self%comm%is_root()) counts = 0_lp
         self%sums = counts(:n)
         value = counts(n + 1:)
      end associate
   end subroutine collect_counts

   !> Set the counters of the run so far. Pairs that began or ended and the finder statistics are summed over all ranks
   !> that have the pair or ran the finder. All other items are counted once. Collective.
   subroutine report_counters(self, counters)
      type(simulation_t), intent(inout) :: self
      type(counters_t), intent(inout) :: counters
      integer(lp) :: counts(2)

      counts = [int(self%search%boxes%n, lp), int(self%search%neighbours%pairs%n, lp)]
      call self%comm%all_reduce_sum(counts)
      call collect_counts(self)
      call counters%set('steps', self%step)
      call counters%set('bodies', int(self%bodies%n_all, lp))
      if (allocated(self%sources_and_sinks)) then
         call counters%set('bodies entered', sum(self%sources_and_sinks%sources%entered), over_steps)
         call counters%set('bodies departed', sum(self%sources_and_sinks%sinks%departed), over_steps)
         call counters%set('entries without room', sum(self%sources_and_sinks%sources%blocked), over_steps)
      end if
      call counters%set('boxes', counts(1))
      call counters%set('pairs began', self%sums(sum_began), over_steps)
      call counters%set('pairs ended', self%sums(sum_ended), over_steps)
      call counters%set('contacts', self%sums(sum_contacts), over_steps)
      call counters%set('contacts without direction', self%sums(sum_degenerate), over_steps)
      call self%search%neighbours%report(counters)
      call counters%set('pairs', counts(2))
      if (allocated(self%law%constraint)) call self%law%constraint%report(counters)
      call report_communication(self%comm, self%domain, size(self%bodies%free, kind=lp), &
                           int(self%search%neighbours%pairs%n, lp), counters)
   end subroutine report_counters

   !> Count the contacts of all ranks. Collective.
   subroutine count_contacts(comm, own, n)
      class(communicator_t), intent(inout) :: comm
      !> Number of contacts that this rank owns
      integer(ip), intent(in) :: own
      !> Number of contacts
      integer(ip), intent(out) :: n
      integer(lp) :: counts(1)

      counts = int(own, lp)
      call comm%all_reduce_sum(counts)
      n = int(counts(1), ip)
   end subroutine count_contacts

end module polydem_simulation_counters
