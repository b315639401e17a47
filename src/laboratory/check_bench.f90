!> Checks of the lists of a bench against each other. The table of entries holds the checks of single entries.
module polydem_check_bench
   use polydem_bench_settings, only: bench_settings_t
   use polydem_errors, only: error_t, input_error, raise
   use polydem_source_locations, only: overrides_of, place_of
   use polydem_strings, only: to_text, quoted, text_t
   implicit none
   private
   public :: check_bench

   !> Characters that the name of a scene may contain; the name becomes part of file names
   character(len=*), parameter :: safe_letters = &
      'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._'
   !> Upper limit of the length of a list. The check for duplicates compares all pairs
   integer, parameter :: longest_list = 9999

contains

   !> Check the lengths of the lists against each other, and the lists for invalid and duplicate values.
   pure subroutine check_bench(bench, error)
      !> Settings with all entries filled in
      type(bench_settings_t), intent(in) :: bench
      !> First invalid list
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (size(bench%names) /= size(bench%scenes)) call raise_at('names', 'has '//to_text(size(bench%names))// &
         ' values, but there are '//to_text(size(bench%scenes))//" in 'scenes'"//overrides_of(bench, 'bench'), &
         bench, error)
      if (max(size(bench%names), size(bench%finders), size(bench%threads)) > longest_list) call raise_at('names', &
         'and other lists cannot have more than '//to_text(longest_list)//' values', bench, error)
      if (allocated(error)) return
      do k = 1, size(bench%names)
         if (verify(bench%names(k)%text, safe_letters) > 0 .or. bench%names(k)%text == '') call raise_at('names', &
            'contains '//quoted(bench%names(k)%text)//', but a name may contain only letters, digits, . and _', &
            bench, error)
      end do
      do k = 1, size(bench%scenes)
         if (bench%scenes(k)%text == '') call raise_at('scenes', 'contains an empty scene', bench, error)
      end do
      do k = 1, size(bench%prepare)
         if (bench%prepare(k)%text == '') call raise_at('prepare', 'contains an empty text', bench, error)
      end do
      if (allocated(error)) return
      call refuse_duplicates('names', bench%names, bench, error)
      call refuse_duplicates('finders', bench%finders, bench, error)
      do k = 2, size(bench%threads)
         if (any(bench%threads(:k - 1) == bench%threads(k))) call raise_at('threads', &
            'contains '//to_text(bench%threads(k))//' twice', bench, error)
      end do
   end subroutine check_bench

   !> Reject a list that contains the same text twice.
   pure subroutine refuse_duplicates(key, texts, bench, error)
      character(len=*), intent(in) :: key
      type(text_t), intent(in) :: texts(:)
      type(bench_settings_t), intent(in) :: bench
      type(error_t), allocatable, intent(inout) :: error
      integer :: j, k

      do k = 2, size(texts)
         do j = 1, k - 1
            if (texts(j)%text == texts(k)%text) call raise_at(key, 'contains '//quoted(texts(k)%text)//' twice', &
               bench, error)
         end do
      end do
   end subroutine refuse_duplicates

   !> Raise an error at the place where an entry is given.
   pure subroutine raise_at(key, problem, bench, error)
      character(len=*), intent(in) :: key, problem
      type(bench_settings_t), intent(in) :: bench
      type(error_t), allocatable, intent(inout) :: error

      call raise(error, input_error, place_of(bench, 'bench', key)//': '''//key//''' in &bench '//problem)
   end subroutine raise_at

end module polydem_check_bench
