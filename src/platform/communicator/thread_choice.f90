!> Number of OpenMP threads of a run that neither --threads nor OMP_NUM_THREADS gives.
!>
!> A small scene has one thread, a larger one the processors that are granted to its ranks and idle. Results have the
!> same bits for any number.
module polydem_thread_choice
   use polydem_communicator, only: communicator_t
   use polydem_host, only: cores_online
   use polydem_kinds, only: ip, lp
   use polydem_oversubscription, only: ranks_on_machine
   use polydem_process_limits, only: mask_words
   use polydem_processors, only: granted_processors, running_tasks
   use polydem_strings, only: counted, to_text
   implicit none
   private
   public :: thread_choice_t, choose_threads, machine_t, threads_for

   !> Free bodies per rank from which on more than one thread is worthwhile
   integer(lp), parameter :: min_bodies = 1000_lp

   !> How the number of threads is determined
   type :: thread_choice_t
      !> Whether it is chosen when the scene is built; otherwise it is set already
      logical :: is_open = .false.
      !> Why it is what it is, for the log; unallocated or empty if there is nothing to say
      character(len=:), allocatable :: reason
   end type thread_choice_t

   !> A machine that a run shares with other programs
   type :: machine_t
      !> Processors that are online, and those that the ranks may use
      integer(ip) :: online = 1_ip, granted = 1_ip
      !> Ranks of the run on the machine
      integer(ip) :: ranks = 1_ip
      !> Tasks that run or wait for a processor; those of the run, at least one per rank, are among them
      integer(ip) :: tasks = 0_ip
   end type machine_t

contains

   !> Choose the number of threads of each rank, the same on all, and give the reason. Collective.
   subroutine choose_threads(comm, free, threads, reason)
      class(communicator_t), intent(inout) :: comm
      !> Number of free bodies of this rank
      integer(ip), intent(in) :: free
      !> Number of threads
      integer(ip), intent(out) :: threads
      !> Reason, for the log; the same on all ranks but for the load of their machines
      character(len=:), allocatable, intent(out) :: reason
      type(machine_t) :: machine
      integer(lp) :: bodies(1), least(1), mask(mask_words)

      bodies = int(free, lp)
      call comm%all_reduce_sum(bodies)
      bodies = bodies/int(comm%size, lp)
      if (bodies(1) >= min_bodies) then
         call ranks_on_machine(comm, machine%ranks, mask)
         machine%online = cores_online()
         machine%granted = granted_processors(mask)
         machine%tasks = running_tasks()
      end if
      call threads_for(bodies(1), machine, threads, reason)
      least = -int(threads, lp)
      call comm%all_reduce_max(least)
      threads = -int(least(1), ip)
   end subroutine choose_threads

   !> Number of threads for some free bodies per rank on a machine, and the reason.
   pure subroutine threads_for(bodies, machine, threads, reason)
      !> Number of free bodies per rank
      integer(lp), intent(in) :: bodies
      !> The machine; not used for few bodies
      type(machine_t), intent(in) :: machine
      !> Number of threads
      integer(ip), intent(out) :: threads
      !> Reason, for the log
      character(len=:), allocatable, intent(out) :: reason
      integer(ip) :: others

      if (bodies < min_bodies) then
         threads = 1_ip
         reason = 'chosen for fewer than '//to_text(min_bodies)//' free bodies per rank'
         return
      end if
      others = max(0_ip, machine%tasks - machine%ranks)
      threads = max(1_ip, min(machine%granted, machine%online - others)/machine%ranks)
      reason = 'chosen for '//counted(int(machine%granted, lp), 'granted processor')//' and '// &
         counted(int(others, lp), 'other running task')
   end subroutine threads_for

end module polydem_thread_choice
