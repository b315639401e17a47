# polydem_help_texts(MODULE OUTPUT variable FILES VERB.txt ...)
#
# The help texts of the verbs of a program become a module, so that the program needs no files.
function(polydem_help_texts module)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "OUTPUT" "FILES")
  set(result "${CMAKE_CURRENT_BINARY_DIR}/${module}.f90")
  set(script "${PROJECT_SOURCE_DIR}/src/cmake/help_texts.cmake")
  add_custom_command(OUTPUT "${result}"
    COMMAND "${CMAKE_COMMAND}" -D "RESULT=${result}" -D "MODULE=polydem_${module}" -D "FILES=${arg_FILES}" -P "${script}"
    DEPENDS ${arg_FILES} "${script}" COMMENT "Writing ${module}.f90" VERBATIM)
  set(${arg_OUTPUT} "${result}" PARENT_SCOPE)
endfunction()

# polydem_program(NAME MAIN main.f90 USES polydem::layer ...)
#
# A program that is installed. All of them lie in one folder, in a build as where they are installed.
function(polydem_program name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "MAIN" "USES")
  add_executable(${name} ${arg_MAIN} $<TARGET_OBJECTS:polydem_granted_memory>
    $<TARGET_OBJECTS:polydem_runtime_variables>)
  target_link_libraries(${name} PRIVATE ${arg_USES} polydem::flags)
  target_link_options(${name} PRIVATE -Wl,--wrap=malloc,--wrap=realloc)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/src/app")
  install(TARGETS ${name} RUNTIME)
endfunction()
