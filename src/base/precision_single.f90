!> Working precision of this build: single. The CMake option POLYDEM_PRECISION selects it.
module polydem_precision
   use, intrinsic :: iso_fortran_env, only: real32
   implicit none
   private
   public :: wp, precision_name

   !> Kind of every real number in the physics
   integer, parameter :: wp = real32
   !> Name of the working precision, for logs and provenance
   character(len=*), parameter :: precision_name = 'single'
end module polydem_precision
