!> Oversubscription: more threads than processors on a machine.
module polydem_oversubscription
   use omp_lib, only: omp_get_max_threads, omp_get_num_procs
   use polydem_communicator, only: communicator_t
   use polydem_hash, only: mix_word
   use polydem_host, only: host_name
   use polydem_kinds, only: ip, lp
   use polydem_process_limits, only: allowed_processors, mask_words
   use polydem_strings, only: to_text
   implicit none
   private
   public :: oversubscription, oversubscription_text, ranks_on_machine

   !> Rows of the data of a rank: hash of the machine name, number of threads, number of processors; then the mask of
   !> processors
   integer, parameter :: machine_row = 1, threads_row = 2, processors_row = 3, n_rows = 3 + mask_words

contains

   !> A warning if the ranks on any machine have more threads than processors that they may use; else an empty text.
   !> Collective.
   function oversubscription(comm) result(text)
      class(communicator_t), intent(inout) :: comm
      character(len=:), allocatable :: text
      integer(lp), allocatable :: all_of_them(:), facts(:, :)
      integer(ip), allocatable :: counts(:)
      integer(lp) :: mask(mask_words)
      integer :: i, k, n, processors, threads

      call comm%gather_longs([hash_of(host_name()), int(omp_get_max_threads(), lp), int(omp_get_num_procs(), lp), &
                              allowed_processors()], all_of_them, counts)
      n = size(counts)
      facts = reshape(all_of_them, [n_rows, n])
      text = ''
      do k = 1, n
         threads = 0
         processors = 0
         mask = 0_lp
         do i = 1, n
            if (facts(machine_row, i) /= facts(machine_row, k)) cycle
            threads = threads + int(facts(threads_row, i))
            processors = max(processors, int(facts(processors_row, i)))
            mask = ior(mask, facts(processors_row + 1:, i))
         end do
         ! A bound thread may use only one processor, but its process may use more.
         text = oversubscription_text(int(threads, ip), int(max(processors, sum(popcnt(mask))), ip))
         if (text /= '') return
      end do
   end function oversubscription

   !> Count the ranks on the machine of this rank, and find the processors that they may use. Collective.
   subroutine ranks_on_machine(comm, ranks, mask)
      class(communicator_t), intent(inout) :: comm
      !> Number of ranks
      integer(ip), intent(out) :: ranks
      !> Processors that any of these ranks may use, one bit each
      integer(lp), intent(out) :: mask(mask_words)
      integer(lp), allocatable :: all_of_them(:), facts(:, :)
      integer(ip), allocatable :: counts(:)
      integer(lp) :: own
      integer :: k

      own = hash_of(host_name())
      call comm%gather_longs([own, allowed_processors()], all_of_them, counts)
      facts = reshape(all_of_them, [1 + mask_words, size(counts)])
      ranks = int(count(facts(1, :) == own), ip)
      mask = 0_lp
      do k = 1, size(counts)
         if (facts(1, k) == own) mask = ior(mask, facts(2:, k))
      end do
   end subroutine ranks_on_machine

   !> A warning if there are more threads than processors; else an empty text
   pure function oversubscription_text(threads, processors) result(text)
      !> Numbers of threads and processors
      integer(ip), intent(in) :: threads, processors
      character(len=:), allocatable :: text

      text = ''
      if (threads > processors) text = 'warning: more threads than processors ('//to_text(threads)//' on '// &
                                       to_text(processors)//'): they take turns, which is slow'
   end function oversubscription_text

   !> Hash of a text
   pure integer(lp) function hash_of(name)
      character(len=*), intent(in) :: name
      integer :: k

      hash_of = int(len(name), lp)
      do k = 1, len(name)
         hash_of = mix_word(hash_of, int(iachar(name(k:k)), lp))
      end do
   end function hash_of

end module polydem_oversubscription
