!> Finds the contacts among pairs of bodies: overlapping polygons with overlap area, its rate of change, contact point
!> and direction.
!>
!> A contact is *degenerate* if it has no direction: |N| is negligible against the square root of the area, because one
!> body is inside the other, or bars cross. A degenerate contact gets the direction of the line of centres (or of the x
!> axis if the centres coincide) and the side of a square of the same area as its length. With this length no force or
!> stiffness overflows, and the run can continue or stop with a message. `normal`, `moment` and `rate` are not changed.
module polydem_find_contacts
   use omp_lib, only: omp_get_max_threads, omp_get_num_threads, omp_get_thread_num
   use polydem_bodies, only: bodies_t
   use polydem_contact_history, only: contact_history_t
   use polydem_contacts, only: contacts_t, reserve_contacts
   use polydem_convex_overlap, only: overlap_polygons, overlap_t
   use polydem_kinds, only: ip, lp, wp, min_parallel_size
   implicit none
   private
   public :: find_contacts

   !> Ratio of a length to the square root of the area below which the length is rounding error
   real(wp), parameter :: no_length = 4096.0_wp*epsilon(1.0_wp)
   !> Largest number of threads
   integer(ip), parameter :: most_threads = 1024_ip
   !> Smallest number of pairs for which starting a thread saves time
   integer(ip), parameter :: least_pairs = 64_ip

   !> Range of consecutive pairs of one thread
   type :: run_t
      !> Index of the first pair minus one
      integer(ip) :: start = 0_ip
      !> Index of the last pair
      integer(ip) :: end = 0_ip
      !> Number of contacts among these pairs
      integer(ip) :: n = 0_ip
      !> Number of degenerate contacts
      integer(ip) :: n_degenerate = 0_ip
   end type run_t

