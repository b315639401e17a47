# polydem_layer(NAME SOURCES a.f90 ... [USES polydem::other ...])
#
# One folder of src is one library with its own folder of module files. A layer sees the modules of the
# layers it names in USES (and of theirs), so a `use` against the order of the rooms does not compile.
function(polydem_layer name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;USES")
  add_library(polydem_${name} STATIC ${arg_SOURCES})
  add_library(polydem::${name} ALIAS polydem_${name})
  set(modules "${PROJECT_BINARY_DIR}/modules/${name}")
  set_target_properties(polydem_${name} PROPERTIES Fortran_MODULE_DIRECTORY "${modules}")
  target_include_directories(polydem_${name} PUBLIC "${modules}")
  target_link_libraries(polydem_${name} PUBLIC ${arg_USES} PRIVATE polydem::flags)
endfunction()
