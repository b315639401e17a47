# cmake -D PROGRAM=print_entries -D README=inputs/README.md [-D UPDATE=ON] -P entries_manual.cmake
#
# Compare the table between the lines <!-- entries --> and <!-- /entries --> of the manual with the table that
# the program prints. With UPDATE, replace it by the printed table.
set(opening "<!-- entries -->\n")
set(closing "<!-- /entries -->")

execute_process(COMMAND "${PROGRAM}" OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
file(READ "${README}" manual)
string(FIND "${manual}" "${opening}" first)
string(FIND "${manual}" "${closing}" last)
if(first EQUAL -1 OR last LESS first)
  message(FATAL_ERROR "${README} has no lines ${opening} and ${closing}")
endif()
string(LENGTH "${opening}" length)
math(EXPR first "${first} + ${length}")
math(EXPR length "${last} - ${first}")
string(SUBSTRING "${manual}" ${first} ${length} table)

if(table STREQUAL printed)
  message(STATUS "${README} has the table of entries")
elseif(UPDATE)
  string(SUBSTRING "${manual}" 0 ${first} before)
  string(SUBSTRING "${manual}" ${last} -1 after)
  file(WRITE "${README}" "${before}${printed}${after}")
  message(STATUS "${README} has a new table of entries")
else()
  message(FATAL_ERROR "the table of entries in ${README} is not that of the code; "
    "cmake --build BUILD --target entries_manual generates it")
endif()
