!> Archives: where the state of a run is saved, and from where it is given back.
!>
!> Whoever has a state goes through its columns once, with `keep` for what changes and `match` for what must be the
!> same in the run that saves and in the one that goes on. Whether values are taken or given back is the archive's
!> business, so that saving and giving back cannot disagree about what there is.
!>
!> Names are /group/column. The group says over what a column runs: /run is one value or list for the whole run;
!> /bodies, /boxes and /pairs have one row for each of these, in ascending order of identifiers, never of slots. So an
!> archive that is shared by several processes knows from the name how to gather rows and hand them out again.
!>
!> Every bit is kept, in any working precision. What is given back may come from anywhere, so whole numbers that are
!> kept must be small enough to be counted on. The first failure stays in `error`; after it nothing happens.
module polydem_archive
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_strings, only: to_text
   implicit none
   private
   public :: archive_t

   !> Greatest whole number that is given back
   integer(lp), parameter :: most_count = 2_lp**62

   !> A place for columns
   type, abstract :: archive_t
      !> Whether values are given back; else they are taken
      logical :: gives_back = .false.
      !> The first failure
      type(error_t), allocatable :: error
   contains
      !> Take a column or give it back: keep(name, values, unit, meaning)
      generic :: keep => keep_reals, keep_real, keep_table, keep_block, keep_longs, keep_long, keep_integers
      !> Take a column, or insist that it is as it was: match(name, values, unit, meaning)
      generic :: match => match_longs, match_real
      procedure :: keep_seconds
      !> Take real numbers or give them back
      procedure(exchange_reals), deferred :: exchange_reals
      !> Take whole numbers or give them back
      procedure(exchange_longs), deferred :: exchange_longs
      procedure, private :: keep_reals, keep_real, keep_table, keep_block, keep_longs, keep_long, keep_integers
      procedure, private :: match_longs, match_real
   end type archive_t

   abstract interface
      !> Take real numbers or give them back; a failure goes to `error`.
      subroutine exchange_reals(self, name, width, values, unit, meaning)
         import :: archive_t, dp
         class(archive_t), intent(inout) :: self
         !> Name of the column
         character(len=*), intent(in) :: name
         !> Numbers in a row
         integer, intent(in) :: width
         !> The numbers, row after row
         real(dp), intent(inout), contiguous :: values(:)
         !> Unit and meaning, for those who read the archive
         character(len=*), intent(in) :: unit, meaning
      end subroutine exchange_reals

      !> Take whole numbers or give them back; a failure goes to `error`.
      subroutine exchange_longs(self, name, values, unit, meaning)
         import :: archive_t, lp
         class(archive_t), intent(inout) :: self
         !> Name of the column
         character(len=*), intent(in) :: name
         !> The numbers, in as many equal rows as the group of the column has
         integer(lp), intent(inout), contiguous :: values(:)
         !> Unit and meaning, for those who read the archive
         character(len=*), intent(in) :: unit, meaning
      end subroutine exchange_longs
   end interface

