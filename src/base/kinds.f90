!> Kinds of all numbers, and two limits that all stages share. No other module defines a kind.
module polydem_kinds
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64, real32, real64
   use polydem_precision, only: wp, precision_name
   implicit none
   private
   public :: wp, dp, sp, ip, lp, bp, precision_name, min_parallel_size, far

   !> Double precision: times of clocks, and all real numbers in files
   integer, parameter :: dp = real64
   !> Single precision: large arrays of approximate numbers
   integer, parameter :: sp = real32
   !> Counts and indices of bodies, boxes and pairs
   integer, parameter :: ip = int32
   !> Keys, hashes and counters that can exceed 2^31
   integer, parameter :: lp = int64
   !> Flags in large arrays
   integer, parameter :: bp = int8

   !> Loops over fewer bodies, pairs or contacts run on one thread, because starting threads costs more than it saves
   integer(ip), parameter :: min_parallel_size = 256_ip
   !> Largest coordinate and largest half side of a box [m]. Sums and differences of two boxes are then finite
   real(wp), parameter :: far = 0.25_wp*huge(1.0_wp)

end module polydem_kinds
