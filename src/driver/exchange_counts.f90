!> What processes told each other so far, in exact counts: how bodies, ghosts and messages are spread over them, and
!> what a step needs apart from what is told when bodies are handed out anew.
module polydem_exchange_counts
   use polydem_counters, only: counters_t
   use polydem_kinds, only: ip, lp
   use polydem_simulation_parts, only: simulation_t
   implicit none
   private
   public :: report_exchange

contains

   !> Set the counters of a run of several processes. "Most of a process" is that of the process that has most of just
   !> this; bodies and pairs are those of now, everything else is summed over steps. Collective.
   subroutine report_exchange(self, counters)
      !> The simulation
      type(simulation_t), intent(inout) :: self
      !> List to set them in
      type(counters_t), intent(inout) :: counters
      integer(lp) :: sums(9), most(5)

      if (self%team%size == 1_ip) return
      associate (domain => self%domain)
         sums = [self%team%messages, self%team%bytes, domain%ghost_steps, domain%arrivals, domain%first_arrivals, &
                 domain%step_messages, domain%step_bytes, domain%first_messages, domain%first_bytes]
         most = [size(self%bodies%free, kind=lp), int(self%neighbours%pairs%n, lp), domain%ghost_steps, &
                 domain%step_messages, domain%step_bytes]
         call self%team%add_up(sums)
         call self%team%maximise(most)
         call counters%set('processes', int(self%team%size, lp))
         call counters%set('settlements', domain%settlements)
         call counters%set('divisions of space', domain%divisions)
         call counters%set('rectangles', int(domain%regions%n_rectangles(), lp))
      end associate
      call counters%set('migrations', sums(4))
      call counters%set('migrations at the start', sums(5))
      call counters%set('ghosts, summed over steps', sums(3))
      call counters%set('messages', sums(1))
      call counters%set('bytes in messages', sums(2))
      call counters%set('messages at the start', sums(8))
      call counters%set('bytes at the start', sums(9))
      call counters%set('messages to ghosts', sums(6))
      call counters%set('bytes to ghosts', sums(7))
      call counters%set('most of a process: bodies', most(1))
      call counters%set('most of a process: pairs', most(2))
      call counters%set('most of a process: ghosts', most(3))
      call counters%set('most of a process: messages', most(4))
      call counters%set('most of a process: bytes', most(5))
   end subroutine report_exchange

end module polydem_exchange_counts
