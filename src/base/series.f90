!> Time series of a run: a row of named values at each of some steps, kept until a file takes the rows.
!>
!> Whoever has a quantity sets its column in `row` (`polydem_named_values`); `keep_row` then appends the row. All rows
!> of a run have the same columns, which are set before rows are restored. The rows that are kept belong to a
!> checkpoint, as no file has them yet.
module polydem_series
   use polydem_errors, only: input_error, raise
   use polydem_hash, only: mix_word
   use polydem_kinds, only: dp, lp
   use polydem_named_values, only: named_values_t
   use polydem_serializer, only: serializer_t
   implicit none
   private
   public :: series_t

   !> Rows of named values
   type :: series_t
      !> Name of its fields in a checkpoint
      character(len=16) :: name = 'series'
      !> Columns of the present row; the caller sets their values
      type(named_values_t) :: row
      !> Number of rows that are kept
      integer :: n = 0
      !> Step of each row, (n) or longer
      integer(lp), allocatable :: step(:)
      !> Time of each row [s], (n) or longer
      real(dp), allocatable :: time(:)
      !> Values, (column, n) or longer
      real(dp), allocatable :: value(:, :)
   contains
      procedure :: keep_row
      procedure :: drop_rows
      procedure :: serialize
      procedure, private :: field_name, hash_of_columns
   end type series_t

contains

   !> Append the present row.
   subroutine keep_row(self, step, time)
      class(series_t), intent(inout) :: self
      !> Number of the step
      integer(lp), intent(in) :: step
      !> Simulated time [s]
      real(dp), intent(in) :: time
      integer :: n_columns

      if (.not. allocated(self%row%value)) allocate (self%row%value(0), self%row%label(0))
      n_columns = size(self%row%value)
      call reserve(self, n_columns, self%n + 1)
      self%n = self%n + 1
      self%step(self%n) = step
      self%time(self%n) = time
      self%value(:, self%n) = self%row%value
   end subroutine keep_row

   !> Make room for rows.
   subroutine reserve(self, n_columns, n)
      class(series_t), intent(inout) :: self
      integer, intent(in) :: n_columns, n
      integer(lp), allocatable :: step(:)
      real(dp), allocatable :: time(:), value(:, :)

      if (.not. allocated(self%step)) allocate (self%step(0), self%time(0), self%value(n_columns, 0))
      if (n <= size(self%step)) return
      allocate (step(2*n), time(2*n), value(n_columns, 2*n))
      step(:self%n) = self%step(:self%n)
      time(:self%n) = self%time(:self%n)
      value(:, :self%n) = self%value(:, :self%n)
      call move_alloc(step, self%step)
      call move_alloc(time, self%time)
      call move_alloc(value, self%value)
   end subroutine reserve

   !> Drop the rows up to a step, because a file has them.
   subroutine drop_rows(self, last)
      class(series_t), intent(inout) :: self
      !> The step
      integer(lp), intent(in) :: last
      integer :: k, n

      n = 0
      do k = 1, self%n
         if (self%step(k) <= last) cycle
         n = n + 1
         self%step(n) = self%step(k)
         self%time(n) = self%time(k)
         self%value(:, n) = self%value(:, k)
      end do
      self%n = n
   end subroutine drop_rows

   !> Serialize the rows that are kept. A run with other columns cannot restore them.
   subroutine serialize(self, serializer)
      !> The series with its columns
      class(series_t), intent(inout) :: self
      class(serializer_t), intent(inout) :: serializer
      integer(lp) :: n_rows, n_values
      integer(lp), allocatable :: step(:)
      real(dp), allocatable :: time(:), value(:)
      integer :: n_columns

      n_rows = int(self%n, lp)
      call serializer%match(self%field_name('columns'), [self%hash_of_columns()], '1', 'hash of names and units of '// &
                            'the columns of the '//trim(self%name))
      call serializer%field(self%field_name('rows'), n_rows, '1', 'rows that no segment has yet')
      if (allocated(serializer%error)) return
      if (serializer%is_reading) then
         self%n = 0
         if (allocated(self%step)) deallocate (self%step, self%time, self%value)
         if (n_rows == 0_lp) return
         call serializer%count_rows(self%field_name('value'), n_values)
         if (allocated(serializer%error)) return
         n_columns = size(self%row%label) + 1
         if (n_rows < 0_lp .or. n_rows > n_values .or. n_rows*int(n_columns, lp) /= n_values) then
            call raise(serializer%error, input_error, self%field_name('value')//' has another number of columns')
            return
         end if
         allocate (step(n_rows), time(n_rows), value(n_values))
      else
         if (n_rows == 0_lp) return
         step = self%step(:self%n)
         time = self%time(:self%n)
         n_columns = size(self%value, 1) + 1
         ! A column of ones keeps a series without columns of its own from being empty.
         allocate (value(n_columns*self%n))
         value = reshape([spread(1.0_dp, 1, self%n), reshape(self%value(:, :self%n), [(n_columns - 1)*self%n])], &
                         [n_columns*self%n])
      end if
      call serializer%field(self%field_name('step'), step, '1', 'their steps')
      call serializer%seconds_field(self%field_name('time'), time, 'their times')
      call serializer%seconds_field(self%field_name('value'), value, &
                                    'ones, then their values in the units of the columns')
      if (.not. serializer%is_reading .or. allocated(serializer%error)) return
      allocate (self%step(0), self%time(0), self%value(n_columns - 1, 0))
      call reserve(self, n_columns - 1, int(n_rows))
      self%n = int(n_rows)
      self%step(:self%n) = step
      self%time(:self%n) = time
      self%value(:, :self%n) = reshape(value(self%n + 1:), [n_columns - 1, self%n])
   end subroutine serialize

   !> Hash of the names and units of the columns
   pure integer(lp) function hash_of_columns(self) result(hash)
      class(series_t), intent(in) :: self
      character(len=:), allocatable :: text
      integer :: j, k

      hash = 0_lp
      if (.not. allocated(self%row%label)) return
      do k = 1, size(self%row%label)
         text = trim(self%row%label(k)%name)//' '//trim(self%row%label(k)%unit)
         do j = 1, len(text)
            hash = mix_word(hash, int(ichar(text(j:j)), lp))
         end do
      end do
   end function hash_of_columns

   !> Name of a field in a checkpoint
   pure function field_name(self, field) result(name)
      class(series_t), intent(in) :: self
      !> Name of the field
      character(len=*), intent(in) :: field
      character(len=:), allocatable :: name

      name = '/run/'//trim(self%name)//'_'//field
   end function field_name

end module polydem_series
