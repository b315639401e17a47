!> Exact counts of the communication of a run: the distribution of bodies, halo bodies and messages over the ranks. The
!> halo exchange of every step is counted separately from redistributions.
module polydem_communication_counters
   use polydem_communicator, only: communicator_t
   use polydem_counters, only: at_start, counters_t, over_steps
   use polydem_domain, only: domain_t
   use polydem_kinds, only: ip, lp
   implicit none
   private
   public :: report_communication

contains

   !> Set the counters of a run on several ranks. A counter "maximum per rank" is the maximum over the ranks,
   !> separately for each quantity. Bodies and pairs are present numbers; all other counts are sums over steps.
   !> Collective.
   subroutine report_communication(comm, domain, n_free, n_pairs, counters)
      class(communicator_t), intent(inout) :: comm
      type(domain_t), intent(in) :: domain
      !> Number of free bodies and of pairs of this rank
      integer(lp), intent(in) :: n_free, n_pairs
      type(counters_t), intent(inout) :: counters
      integer(lp) :: sums(9), most(5)

      if (comm%size == 1_ip) return
      sums = [comm%messages, comm%bytes, domain%halo_steps, domain%arrivals, domain%first_migrations, &
              domain%step_messages, domain%step_bytes, domain%first_messages, domain%first_bytes]
      most = [n_free, n_pairs, domain%halo_steps, domain%step_messages, domain%step_bytes]
      call comm%all_reduce_sum(sums)
      call comm%all_reduce_max(most)
      call counters%set('ranks', int(comm%size, lp))
      call counters%set('redistributions', domain%redistributions, over_steps)
      call counters%set('partitions of space', domain%divisions, over_steps)
      call counters%set('rectangles', int(domain%rank_bounds%n_rectangles(), lp))
      call counters%set('migrations', sums(4), over_steps)
      call counters%set('migrations at the start', sums(5), at_start)
      call counters%set('halo bodies, summed over steps', sums(3), over_steps)
      call counters%set('messages', sums(1), over_steps)
      call counters%set('bytes in messages', sums(2), over_steps)
      call counters%set('messages at the start', sums(8), at_start)
      call counters%set('bytes at the start', sums(9), at_start)
      call counters%set('halo messages', sums(6), over_steps)
      call counters%set('halo bytes', sums(7), over_steps)
      call counters%set('maximum per rank: bodies', most(1))
      call counters%set('maximum per rank: pairs', most(2))
      call counters%set('maximum per rank: halo bodies', most(3), over_steps)
      call counters%set('maximum per rank: messages', most(4), over_steps)
      call counters%set('maximum per rank: bytes', most(5), over_steps)
   end subroutine report_communication

end module polydem_communication_counters