contains

   !> Find the contacts of this step, in the order of the pairs.
   !>
   !> Each thread processes one range of consecutive pairs and writes its contacts to the indices of these pairs. The
   !> gaps between the ranges are then closed. The result does not depend on the number of threads.
   subroutine find_contacts(bodies, n_pairs, first, second, history, contacts)
      !> Bodies with rotated polygons
      type(bodies_t), intent(in) :: bodies
      !> Number of pairs
      integer(ip), intent(in) :: n_pairs
      !> Lower slot of each pair, (n_pairs) or longer
      integer(ip), intent(in) :: first(:)
      !> Higher slot of each pair, (n_pairs) or longer
      integer(ip), intent(in) :: second(:)
      !> Contact history of the pairs: `separating_edge` is updated, and the other columns are cleared for pairs whose
      !> polygons do not overlap; any column may be absent
      type(contact_history_t), intent(inout) :: history
      !> Contacts; `area_is_effective` must be set. The columns that the forces fill are not changed
      type(contacts_t), intent(inout) :: contacts
      type(run_t) :: runs(0:most_threads - 1_ip)
      integer(ip) :: threads, me

      call reserve_contacts(contacts, n_pairs)
      threads = min(int(omp_get_max_threads(), ip), most_threads, 1_ip + n_pairs/least_pairs)
      !$omp parallel num_threads(threads) default(none) private(me) &
      !$omp shared(bodies, n_pairs, first, second, history, contacts, runs, threads)
      !$omp single
      threads = int(omp_get_num_threads(), ip)
      !$omp end single
      me = int(omp_get_thread_num(), ip)
      runs(me) = run_t(start=share(n_pairs, me, threads), end=share(n_pairs, me + 1_ip, threads))
      call find_in_run(bodies, first, second, history, contacts, runs(me))
      !$omp end parallel
      call close_gaps(runs(0:threads - 1_ip), contacts)
   end subroutine find_contacts

   !> Number of items of all threads before the given one
   pure integer(ip) function share(n, thread, threads)
      integer(ip), intent(in) :: n
      integer(ip), intent(in) :: thread
      integer(ip), intent(in) :: threads

      share = int(int(n, lp)*int(thread, lp)/int(threads, lp), ip)
   end function share

   !> Find the contacts of a range of pairs and write them to the indices after its start.
   subroutine find_in_run(bodies, first, second, history, contacts, run)
      type(bodies_t), intent(in) :: bodies
      integer(ip), intent(in) :: first(:)
      integer(ip), intent(in) :: second(:)
      type(contact_history_t), intent(inout) :: history
      type(contacts_t), intent(inout) :: contacts
      type(run_t), intent(inout) :: run
      type(overlap_t) :: overlap
      real(wp) :: offset(2)
      integer(ip) :: p, i, j, edge, n, n_degenerate
      logical :: degenerate

      n = 0_ip
      n_degenerate = 0_ip
      edge = 0_ip
      associate (start => bodies%vertex_start, turned => bodies%turned)
         do p = run%start + 1_ip, run%end
            i = first(p)
            j = second(p)
            offset = bodies%position(:, j) - bodies%position(:, i)
            if (allocated(history%separating_edge)) edge = history%separating_edge(p)
            call overlap_polygons(turned(:, start(i):start(i + 1_ip) - 1_ip), &
                                  turned(:, start(j):start(j + 1_ip) - 1_ip), offset, edge, overlap, &
                                  contacts%area_is_effective)
            call update_history(p, overlap, history)
            if (overlap%area > 0.0_wp) then
               n = n + 1_ip
               call store(bodies, p, i, j, offset, overlap, run%start + n, contacts, degenerate)
               if (degenerate) n_degenerate = n_degenerate + 1_ip
            end if
         end do
      end associate
      run%n = n
      run%n_degenerate = n_degenerate
   end subroutine find_in_run

   !> Update the contact history of a pair.
   subroutine update_history(p, overlap, history)
      integer(ip), intent(in) :: p
      type(overlap_t), intent(in) :: overlap
      type(contact_history_t), intent(inout) :: history
      integer :: k

      if (allocated(history%separating_edge)) history%separating_edge(p) = overlap%separating_edge
      if (overlap%area > 0.0_wp .or. .not. allocated(history%column)) return
      do k = 1, size(history%column)
         history%column(k)%value(p) = 0.0_wp
      end do
   end subroutine update_history

   !> Write one contact.
   subroutine store(bodies, p, i, j, offset, overlap, c, contacts, degenerate)
      type(bodies_t), intent(in) :: bodies
      !> Index of the pair in the pair list
      integer(ip), intent(in) :: p
      !> Slot of the first body
      integer(ip), intent(in) :: i
      !> Slot of the second body
      integer(ip), intent(in) :: j
      !> Centre of the second body minus centre of the first body [m]
      real(wp), intent(in) :: offset(2)
      type(overlap_t), intent(in) :: overlap
      !> Index in the table of contacts
      integer(ip), intent(in) :: c
      type(contacts_t), intent(inout) :: contacts
      !> Whether the contact is degenerate
      logical, intent(out) :: degenerate

      contacts%pair(c) = p
      contacts%first(c) = i
      contacts%second(c) = j
      contacts%area(c) = overlap%area
      contacts%rate(c) = overlap%normal(1)*(bodies%velocity(1, i) - bodies%velocity(1, j)) &
                         + overlap%normal(2)*(bodies%velocity(2, i) - bodies%velocity(2, j)) &
                         + (overlap%moment_a*bodies%angular_velocity(i) &
                            - overlap%moment_b*bodies%angular_velocity(j))
      contacts%normal(:, c) = overlap%normal
      contacts%moment(1, c) = overlap%moment_a
      contacts%moment(2, c) = overlap%moment_b
      contacts%arm_first(:, c) = overlap%centroid
      contacts%arm_second(:, c) = overlap%centroid - offset
      call find_direction(overlap, offset, contacts%direction(:, c), contacts%length(c), degenerate)
   end subroutine store

   !> Find the direction from the second body to the first, and the length of the contact [m].
   pure subroutine find_direction(overlap, offset, direction, length, degenerate)
      type(overlap_t), intent(in) :: overlap
      real(wp), intent(in) :: offset(2)
      real(wp), intent(out) :: direction(2)
      real(wp), intent(out) :: length
      logical, intent(out) :: degenerate
      real(wp) :: side, distance

      side = sqrt(overlap%area)
      length = length_of(overlap%normal)
      degenerate = length <= no_length*side
      if (.not. degenerate) then
         direction = -overlap%normal/length
         return
      end if
      length = side
      distance = length_of(offset)
      if (distance > no_length*side) then
         direction = -offset/distance
      else
         direction = [1.0_wp, 0.0_wp]
      end if
   end subroutine find_direction

   !> Length of a vector. Unlike hypot, it has the same bits on all machines
   pure real(wp) function length_of(vector)
      real(wp), intent(in) :: vector(2)

      length_of = sqrt(vector(1)*vector(1) + vector(2)*vector(2))
   end function length_of

   !> Count the contacts of all ranges and close the gaps between the ranges; one thread moves each column.
   subroutine close_gaps(runs, contacts)
      type(run_t), intent(in) :: runs(:)
      type(contacts_t), intent(inout) :: contacts
      integer(ip) :: k, n

      n = 0_ip
      contacts%n_degenerate = 0_ip
      do k = 1_ip, size(runs, kind=ip)
         n = n + runs(k)%n
         contacts%n_degenerate = contacts%n_degenerate + runs(k)%n_degenerate
      end do
      contacts%n = n
      if (size(runs) == 1) return
      !$omp parallel sections if (contacts%n > min_parallel_size) default(none) shared(runs, contacts)
      !$omp section
      call move_numbers(runs, contacts%pair)
      call move_numbers(runs, contacts%first)
      call move_numbers(runs, contacts%second)
      call move_column(runs, contacts%area)
      call move_column(runs, contacts%rate)
      !$omp section
      call move_vectors(runs, contacts%normal)
      call move_column(runs, contacts%length)
      !$omp section
      call move_vectors(runs, contacts%moment)
      call move_vectors(runs, contacts%direction)
      !$omp section
      call move_vectors(runs, contacts%arm_first)
      call move_vectors(runs, contacts%arm_second)
      !$omp end parallel sections
   end subroutine close_gaps

   !> Close the gaps of a column of integers.
   pure subroutine move_numbers(runs, column)
      type(run_t), intent(in) :: runs(:)
      integer(ip), intent(inout), contiguous :: column(:)
      integer(ip) :: k, c, n

      n = runs(1)%n
      do k = 2_ip, size(runs, kind=ip)
         do c = 1_ip, runs(k)%n
            column(n + c) = column(runs(k)%start + c)
         end do
         n = n + runs(k)%n
      end do
   end subroutine move_numbers

   !> Close the gaps of a column of real numbers.
   pure subroutine move_column(runs, column)
      type(run_t), intent(in) :: runs(:)
      real(wp), intent(inout), contiguous :: column(:)
      integer(ip) :: k, c, n

      n = runs(1)%n
      do k = 2_ip, size(runs, kind=ip)
         do c = 1_ip, runs(k)%n
            column(n + c) = column(runs(k)%start + c)
         end do
         n = n + runs(k)%n
      end do
   end subroutine move_column

   !> Close the gaps of a column of vectors.
   pure subroutine move_vectors(runs, column)
      type(run_t), intent(in) :: runs(:)
      real(wp), intent(inout), contiguous :: column(:, :)
      integer(ip) :: k, c, n

      n = runs(1)%n
      do k = 2_ip, size(runs, kind=ip)
         do c = 1_ip, runs(k)%n
            column(1, n + c) = column(1, runs(k)%start + c)
            column(2, n + c) = column(2, runs(k)%start + c)
         end do
         n = n + runs(k)%n
      end do
   end subroutine move_vectors

end module polydem_find_contacts
