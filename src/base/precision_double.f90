!> Working precision of this build: double. The CMake option POLYDEM_PRECISION selects it.
module polydem_precision
   use, intrinsic :: iso_fortran_env, only: real64
   implicit none
   private
   public :: wp, precision_name

   !> Kind of every real number in the physics
   integer, parameter :: wp = real64
   !> Name of the working precision, for logs and provenance
   character(len=*), parameter :: precision_name = 'double'
end module polydem_precision
