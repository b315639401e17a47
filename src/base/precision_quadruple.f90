!> Working precision of this build: quadruple. The CMake option POLYDEM_PRECISION selects it.
module polydem_precision
   use, intrinsic :: iso_fortran_env, only: real128
   implicit none
   private
   public :: wp, precision_name

   !> Kind of every real number in the physics
   integer, parameter :: wp = real128
   !> Name of the working precision, for logs and provenance
   character(len=*), parameter :: precision_name = 'quadruple'
end module polydem_precision
