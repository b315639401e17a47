!> Serializers: the interface through which the state of a run is saved and restored.
!>
!> A module with state lists its fields once: `field` for values that change, and `match` for values that must be the
!> same in the run that saves and in the run that resumes. The same list serves both directions because the serializer
!> decides whether values are saved or restored.
!>
!> Names have the form /group/column. The group determines the rows of a column. A column of /run is one value or list
!> for the whole run. A column of /bodies, /pieces, /vertices or /pairs has one row per body, polygon, vertex or pair,
!> in ascending order of the identifiers of bodies (not of slots). A parallel serializer therefore derives from the name
!> how to gather and distribute rows.
!>
!> Every bit is preserved in any working precision. Restored data are untrusted: integers must not exceed 2^62 in
!> magnitude. The first failure stays in `error`, and all later calls do nothing.
module polydem_serializer
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_strings, only: to_text
   implicit none
   private
   public :: serializer_t

   !> Largest magnitude of a restored integer
   integer(lp), parameter :: max_magnitude = 2_lp**62

   !> Destination or source of the fields of a state
   type, abstract :: serializer_t
      !> Whether values are restored; else they are saved
      logical :: is_reading = .false.
      !> The first failure
      type(error_t), allocatable :: error
   contains
      !> Save or restore a column: field(name, values, unit, meaning)
      generic :: field => field_reals, field_real, field_table, field_block, field_longs, field_long, field_integers
      !> Save a column, or check that it equals the saved one: match(name, values, unit, meaning)
      generic :: match => match_longs, match_real
      procedure :: seconds_field
      procedure :: count_rows
      procedure :: choose_rows
      !> Save or restore real numbers
      procedure(transfer_reals), deferred :: transfer_reals
      !> Save or restore integers
      procedure(transfer_longs), deferred :: transfer_longs
      procedure, private :: field_reals, field_real, field_table, field_block, field_longs, field_long, field_integers
      procedure, private :: match_longs, match_real
   end type serializer_t

   abstract interface
      !> Save or restore real numbers. A failure is stored in `error`.
      subroutine transfer_reals(self, name, width, values, unit, meaning)
         import :: serializer_t, dp
         class(serializer_t), intent(inout) :: self
         !> Name of the column
         character(len=*), intent(in) :: name
         !> Numbers per row
         integer, intent(in) :: width
         !> The numbers, row after row; their count is a multiple of width
         real(dp), intent(inout), contiguous :: values(:)
         !> Unit and meaning, which are stored with the column
         character(len=*), intent(in) :: unit, meaning
      end subroutine transfer_reals

      !> Save or restore integers. A failure is stored in `error`.
      subroutine transfer_longs(self, name, width, values, unit, meaning)
         import :: serializer_t, lp
         class(serializer_t), intent(inout) :: self
         !> Name of the column
         character(len=*), intent(in) :: name
         !> Numbers per row: more than 1 for the bits of numbers wider than double precision
         integer, intent(in) :: width
         !> The numbers, row after row; their count is a multiple of width
         integer(lp), intent(inout), contiguous :: values(:)
         !> Unit and meaning, which are stored with the column
         character(len=*), intent(in) :: unit, meaning
      end subroutine transfer_longs
   end interface

