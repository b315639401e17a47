!> Carries what changes about bodies from one process to another.
!>
!> It is an archive: first it takes the rows of some slots from all columns over /bodies, then it trades them, and then,
!> asked for the same columns in the same order, gives the rows that arrived to slots that may be others. What belongs
!> to the whole run stays where it is.
module polydem_mover
   use polydem_archive, only: archive_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_team, only: team_t
   implicit none
   private
   public :: mover_t

   !> One column: rows of 64-bit words
   type :: column_t
      !> The words, (width, row)
      integer(lp), allocatable :: word(:, :)
   end type column_t

   !> Rows of bodies under way
   type, extends(archive_t) :: mover_t
      !> Slots whose rows are taken, in the order of the processes they go to; then those to which rows are given, in
      !> the order of the processes they came from
      integer(ip), allocatable :: slots(:)
      !> All columns so far
      type(column_t), allocatable, private :: columns(:)
      !> The column that was given back last
      integer, private :: last = 0
   contains
      procedure :: move
      procedure :: exchange_reals
      procedure :: exchange_longs
   end type mover_t

   !> Columns of bodies begin like this
   character(len=*), parameter :: of_bodies = '/bodies/'

contains

   !> Trade the rows that were taken; from now on they are given back.
   subroutine move(self, team, counts)
      class(mover_t), intent(inout) :: self
      !> Processes, all of which call this
      class(team_t), intent(inout) :: team
      !> Rows for each process, (0:size - 1)
      integer(ip), intent(in) :: counts(0:)
      integer(lp), allocatable :: sent(:, :), received(:, :)
      integer(ip), allocatable :: counts_received(:)
      integer :: k, first, width(size(self%columns))

      do k = 1, size(self%columns)
         width(k) = size(self%columns(k)%word, 1)
      end do
      allocate (sent(sum(width), size(self%slots)))
      first = 1
      do k = 1, size(self%columns)
         sent(first:first + width(k) - 1, :) = self%columns(k)%word
         first = first + width(k)
      end do
      call team%trade(sent, counts, received, counts_received)
      first = 1
      do k = 1, size(self%columns)
         self%columns(k)%word = received(first:first + width(k) - 1, :)
         first = first + width(k)
      end do
      self%gives_back = .true.
      self%last = 0
   end subroutine move

   !> Take a column of real numbers, or give it back.
   subroutine exchange_reals(self, name, width, values, unit, meaning)
      class(mover_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width
      real(dp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: words(:)

      if (index(name, of_bodies) /= 1) return
      words = transfer(values, [0_lp], size(values))
      call exchange_words(self, width, words)
      if (self%gives_back) values = transfer(words, values, size(values))
      associate (unused => unit//meaning)
      end associate
   end subroutine exchange_reals

   !> Take a column of whole numbers, or give it back.
   subroutine exchange_longs(self, name, values, unit, meaning)
      class(mover_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      if (index(name, of_bodies) /= 1) return
      call exchange_words(self, 1, values)
      associate (unused => unit//meaning)
      end associate
   end subroutine exchange_longs

   !> Take the rows of the slots, or give the next column to them.
   subroutine exchange_words(self, width, words)
      class(mover_t), intent(inout) :: self
      integer, intent(in) :: width
      !> All rows, one after the other
      integer(lp), intent(inout) :: words(:)
      type(column_t) :: column
      integer(ip) :: k, first

      if (self%gives_back) then
         self%last = self%last + 1
         do k = 1_ip, size(self%slots, kind=ip)
            first = (self%slots(k) - 1_ip)*int(width, ip)
            words(first + 1_ip:first + int(width, ip)) = self%columns(self%last)%word(:, k)
         end do
      else
         if (.not. allocated(self%columns)) allocate (self%columns(0))
         allocate (column%word(width, size(self%slots)))
         do k = 1_ip, size(self%slots, kind=ip)
            first = (self%slots(k) - 1_ip)*int(width, ip)
            column%word(:, k) = words(first + 1_ip:first + int(width, ip))
         end do
         self%columns = [self%columns, column]
      end if
   end subroutine exchange_words

end module polydem_mover
