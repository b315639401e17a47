# Packages that CPack makes: `cpack --config build/release/CPackConfig.cmake`. The package holds what `cmake --install`
# installs. The tools in Python are a wheel of their own (postproc).
set(CPACK_GENERATOR DEB CACHE STRING "kinds of packages")
set(CPACK_PACKAGE_NAME polydem)
set(CPACK_PACKAGE_VENDOR "The polydem authors")
set(CPACK_PACKAGE_CONTACT "The polydem authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_CHECKSUM SHA256)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "polydem simulates granular matter made of convex polygons in two dimensions with the
 discrete element method, and compares the speed of algorithms of neighbour search.")
# dpkg-shlibdeps finds the packages of the libraries; without it they are those of Debian 12.
find_program(POLYDEM_SHLIBDEPS dpkg-shlibdeps)
mark_as_advanced(POLYDEM_SHLIBDEPS)
if(POLYDEM_SHLIBDEPS)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
elseif(POLYDEM_MPI)
  set(CPACK_DEBIAN_PACKAGE_DEPENDS
    "libc6, libgfortran5, libgomp1, libhdf5-openmpi-103-1, libhdf5-openmpi-fortran-102, libopenmpi3")
else()
  set(CPACK_DEBIAN_PACKAGE_DEPENDS "libc6, libgfortran5, libgomp1, libhdf5-103-1, libhdf5-fortran-102")
endif()
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "openmpi-bin")
if(NOT POLYDEM_MPI)
  unset(CPACK_DEBIAN_PACKAGE_RECOMMENDS)
endif()
include(CPack)
