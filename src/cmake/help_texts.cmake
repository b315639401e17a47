# Script: write RESULT with the module MODULE, which has the texts of FILES, VERB.txt for each verb.
set(cases "")
foreach(file IN LISTS FILES)
  get_filename_component(verb "${file}" NAME_WE)
  file(READ "${file}" text)
  string(REPLACE "'" "''" text "${text}")
  string(REGEX REPLACE "([^\n]*)\n" "   '\\1'//n// &\n" text "${text}")
  string(APPEND cases "      case ('${verb}')\n         text = &\n${text}   ''\n")
endforeach()
file(WRITE "${RESULT}" "!> The help text of each verb of a program
module ${MODULE}
   implicit none
   private
   public :: help_text

contains

   !> The call of a verb, its meaning in one line, and its options; empty if there is no such verb
   pure function help_text(verb) result(text)
      !> Name of the verb
      character(len=*), intent(in) :: verb
      character(len=:), allocatable :: text
      character(len=*), parameter :: n = new_line('a')

      select case (verb)
${cases}      case default
         text = ''
      end select
   end function help_text

end module ${MODULE}
")
