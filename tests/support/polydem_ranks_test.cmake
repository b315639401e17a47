# polydem_ranks_test(NAME LAYER TARGET [ARGUMENTS ...])
#
# A program that is run by several ranks, 1, 2, 3, 4 and 7 of them, and ends with another code than 0 if anything is wrong:
# in ctest NAME_1 to NAME_7 with the labels LAYER and ranks. There are more ranks than processors, so they must not wait
# busily.
set(polydem_ranks_environment
  OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1 OMPI_MCA_hwloc_base_binding_policy=none
  OMP_NUM_THREADS=1)

function(polydem_ranks_test name layer target)
  foreach(ranks 1 2 3 4 7)
    add_test(NAME ${name}_${ranks}
      COMMAND "${PROJECT_SOURCE_DIR}/src/packaging/watch_ranks" "${MPIEXEC_EXECUTABLE}"
        ${MPIEXEC_NUMPROC_FLAG} ${ranks} $<TARGET_FILE:${target}> ${ARGN})
    set_tests_properties(${name}_${ranks} PROPERTIES
      LABELS "${layer};ranks" ENVIRONMENT "${polydem_ranks_environment}" PROCESSORS 2)
  endforeach()
endfunction()
