!> Processes that work together, and what they can tell each other.
!>
!> There are two implementations: `lone_team_t`, a process on its own, which needs nothing, and `mpi_team_t`, in builds
!> with MPI. Whoever has something to tell writes it once; to a lone process it tells nothing and costs nothing.
!>
!> All procedures but `pass`, `take_over` and `hand_on` are collective: every process of the team must call them, in the
!> same order. What is added up are whole numbers, so that sums do not depend on who adds what.
module polydem_team
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip, lp, wp
   implicit none
   private
   public :: team_t, route_t

   !> To whom rows go in every step, and from whom they come, as long as neighbours stay the same
   type :: route_t
      !> Ranks, ascending
      integer(ip), allocatable :: rank(:)
      !> First row for each rank, one more than the last for the last, (ranks + 1)
      integer(ip), allocatable :: sent(:)
      !> First row from each rank, (ranks + 1)
      integer(ip), allocatable :: received(:)
   end type route_t

   !> The processes of a run
   type, abstract :: team_t
      !> Number of this process, from 0; 0 leads
      integer(ip) :: rank = 0_ip
      !> Number of processes
      integer(ip) :: size = 1_ip
      !> Messages that this process sent by `pass` and `trade` so far
      integer(lp) :: messages = 0_lp
      !> Their bytes
      integer(lp) :: bytes = 0_lp
   contains
      !> Replace numbers by their greatest over all processes, element by element
      generic :: maximise => maximise_longs, maximise_doubles
      !> Replace numbers by their sums over all processes, element by element
      procedure(combine_longs), deferred :: add_up
      procedure(combine_longs), deferred :: maximise_longs
      procedure(combine_doubles), deferred :: maximise_doubles
      !> Give all processes what the leader has
      generic :: share => share_longs, share_doubles, share_text
      procedure(combine_longs), deferred :: share_longs
      procedure :: share_doubles
      procedure :: share_text
      !> Give all processes the lists of all, one after the other
      generic :: gather => gather_longs, gather_doubles
      procedure(gather_longs), deferred :: gather_longs
      procedure :: gather_doubles
      !> Give rows to other processes, and get theirs
      generic :: trade => trade_longs, trade_reals
      procedure(trade_longs), deferred :: trade_longs
      procedure :: trade_reals
      procedure(pass), deferred :: pass
      procedure(relay), deferred :: take_over
      procedure(relay), deferred :: hand_on
      procedure(leave), deferred :: leave
      procedure :: leads
      procedure :: agree
      procedure :: spread_text
   end type team_t

   abstract interface
      !> Combine lists of the same length, element by element.
      subroutine combine_longs(self, values)
         import :: lp, team_t
         class(team_t), intent(inout) :: self
         !> Numbers of this process; afterwards the same on all
         integer(lp), intent(inout), contiguous :: values(:)
      end subroutine combine_longs

      !> Combine lists of the same length, element by element.
      subroutine combine_doubles(self, values)
         import :: dp, team_t
         class(team_t), intent(inout) :: self
         !> Numbers of this process; afterwards the same on all
         real(dp), intent(inout), contiguous :: values(:)
      end subroutine combine_doubles

      !> Give all processes the lists of all, in the order of ranks.
      subroutine gather_longs(self, mine, all_of_them, counts)
         import :: ip, lp, team_t
         class(team_t), intent(inout) :: self
         !> List of this process, of any length
         integer(lp), intent(in), contiguous :: mine(:)
         !> All lists, one after the other
         integer(lp), allocatable, intent(out) :: all_of_them(:)
         !> Their lengths, (0:size - 1)
         integer(ip), allocatable, intent(out) :: counts(:)
      end subroutine gather_longs

      !> Give rows to other processes, and get theirs.
      subroutine trade_longs(self, rows, counts, received, counts_received)
         import :: ip, lp, team_t
         class(team_t), intent(inout) :: self
         !> Rows in the order of the ranks they go to, (width, row)
         integer(lp), intent(in), contiguous :: rows(:, :)
         !> Rows for each rank, this one included, (0:size - 1)
         integer(ip), intent(in) :: counts(0:)
         !> Rows from all, in the order of the ranks they come from, (width, row)
         integer(lp), allocatable, intent(out) :: received(:, :)
         !> Rows from each rank, (0:size - 1)
         integer(ip), allocatable, intent(out) :: counts_received(:)
      end subroutine trade_longs

      !> Pass rows along a route that both sides know; only those on the route take part.
      subroutine pass(self, route, sent, received)
         import :: route_t, team_t, wp
         class(team_t), intent(inout) :: self
         !> Whom to send to and to receive from
         type(route_t), intent(in) :: route
         !> Rows in the order of the route, (width, row)
         real(wp), intent(in), contiguous, target :: sent(:, :)
         !> Room for the rows from the others, (width, row)
         real(wp), intent(inout), contiguous, target :: received(:, :)
      end subroutine pass

      !> Take numbers over from the rank below, or hand them on to that above; where there is none, nothing happens.
      subroutine relay(self, values)
         import :: lp, team_t
         class(team_t), intent(inout) :: self
         !> The numbers
         integer(lp), intent(inout), contiguous :: values(:)
      end subroutine relay

      !> Say good-bye at the end of the program. After that nothing can be told.
      subroutine leave(self)
         import :: team_t
         class(team_t), intent(inout) :: self
      end subroutine leave
   end interface

