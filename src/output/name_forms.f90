!> The names that a file of a result has before it is complete and after, and what to say if one is taken.
module polydem_name_forms
   use polydem_result_folder, only: open_suffix, unfinished
   implicit none
   private
   public :: manifest_name, forms_of, complete_name, in_the_way

   !> Name of the list of the files of a result
   character(len=*), parameter :: manifest_name = 'manifest.txt'

contains

   !> The names that a file may have: the one it has when it is complete, and those before
   pure function forms_of(name) result(forms)
      !> Name of the complete file
      character(len=*), intent(in) :: name
      character(len=len(name) + len(unfinished)) :: forms(3)

      forms(1) = name
      forms(2) = name//unfinished
      forms(3) = name//open_suffix
   end function forms_of

   !> Name of a file once it is complete
   pure function complete_name(form) result(name)
      !> Any of `forms_of` that name
      character(len=*), intent(in) :: form
      character(len=:), allocatable :: name

      name = without_end(without_end(form, unfinished), open_suffix)
   end function complete_name

   pure function without_end(text, ending) result(rest)
      character(len=*), intent(in) :: text, ending
      character(len=:), allocatable :: rest
      integer :: n

      rest = text
      n = len(text) - len(ending)
      if (n < 1) return
      if (text(n + 1:) == ending) rest = text(:n)
   end function without_end

   !> What to say of a file that has a name of the result, and is not one of its files
   pure function in_the_way(path) result(message)
      !> Path of the file
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: message

      message = path//' is in the way: no '//manifest_name//' lists it as part of a result, so it is neither '// &
         'changed nor removed. Move it away, or choose another folder with --set output.folder=NAME. (Results of '// &
         'older versions of this program have no '//manifest_name//'.)'
   end function in_the_way

end module polydem_name_forms
