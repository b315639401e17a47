!> Print the manual of the namelist entries.
program print_entries
   use polydem_entries_manual, only: entries_as_markdown
   implicit none

   write (*, '(a)', advance='no') entries_as_markdown()
end program print_entries
