!> Working precision of this build: quadruple (chosen by the CMake option POLYDEM_PRECISION).
module polydem_precision
   use, intrinsic :: iso_fortran_env, only: real128
   implicit none
   private
   public :: wp, precision_name

   !> Kind of every real number in the physics
   integer, parameter :: wp = real128
   !> Its name, for logs and provenance
   character(len=*), parameter :: precision_name = 'quadruple'
end module polydem_precision
