# Flags of every Fortran target, as one interface target.
#
# Contraction to fused multiply-add stays off in every build: with it, a cross product of a vector with
# itself need not vanish, and results differ between processors. The vectoriser of GCC fuses all the same (GCC bug 107647)
# if the user's flags or those of Spack name a processor with such instructions, so these are forbidden, too.
add_library(polydem_flags INTERFACE)
add_library(polydem::flags ALIAS polydem_flags)

# GCC takes the descriptors of allocatables that are allocated by assignment for uninitialised (GCC bug 77504), so
# these two warnings are off; run-time checks of the Debug build find the real cases.
#
target_compile_options(polydem_flags INTERFACE
  -std=f2008 -fimplicit-none -ffp-contract=off -fno-semantic-interposition
  -Wall -Wextra -Wimplicit-interface -Werror=implicit-interface -Wtrampolines -Werror=trampolines
  -Wno-uninitialized -Wno-maybe-uninitialized
  $<$<CONFIG:Debug>:-Og -g -fcheck=all -fbacktrace -ffpe-trap=invalid,zero,overflow -finit-real=snan>
  $<$<CONFIG:Sanitize>:-O1 -g -fcheck=bounds -fsanitize=address,undefined -fno-omit-frame-pointer>)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
  target_compile_options(polydem_flags INTERFACE -mno-fma -mno-fma4 -mno-avx512f)
endif()
target_link_options(polydem_flags INTERFACE
  $<$<CONFIG:Sanitize>:-fsanitize=address,undefined>)
target_link_libraries(polydem_flags INTERFACE OpenMP::OpenMP_Fortran)
