# polydem_unit_test(LAYER SOURCES test_a.pf ... [HELPERS helper.f90 ...] [USES polydem::layer ...])
#
# The tests of one layer: the program test_LAYER, and in ctest LAYER. Labels are LAYER, its group (the first folder below
# tests), and unit if LAYER is a layer of src. Built with an installed pFUnit if CMake finds one, else with the stand-in
# of this folder. A test finds files of the repository through the environment variable POLYDEM_SOURCE_DIR, and may
# write into its working directory, which is empty at the start. Of its two threads the second one mostly sleeps.
find_package(PFUNIT QUIET)

# pFUnit up to 4.12 ends with code 0 after failures; undefined behaviour does not end a program at all.
set(polydem_words_of_failure "Encountered 1 or more failures" "[(]0 tests?[)]" "runtime error:" "Sanitizer")

# Working directories of the unit tests
set(polydem_scratch "${PROJECT_BINARY_DIR}/tests/scratch")

function(polydem_unit_test layer)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;HELPERS;USES")
  if(arg_UNPARSED_ARGUMENTS OR NOT arg_SOURCES)
    message(FATAL_ERROR "polydem_unit_test(${layer}): give SOURCES, HELPERS and USES only")
  endif()
  if(PFUNIT_FOUND)
    add_pfunit_ctest(test_${layer} TEST_SOURCES ${arg_SOURCES} OTHER_SOURCES ${arg_HELPERS}
      LINK_LIBRARIES ${arg_USES} polydem::flags)
    # The main program that pFUnit writes calls its suites without interfaces.
    set_source_files_properties("${CMAKE_CURRENT_BINARY_DIR}/test_${layer}_driver.F90" PROPERTIES
      COMPILE_OPTIONS "-w;-Wno-error=implicit-interface")
    set(name test_${layer})
  else()
    polydem_stand_in_test(test_${layer} "${arg_SOURCES}" "${arg_HELPERS}" "${arg_USES}")
    add_test(NAME ${layer} COMMAND test_${layer} --verbose)
    set(name ${layer})
  endif()
  cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY "${PROJECT_SOURCE_DIR}/tests" OUTPUT_VARIABLE group)
  string(REGEX REPLACE "/.*" "" group "${group}")
  set(labels ${layer} ${group})
  list(REMOVE_DUPLICATES labels)
  if(TARGET polydem::${layer} OR layer STREQUAL "support")
    list(APPEND labels unit)
  endif()
  set_tests_properties(${name} PROPERTIES
    LABELS "${labels}"
    FAIL_REGULAR_EXPRESSION "${polydem_words_of_failure}"
    ENVIRONMENT "POLYDEM_SOURCE_DIR=${PROJECT_SOURCE_DIR};OMP_NUM_THREADS=2;OMP_WAIT_POLICY=passive"
    WORKING_DIRECTORY "${polydem_scratch}/${layer}"
    FIXTURES_REQUIRED empty_folders)
  set_property(GLOBAL APPEND PROPERTY polydem_test_folders "${polydem_scratch}/${layer}")
endfunction()

# polydem_empty_folders()
#
# The test that runs before all unit tests and empties their working directories, so that none sees what an earlier
# call, perhaps of another revision, left there. Call it after the last unit test.
function(polydem_empty_folders)
  get_property(folders GLOBAL PROPERTY polydem_test_folders)
  add_test(NAME empty_folders COMMAND ${CMAKE_COMMAND} -D "folders=${folders}"
    -P "${PROJECT_SOURCE_DIR}/tests/support/empty_folders.cmake")
  set_tests_properties(empty_folders PROPERTIES FIXTURES_SETUP empty_folders LABELS support)
endfunction()

# One executable of translated test files.
function(polydem_stand_in_test target sources helpers uses)
  set(support "${PROJECT_SOURCE_DIR}/tests/support")
  foreach(source IN LISTS sources)
    cmake_path(GET source STEM stem)
    set(translated "${CMAKE_CURRENT_BINARY_DIR}/${stem}.f90")
    add_custom_command(OUTPUT "${translated}"
      COMMAND "${Python3_EXECUTABLE}" "${support}/translate.py" "${CMAKE_CURRENT_SOURCE_DIR}/${source}" "${translated}"
      DEPENDS "${source}" "${support}/translate.py" "${support}/funit_names.txt"
      COMMENT "Translating ${source}" VERBATIM)
    list(APPEND generated "${translated}")
    string(APPEND suite_uses "   use ${stem}_suite, only: add_${stem} => add_tests\n")
    string(APPEND suite_calls "   call add_${stem}(runner)\n")
  endforeach()
  configure_file("${support}/driver.f90.in" "${target}_driver.f90" @ONLY)
  add_executable(${target} ${helpers} ${generated} "${CMAKE_CURRENT_BINARY_DIR}/${target}_driver.f90")
  set_target_properties(${target} PROPERTIES
    Fortran_MODULE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/${target}_modules")
  # A translated assert is one line, however long.
  target_compile_options(${target} PRIVATE -ffree-line-length-none)
  target_link_libraries(${target} PRIVATE ${uses} funit_stand_in polydem::flags)
endfunction()