contains

   !> Take real numbers or give them back; the other forms of `keep` differ in kind and shape only.
   subroutine keep_reals(self, name, values, unit, meaning)
      class(archive_t), intent(inout) :: self
      !> Name of the column
      character(len=*), intent(in) :: name
      !> Its values; their number is that of the run that saved them
      real(wp), intent(inout), contiguous :: values(:)
      !> Unit and meaning, for those who read the archive
      character(len=*), intent(in) :: unit, meaning

      call keep_flat(self, name, 1, size(values), values, unit, meaning)
   end subroutine keep_reals

   subroutine keep_real(self, name, values, unit, meaning)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values
      character(len=*), intent(in) :: unit, meaning
      real(wp) :: list(1)

      list = values
      call keep_flat(self, name, 1, 1, list, unit, meaning)
      values = list(1)
   end subroutine keep_real

   subroutine keep_table(self, name, values, unit, meaning)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout), contiguous :: values(:, :)
      character(len=*), intent(in) :: unit, meaning

      call keep_flat(self, name, size(values, 1), size(values), values, unit, meaning)
   end subroutine keep_table

   subroutine keep_block(self, name, values, unit, meaning)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout), contiguous :: values(:, :, :)
      character(len=*), intent(in) :: unit, meaning

      call keep_flat(self, name, size(values, 1)*size(values, 2), size(values), values, unit, meaning)
   end subroutine keep_block

   !> Real numbers of the working precision in rows. What does not fit into double precision goes as bits.
   subroutine keep_flat(self, name, width, n, values, unit, meaning)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width, n
      real(wp), intent(inout) :: values(n)
      character(len=*), intent(in) :: unit, meaning
      real(dp), allocatable :: doubles(:)
      integer(lp), allocatable :: words(:)

      if (allocated(self%error)) return
      if (storage_size(values) > storage_size(1.0_dp)) then
         words = transfer(values, [0_lp])
         call self%exchange_longs(name, words, unit, meaning//'; bits of the working precision')
         if (self%gives_back .and. .not. allocated(self%error)) values = transfer(words, values, n)
      else
         doubles = real(values, dp)
         call self%exchange_reals(name, width, doubles, unit, meaning)
         if (self%gives_back .and. .not. allocated(self%error)) values = real(doubles, wp)
      end if
   end subroutine keep_flat

   subroutine keep_longs(self, name, values, unit, meaning)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      if (allocated(self%error)) return
      call self%exchange_longs(name, values, unit, meaning)
      if (.not. self%gives_back .or. allocated(self%error)) return
      if (any(values > most_count .or. values < -most_count)) call raise(self%error, input_error, name//' ('// &
         meaning//') holds numbers that cannot be')
   end subroutine keep_longs

   subroutine keep_long(self, name, values, unit, meaning)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout) :: values
      character(len=*), intent(in) :: unit, meaning
      integer(lp) :: list(1)

      list = values
      call self%keep_longs(name, list, unit, meaning)
      values = list(1)
   end subroutine keep_long

   subroutine keep_integers(self, name, values, unit, meaning)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(ip), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: wide(:)

      wide = int(values, lp)
      call self%keep_longs(name, wide, unit, meaning)
      if (.not. self%gives_back .or. allocated(self%error)) return
      if (any(wide > huge(1_ip) .or. wide < -huge(1_ip))) then
         call raise(self%error, input_error, name//' ('//meaning//') holds numbers beyond 32 bits')
      else
         values = int(wide, ip)
      end if
   end subroutine keep_integers

   !> Take times of clocks or give them back, which are double precision always.
   subroutine keep_seconds(self, name, values, meaning)
      class(archive_t), intent(inout) :: self
      !> Name of the column
      character(len=*), intent(in) :: name
      !> Its values [s]
      real(dp), intent(inout), contiguous :: values(:)
      !> Meaning, for those who read the archive
      character(len=*), intent(in) :: meaning

      if (allocated(self%error)) return
      call self%exchange_reals(name, 1, values, 's', meaning)
   end subroutine keep_seconds

   !> Take whole numbers, or insist that they are as they were; `match` of a real number does the same.
   subroutine match_longs(self, name, values, unit, meaning)
      class(archive_t), intent(inout) :: self
      !> Name of the column
      character(len=*), intent(in) :: name
      !> Its values in this run
      integer(lp), intent(in) :: values(:)
      !> Unit, and meaning for those who read the archive or the message that they differ
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: former(:)

      if (allocated(self%error)) return
      allocate (former, source=values)
      call self%exchange_longs(name, former, unit, meaning)
      if (allocated(self%error)) return
      if (any(former /= values)) call raise(self%error, input_error, name//' ('//meaning// &
         ') is not what it was when the state was saved')
   end subroutine match_longs

   subroutine match_real(self, name, values, unit, meaning)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values
      character(len=*), intent(in) :: unit, meaning
      real(wp) :: former

      former = values
      call self%keep_real(name, former, unit, meaning)
      if (allocated(self%error)) return
      if (abs(former - values) > 0.0_wp) call raise(self%error, input_error, name//' ('//meaning//') was '// &
         to_text(former, 17)//' '//unit//' when the state was saved, and is '//to_text(values, 17)//' '//unit// &
         ' now')
   end subroutine match_real

end module polydem_archive
