# Flags of every Fortran target, as one interface target.
#
# Contraction to fused multiply-add stays off in every build: with it, a cross product of a vector with
# itself need not vanish, and results differ between processors.
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
target_link_options(polydem_flags INTERFACE
  $<$<CONFIG:Sanitize>:-fsanitize=address,undefined>)
target_link_libraries(polydem_flags INTERFACE OpenMP::OpenMP_Fortran)
