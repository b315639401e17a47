# polydem_kernel(OUTPUT variable FILES a.f90 b.f90 ...)
#
# A kernel compiled for several instruction sets within one program, as polydem_variant does: module polydem_b of the last
# file becomes polydem_b_base, for every processor of the architecture, and polydem_b_avx2, for those with AVX2. Neither
# has fused operations, so both compute the same bits. On other architectures both are the same.
function(polydem_kernel)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "OUTPUT" "FILES")
  set(wide "")
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
    set(wide -mavx2)
  endif()
  polydem_variant(base OUTPUT base FILES ${arg_FILES})
  polydem_variant(avx2 OUTPUT avx2 FILES ${arg_FILES} OPTIONS ${wide})
  set(${arg_OUTPUT} ${base} ${avx2} PARENT_SCOPE)
endfunction()
