# polydem_layer(NAME SOURCES a.f90 ... [USES polydem::other ...])
#
# One folder of src is one library with its own folder of module files. A layer sees the modules of the layers that it
# names in USES and no others, not even those of theirs: the links are PRIVATE, so what a layer uses is linked into a
# program but not shown to it. The test `layers` compares what it sees with what it uses.
function(polydem_layer name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;USES")
  add_library(polydem_${name} STATIC ${arg_SOURCES})
  add_library(polydem::${name} ALIAS polydem_${name})
  set(modules "${PROJECT_BINARY_DIR}/layers/${name}")
  set_target_properties(polydem_${name} PROPERTIES Fortran_MODULE_DIRECTORY "${modules}")
  target_include_directories(polydem_${name} INTERFACE "${modules}")
  target_link_libraries(polydem_${name} PRIVATE ${arg_USES} polydem::flags)
  polydem_remove_old_modules("${modules}" "${arg_SOURCES}")
endfunction()

# Delete the module files of sources that have left a layer, since other layers would still see them.
function(polydem_remove_old_modules folder sources)
  file(GLOB old "${folder}/*.mod")
  foreach(source IN LISTS sources)
    cmake_path(ABSOLUTE_PATH source)
    if(EXISTS "${source}")
      file(STRINGS "${source}" lines REGEX "^module [a-z]")
      foreach(line IN LISTS lines)
        string(REGEX REPLACE "^module ([a-z0-9_]+).*" "\\1" module "${line}")
        list(REMOVE_ITEM old "${folder}/${module}.mod")
      endforeach()
    endif()
  endforeach()
  if(old)
    file(REMOVE ${old})
  endif()
endfunction()
