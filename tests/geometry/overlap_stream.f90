!> Overlaps of pairs of polygons from a file of real numbers, for checks against exact arithmetic.
!>
!>     overlap_stream PAIRS RESULTS
!>
!> PAIRS holds for each pair n, m, the stored separating edge, the offset (2), the vertices of a (2 n) and b (2 m);
!> RESULTS gets area, centroid (2), normal (2), both moments and the separating edge. All are 8-byte reals.
program overlap_stream
   use polydem_convex_overlap, only: overlap_t, overlap_polygons
   use polydem_kinds, only: dp, ip, wp
   implicit none
   character(len=4096) :: pairs, results
   integer :: from, to, status
   real(dp) :: head(5)
   real(dp), allocatable :: a(:, :), b(:, :)
   type(overlap_t) :: overlap

   call get_command_argument(1, pairs)
   call get_command_argument(2, results)
   open (newunit=from, file=trim(pairs), access='stream', form='unformatted', status='old')
   open (newunit=to, file=trim(results), access='stream', form='unformatted', status='replace')
   do
      read (from, iostat=status) head
      if (status /= 0) exit
      allocate (a(2, nint(head(1))), b(2, nint(head(2))))
      read (from) a, b
      call overlap_polygons(real(a, wp), real(b, wp), real(head(4:5), wp), nint(head(3), ip), overlap)
      write (to) real([overlap%area, overlap%centroid, overlap%normal, overlap%moment_a, &
                       overlap%moment_b, real(overlap%separating_edge, wp)], dp)
      deallocate (a, b)
   end do
   close (from)
   close (to)
end program overlap_stream
