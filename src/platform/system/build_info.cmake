# Script: fill build_info.f90.in. Without git, or outside a clone, the revision stays that of the last build, or 'unknown'.
set(REVISION "unknown")
if(EXISTS "${RESULT}")
  file(STRINGS "${RESULT}" former REGEX "git_revision =")
  string(REGEX REPLACE ".*'(.*)'.*" "\\1" REVISION "${former}")
endif()
find_package(Git QUIET)
if(Git_FOUND AND EXISTS "${SOURCE_DIR}/.git")
  execute_process(COMMAND "${GIT_EXECUTABLE}" --no-optional-locks describe --always --dirty --tags
    WORKING_DIRECTORY "${SOURCE_DIR}" OUTPUT_VARIABLE described RESULT_VARIABLE status
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(status EQUAL 0)
    set(REVISION "${described}")
  endif()
endif()
configure_file("${TEMPLATE}" "${RESULT}" @ONLY)
