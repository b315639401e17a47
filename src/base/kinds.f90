!> Kinds of numbers, the only place that names them, and the size from which a loop is worth several threads.
module polydem_kinds
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64, real64
   use polydem_precision, only: wp, precision_name
   implicit none
   private
   public :: wp, dp, ip, lp, bp, precision_name, worth_threads

   !> Double precision: clocks and everything in files
   integer, parameter :: dp = real64
   !> Counts and indices of bodies, boxes and pairs
   integer, parameter :: ip = int32
   !> Keys, hashes and counters that outgrow 2^31
   integer, parameter :: lp = int64
   !> Flags stored by the million
   integer, parameter :: bp = int8

   !> Loops over fewer bodies, pairs or contacts than this run on one thread: starting the others would cost more
   integer(ip), parameter :: worth_threads = 256_ip
end module polydem_kinds
