# polydem_variant(SUFFIX OPTIONS "flags" FILES a.f90 b.f90 ... OUTPUT variable)
#
# One source compiled in several ways within one program: the files are joined in their order into one, named after the
# last of them and SUFFIX, in which module polydem_x of each x.f90 is called polydem_x_SUFFIX. One file is one unit for the
# compiler, so it can inline across the modules; OPTIONS can forbid it.
function(polydem_variant suffix)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "OUTPUT" "OPTIONS;FILES")
  set(files "")
  foreach(file IN LISTS arg_FILES)
    cmake_path(ABSOLUTE_PATH file)
    list(APPEND files "${file}")
  endforeach()
  list(GET files -1 last)
  get_filename_component(last "${last}" NAME_WE)
  set(result "${CMAKE_CURRENT_BINARY_DIR}/${last}_${suffix}.f90")
  set(script "${PROJECT_SOURCE_DIR}/src/cmake/join_sources.cmake")
  add_custom_command(OUTPUT "${result}"
    COMMAND "${CMAKE_COMMAND}" -D "RESULT=${result}" -D "SUFFIX=${suffix}" -D "SOURCES=${files}" -P "${script}"
    DEPENDS ${files} "${script}" COMMENT "Joining ${last}_${suffix}.f90" VERBATIM)
  set_source_files_properties("${result}" PROPERTIES COMPILE_OPTIONS "${arg_OPTIONS}")
  set(${arg_OUTPUT} "${result}" PARENT_SCOPE)
endfunction()
