# Refuse compilers that give wrong or other results, or none.
if(NOT CMAKE_Fortran_COMPILER_ID STREQUAL "GNU" OR CMAKE_Fortran_COMPILER_VERSION VERSION_LESS 12)
  message(FATAL_ERROR "polydem needs gfortran 12 or newer, but ${CMAKE_Fortran_COMPILER} is "
    "${CMAKE_Fortran_COMPILER_ID} ${CMAKE_Fortran_COMPILER_VERSION}. "
    "Name another compiler: cmake -D CMAKE_Fortran_COMPILER=gfortran-12")
endif()
