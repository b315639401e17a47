!> How deep contacts are against the bodies that they join.
!>
!> The depth of a contact is its area over its length, the mean depth of the overlap; its share is that over the
!> thickness of the thinner of its bodies, so that about a half means that a body has lost its way.
module polydem_depths
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp, worth_threads
   use polydem_line_writer, only: line_writer_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: depth_share, deepest_contact, any_deeper, count_deeper, depth_text, write_depths

contains

   !> Depth of a contact as a share of the thinner body
   pure real(wp) function depth_share(contacts, thickness, c)
      !> Contacts
      type(contacts_t), intent(in) :: contacts
      !> Thickness of each body, (slot) [m]
      real(wp), intent(in) :: thickness(:)
      !> Place in the table of contacts
      integer(ip), intent(in) :: c

      depth_share = contacts%area(c)/(contacts%length(c)*min(thickness(contacts%first(c)), &
                                                             thickness(contacts%second(c))))
   end function depth_share

   !> The contact of the greatest share, 0 if there is none
   pure integer(ip) function deepest_contact(contacts, thickness)
      !> Contacts
      type(contacts_t), intent(in) :: contacts
      !> Thickness of each body, (slot) [m]
      real(wp), intent(in) :: thickness(:)
      real(wp) :: share, greatest
      integer(ip) :: c

      deepest_contact = 0_ip
      greatest = -1.0_wp
      do c = 1_ip, contacts%n
         share = depth_share(contacts, thickness, c)
         if (share > greatest) then
            greatest = share
            deepest_contact = c
         end if
      end do
   end function deepest_contact

   !> Whether any contact is deeper than a share
   logical function any_deeper(contacts, thickness, limit)
      !> Contacts
      type(contacts_t), intent(in) :: contacts
      !> Thickness of each body, (slot) [m]
      real(wp), intent(in) :: thickness(:)
      !> Share of the thinner body
      real(wp), intent(in) :: limit
      integer(ip) :: c
      logical :: deeper

      deeper = .false.
      !$omp parallel do if (contacts%n > worth_threads) schedule(static) default(none) &
      !$omp    shared(contacts, thickness, limit) private(c) reduction(.or.:deeper)
      do c = 1_ip, contacts%n
         deeper = deeper .or. contacts%area(c) > limit*contacts%length(c) &
            *min(thickness(contacts%first(c)), thickness(contacts%second(c)))
      end do
      !$omp end parallel do
      any_deeper = deeper
   end function any_deeper

   !> Number of contacts deeper than a share
   pure integer(ip) function count_deeper(contacts, thickness, limit)
      !> Contacts
      type(contacts_t), intent(in) :: contacts
      !> Thickness of each body, (slot) [m]
      real(wp), intent(in) :: thickness(:)
      !> Share of the thinner body
      real(wp), intent(in) :: limit
      integer(ip) :: c

      count_deeper = 0_ip
      do c = 1_ip, contacts%n
         if (depth_share(contacts, thickness, c) > limit) count_deeper = count_deeper + 1_ip
      end do
   end function count_deeper

   !> Bodies, place and depth of a contact, for a message
   function depth_text(bodies, contacts, thickness, c) result(text)
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts
      type(contacts_t), intent(in) :: contacts
      !> Thickness of each body, (slot) [m]
      real(wp), intent(in) :: thickness(:)
      !> Place in the table of contacts
      integer(ip), intent(in) :: c
      character(len=:), allocatable :: text

      associate (i => contacts%first(c), j => contacts%second(c))
         text = 'the bodies '//to_text(bodies%id(i))//' and '//to_text(bodies%id(j))//' at ('// &
            to_text(bodies%position(1, i) + contacts%arm_first(1, c))//', '// &
            to_text(bodies%position(2, i) + contacts%arm_first(2, c))//') m overlap by '// &
            to_text(contacts%area(c)/contacts%length(c), 3)//' m, '// &
            to_text(depth_share(contacts, thickness, c), 3)//' of the thinner one'
      end associate
   end function depth_text

   !> Write a table of all contacts deeper than a share, as comma separated values.
   subroutine write_depths(path, bodies, contacts, thickness, limit, error)
      !> Path of the file
      character(len=*), intent(in) :: path
      !> Bodies
      type(bodies_t), intent(in) :: bodies
      !> Contacts
      type(contacts_t), intent(in) :: contacts
      !> Thickness of each body, (slot) [m]
      real(wp), intent(in) :: thickness(:)
      !> Share of the thinner body
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
   end subroutine write_depths

end module polydem_depths