contains

   !> Whether this process leads: it speaks with the user, and keeps the result folder.
   pure logical function leads(self)
      class(team_t), intent(in) :: self

      leads = self%rank == 0_ip
   end function leads

   !> Let all processes know of a failure of any: all have the error of the least place, and of those that of the lowest
   !> rank. Flags are made the greatest over all along the way.
   subroutine agree(self, error, flags)
      class(team_t), intent(inout) :: self
      !> Failure of this process; afterwards the same on all
      type(error_t), allocatable, intent(inout) :: error
      !> Numbers of which all get the greatest
      integer(lp), intent(inout), optional :: flags(:)
      integer(lp), allocatable :: values(:)
      character(len=:), allocatable :: text
      logical :: speaks

      if (self%size == 1_ip) return
      allocate (values(1))
      values(1) = merge(1_lp, 0_lp, allocated(error))
      if (present(flags)) values = [values, flags]
      call self%maximise(values)
      if (present(flags)) flags = values(2:)
      if (values(1) == 0_lp) return
      values = [-huge(0_lp)]
      if (allocated(error)) values(1) = -error%place
      call self%maximise(values)
      speaks = allocated(error)
      if (speaks) speaks = -error%place == values(1)
      values = [0_lp]
      if (speaks) then
         values(1) = int(error%code, lp)
         text = error%message
      end if
      call self%spread_text(text)
      if (.not. allocated(error)) allocate (error)
      if (speaks) then
         if (error%message /= text) values(1) = 0_lp
      end if
      call self%maximise(values)
      error%code = int(values(1))
      error%message = text
   end subroutine agree

   !> Give all processes the text of the greatest weight, if any has one, and of those that of the lowest rank.
   !> Collective.
   subroutine spread_text(self, text, weight)
      class(team_t), intent(inout) :: self
      !> The text; unallocated: none
      character(len=:), allocatable, intent(inout) :: text
      !> Its weight, greater than the least number there is; all texts weigh the same if absent
      real(dp), intent(in), optional :: weight
      integer(lp) :: first(2)
      real(dp) :: weights(1)
      integer(lp), allocatable :: codes(:)

      if (self%size == 1_ip) return
      if (present(weight)) then
         weights = -huge(0.0_dp)
         if (allocated(text)) weights = weight
         call self%maximise(weights)
         if (weights(1) <= -huge(0.0_dp)) return
         if (allocated(text) .and. weight < weights(1)) deallocate (text)
      end if
      first = 0_lp
      if (allocated(text)) first(1) = int(self%size - self%rank, lp)
      call self%maximise(first(:1))
      if (first(1) == 0_lp) return
      if (int(self%size - self%rank, lp) == first(1)) first(2) = len(text, lp)
      if (int(self%size - self%rank, lp) /= first(1)) text = ''
      call self%maximise(first(2:))
      allocate (codes(first(2)))
      codes = 0_lp
      if (len(text) > 0) codes = codes_of(text)
      call self%maximise(codes)
      text = text_of(codes)
   end subroutine spread_text

   !> Give all processes the text of the leader.
   subroutine share_text(self, text)
      class(team_t), intent(inout) :: self
      !> The text
      character(len=:), allocatable, intent(inout) :: text
      integer(lp) :: length(1)
      integer(lp), allocatable :: codes(:)

      if (self%size == 1_ip) return
      length = len(text, lp)
      call self%share(length)
      if (self%leads()) then
         codes = codes_of(text)
      else
         allocate (codes(length(1)))
         codes = 0_lp
      end if
      call self%share(codes)
      text = text_of(codes)
   end subroutine share_text

   !> Give all processes the numbers of the leader.
   subroutine share_doubles(self, values)
      class(team_t), intent(inout) :: self
      !> The numbers
      real(dp), intent(inout), contiguous :: values(:)
      integer(lp), allocatable :: words(:)

      if (self%size == 1_ip) return
      words = transfer(values, [0_lp])
      call self%share(words)
      values = transfer(words, values)
   end subroutine share_doubles

   !> Give all processes the lists of all, in the order of ranks.
   subroutine gather_doubles(self, mine, all_of_them, counts)
      class(team_t), intent(inout) :: self
      !> List of this process, of any length
      real(dp), intent(in), contiguous :: mine(:)
      !> All lists, one after the other
      real(dp), allocatable, intent(out) :: all_of_them(:)
      !> Their lengths, (0:size - 1)
      integer(ip), allocatable, intent(out) :: counts(:)
      integer(lp), allocatable :: words(:)

      call self%gather(transfer(mine, [0_lp], size(mine)), words, counts)
      allocate (all_of_them(size(words)))
      all_of_them = transfer(words, all_of_them, size(words))
   end subroutine gather_doubles

   !> Give rows to other processes, and get theirs.
   subroutine trade_reals(self, rows, counts, received, counts_received)
      class(team_t), intent(inout) :: self
      !> Rows in the order of the ranks they go to, (width, row)
      real(wp), intent(in), contiguous :: rows(:, :)
      !> Rows for each rank, this one included, (0:size - 1)
      integer(ip), intent(in) :: counts(0:)
      !> Rows from all, in the order of the ranks they come from, (width, row)
      real(wp), allocatable, intent(out) :: received(:, :)
      !> Rows from each rank, (0:size - 1)
      integer(ip), allocatable, intent(out) :: counts_received(:)
      integer(lp), allocatable :: words(:, :), words_received(:, :)
      integer :: k, width

      width = (size(rows, 1)*storage_size(rows) + storage_size(0_lp) - 1)/storage_size(0_lp)
      allocate (words(width, size(rows, 2)))
      do k = 1, size(rows, 2)
         words(:, k) = transfer(rows(:, k), 0_lp, width)
      end do
      call self%trade(words, counts, words_received, counts_received)
      allocate (received(size(rows, 1), size(words_received, 2)))
      do k = 1, size(received, 2)
         received(:, k) = transfer(words_received(:, k), received, size(received, 1))
      end do
   end subroutine trade_reals

   pure function codes_of(text) result(codes)
      character(len=*), intent(in) :: text
      integer(lp) :: codes(len(text))
      integer :: k

      do k = 1, len(text)
         codes(k) = int(iachar(text(k:k)), lp)
      end do
   end function codes_of

   pure function text_of(codes) result(text)
      integer(lp), intent(in) :: codes(:)
      character(len=size(codes)) :: text
      integer :: k

      do k = 1, size(codes)
         text(k:k) = achar(int(codes(k)))
      end do
   end function text_of

end module polydem_team