contains

   !> Number of saved rows of a column, for a column whose length is unknown before it is restored; 0 when saving
   subroutine count_rows(self, name, n)
      class(serializer_t), intent(inout) :: self
      !> Name of the column
      character(len=*), intent(in) :: name
      !> Number of rows
      integer(lp), intent(out) :: n

      associate (unused_self => self, unused => name)
      end associate
      n = 0_lp
   end subroutine count_rows

   !> Choose the rows of a group that are restored next. By default all rows are.
   subroutine choose_rows(self, group, rows)
      class(serializer_t), intent(inout) :: self
      !> Name of the group, such as /pairs/
      character(len=*), intent(in) :: group
      !> Numbers of the rows among all saved ones, from 1, ascending
      integer(lp), intent(in) :: rows(:)

      associate (unused_self => self, unused => group, unused_rows => size(rows))
      end associate
   end subroutine choose_rows

   !> Save or restore real numbers. The other forms of `field` differ only in kind and shape.
   subroutine field_reals(self, name, values, unit, meaning)
      class(serializer_t), intent(inout) :: self
      !> Name of the column
      character(len=*), intent(in) :: name
      !> Values of the column; a restored column must have as many as the saved one
      real(wp), intent(inout), contiguous :: values(:)
      !> Unit and meaning, which are stored with the column
      character(len=*), intent(in) :: unit, meaning

      call transfer_flat(self, name, 1, size(values), values, unit, meaning)
   end subroutine field_reals

   subroutine field_real(self, name, values, unit, meaning)
      class(serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values
      character(len=*), intent(in) :: unit, meaning
      real(wp) :: list(1)

      list = values
      call transfer_flat(self, name, 1, 1, list, unit, meaning)
      values = list(1)
   end subroutine field_real

   subroutine field_table(self, name, values, unit, meaning)
      class(serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout), contiguous :: values(:, :)
      character(len=*), intent(in) :: unit, meaning

      call transfer_flat(self, name, size(values, 1), size(values), values, unit, meaning)
   end subroutine field_table

   subroutine field_block(self, name, values, unit, meaning)
      class(serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout), contiguous :: values(:, :, :)
      character(len=*), intent(in) :: unit, meaning

      call transfer_flat(self, name, size(values, 1)*size(values, 2), size(values), values, unit, meaning)
   end subroutine field_block

   !> Save or restore rows of real numbers. Numbers wider than double precision are stored as bits in 64-bit integers.
   subroutine transfer_flat(self, name, width, n, values, unit, meaning)
      class(serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: width, n
      real(wp), intent(inout) :: values(n)
      character(len=*), intent(in) :: unit, meaning
      real(dp), allocatable :: doubles(:)
      integer(lp), allocatable :: words(:)

      if (allocated(self%error)) return
      if (storage_size(values) > storage_size(1.0_dp)) then
         words = transfer(values, [0_lp])
         call self%transfer_longs(name, width*storage_size(values)/storage_size(1_lp), words, unit, &
                                  meaning//'; bits of the working precision')
         if (self%is_reading .and. .not. allocated(self%error)) values = transfer(words, values, n)
      else
         doubles = real(values, dp)
         call self%transfer_reals(name, width, doubles, unit, meaning)
         if (self%is_reading .and. .not. allocated(self%error)) values = real(doubles, wp)
      end if
   end subroutine transfer_flat

   subroutine field_longs(self, name, values, unit, meaning)
      class(serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning

      if (allocated(self%error)) return
      call self%transfer_longs(name, 1, values, unit, meaning)
      if (.not. self%is_reading .or. allocated(self%error)) return
      if (any(values > max_magnitude .or. values < -max_magnitude)) call raise(self%error, input_error, name//' ('// &
         meaning//') holds integers beyond 2^62: the data are damaged')
   end subroutine field_longs

   subroutine field_long(self, name, values, unit, meaning)
      class(serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(lp), intent(inout) :: values
      character(len=*), intent(in) :: unit, meaning
      integer(lp) :: list(1)

      list = values
      call self%field_longs(name, list, unit, meaning)
      values = list(1)
   end subroutine field_long

   subroutine field_integers(self, name, values, unit, meaning)
      class(serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(ip), intent(inout), contiguous :: values(:)
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: wide(:)

      wide = int(values, lp)
      call self%field_longs(name, wide, unit, meaning)
      if (.not. self%is_reading .or. allocated(self%error)) return
      if (any(wide > huge(1_ip) .or. wide < -huge(1_ip))) then
         call raise(self%error, input_error, name//' ('//meaning//') holds numbers beyond 32 bits')
      else
         values = int(wide, ip)
      end if
   end subroutine field_integers

   !> Save or restore times of clocks, which are always double precision.
   subroutine seconds_field(self, name, values, meaning)
      class(serializer_t), intent(inout) :: self
      !> Name of the column
      character(len=*), intent(in) :: name
      !> Values of the column [s]
      real(dp), intent(inout), contiguous :: values(:)
      !> Meaning, which is stored with the column
      character(len=*), intent(in) :: meaning

      if (allocated(self%error)) return
      call self%transfer_reals(name, 1, values, 's', meaning)
   end subroutine seconds_field

   !> Save integers, or check that they equal the saved ones. The other form of `match` takes a real number.
   subroutine match_longs(self, name, values, unit, meaning)
      class(serializer_t), intent(inout) :: self
      !> Name of the column
      character(len=*), intent(in) :: name
      !> Values of the column in this run
      integer(lp), intent(in) :: values(:)
      !> Unit and meaning, which are stored with the column and named in the error message
      character(len=*), intent(in) :: unit, meaning
      integer(lp), allocatable :: saved_values(:)

      if (allocated(self%error)) return
      allocate (saved_values, source=values)
      call self%transfer_longs(name, 1, saved_values, unit, meaning)
      if (allocated(self%error)) return
      if (any(saved_values /= values)) call raise(self%error, input_error, name//' ('//meaning// &
         ') differs from the saved state')
   end subroutine match_longs

   subroutine match_real(self, name, values, unit, meaning)
      class(serializer_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: values
      character(len=*), intent(in) :: unit, meaning
      real(wp) :: saved_values

      saved_values = values
      call self%field_real(name, saved_values, unit, meaning)
      if (allocated(self%error)) return
      if (abs(saved_values - values) > 0.0_wp) call raise(self%error, input_error, name//' ('//meaning//') was '// &
         to_text(saved_values, 17)//' '//unit//' when the state was saved but is '//to_text(values, 17)//' '//unit// &
         ' now')
   end subroutine match_real

end module polydem_serializer
