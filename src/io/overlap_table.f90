!> Table of deep contacts at the start, as comma-separated values (overlaps.csv).
module polydem_overlap_table
   use polydem_bodies, only: bodies_t
   use polydem_contact_depth, only: depth_share
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_line_writer, only: line_writer_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: write_overlap_table

contains

   !> Write a table of all contacts whose relative depth exceeds a limit.
   subroutine write_overlap_table(path, bodies, contacts, thickness, limit, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts
      type(contacts_t), intent(in) :: contacts
      !> Thickness of each body, (slot) [m]
      real(wp), intent(in) :: thickness(:)
      !> Limit of the depth as a fraction of the thickness of the thinner body
      real(wp), intent(in) :: limit
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      type(line_writer_t) :: file
      real(wp) :: share
      integer(ip) :: c

      call file%open(path, error)
      if (allocated(error)) return
      call file%put_line('first,second,x [m],y [m],area [m2],depth [m],depth/thinner body')
      do c = 1_ip, contacts%n
         share = depth_share(contacts, thickness, c)
         if (share <= limit) cycle
         associate (i => contacts%first(c), j => contacts%second(c))
            call file%put_line(to_text(bodies%id(i))//','//to_text(bodies%id(j))//','// &
                               to_text(bodies%position(1, i) + contacts%arm_first(1, c), 9)//','// &
                               to_text(bodies%position(2, i) + contacts%arm_first(2, c), 9)//','// &
                               to_text(contacts%area(c))//','//to_text(contacts%area(c)/contacts%length(c))//','// &
                               to_text(share))
         end associate
      end do
      call file%close(error)
   end subroutine write_overlap_table

end module polydem_overlap_table
