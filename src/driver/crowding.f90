!> Whether threads must take turns, because there are more of them than processors.
module polydem_crowding
   use omp_lib, only: omp_get_max_threads, omp_get_num_procs
   use polydem_hash, only: mix_word
   use polydem_kinds, only: ip, lp
   use polydem_machine, only: host_name
   use polydem_process_limits, only: allowed_processors, mask_words
   use polydem_strings, only: to_text
   use polydem_team, only: team_t
   implicit none
   private
   public :: crowding, crowding_text

   !> What a process tells others of itself: machine, threads, processors, and which they are
   integer, parameter :: machine_row = 1, threads_row = 2, processors_row = 3, n_rows = 3 + mask_words

contains

   !> A warning if on any machine the processes have more threads than they may use processors, else an empty text.
   !> Collective.
   function crowding(team) result(text)
      !> All processes
      class(team_t), intent(inout) :: team
      character(len=:), allocatable :: text
      integer(lp), allocatable :: all_of_them(:), facts(:, :)
      integer(ip), allocatable :: counts(:)
      integer(lp) :: mask(mask_words)
      integer :: i, k, n, processors, threads

      call team%gather_longs([hash_of(host_name()), int(omp_get_max_threads(), lp), int(omp_get_num_procs(), lp), &
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
         ! A thread that is bound may use one processor only, but its process more.
         text = crowding_text(int(threads, ip), int(max(processors, sum(popcnt(mask))), ip))
         if (text /= '') return
      end do
   end function crowding

   !> A warning if there are more threads than processors, else an empty text
   pure function crowding_text(threads, processors) result(text)
      !> Numbers of threads and processors
      integer(ip), intent(in) :: threads, processors
      character(len=:), allocatable :: text

      text = ''
      if (threads > processors) text = 'warning: more threads than processors ('//to_text(threads)//' on '// &
                                       to_text(processors)//'): they take turns, which is slow'
   end function crowding_text

   pure integer(lp) function hash_of(name)
      character(len=*), intent(in) :: name
      integer :: k

      hash_of = int(len(name), lp)
      do k = 1, len(name)
         hash_of = mix_word(hash_of, int(iachar(name(k:k)), lp))
      end do
   end function hash_of

end module polydem_crowding
