!> Working precision of this build: single (chosen by the CMake option POLYDEM_PRECISION).
module polydem_precision
   use, intrinsic :: iso_fortran_env, only: real32
   implicit none
   private
   public :: wp, precision_name

   !> Kind of every real number in the physics
   integer, parameter :: wp = real32
   !> Its name, for logs and provenance
   character(len=*), parameter :: precision_name = 'single'
end module polydem_precision
