!> Depth of contacts relative to the size of their bodies.
!>
!> The share of a contact is its depth over the thickness of the thinner of the two pieces that touch; a convex body is
!> one piece. A share of about 0.5 means that one body is passing through the other.
module polydem_contact_depth
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp, min_parallel_size
   use polydem_strings, only: to_text
   implicit none
   private
   public :: thinner_pieces, depth_share, deepest_contact, any_deeper, depth_text

contains

   !> Thickness of the thinner of the two pieces of each contact, (contact) [m]
   pure function thinner_pieces(bodies, contacts, first, second) result(thinner)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> Lower and higher piece of each pair of the list in which the contacts were found
      integer(ip), intent(in) :: first(:), second(:)
      real(wp) :: thinner(contacts%n)
      integer(ip) :: c

      do c = 1_ip, contacts%n
         if (bodies%pieces%most == 1_ip) then
            thinner(c) = min(bodies%thickness(contacts%row(c)%first), bodies%thickness(contacts%row(c)%second))
         else
            associate (pair => contacts%row(c)%pair, thickness => bodies%pieces%thickness)
               thinner(c) = min(thickness(first(pair)), thickness(second(pair)))
            end associate
         end if
      end do
   end function thinner_pieces

   !> Depth of a contact as a share of the thinner piece
   pure real(wp) function depth_share(contacts, thinner, c)
      type(contacts_t), intent(in) :: contacts
      !> Thickness of the thinner piece of each contact, (contact) [m]
      real(wp), intent(in) :: thinner(:)
      !> Index of the contact
      integer(ip), intent(in) :: c

      depth_share = contacts%row(c)%depth/thinner(c)
   end function depth_share

   !> The contact with the greatest share, 0 if there are no contacts
   pure integer(ip) function deepest_contact(contacts, thinner)
      type(contacts_t), intent(in) :: contacts
      !> Thickness of the thinner piece of each contact, (contact) [m]
      real(wp), intent(in) :: thinner(:)
      real(wp) :: share, greatest
      integer(ip) :: c

      deepest_contact = 0_ip
      greatest = -1.0_wp
      do c = 1_ip, contacts%n
         share = depth_share(contacts, thinner, c)
         if (share > greatest) then
            greatest = share
            deepest_contact = c
         end if
      end do
   end function deepest_contact

   !> Whether any contact is deeper than a share of the thinner piece
   logical function any_deeper(contacts, thinner, limit)
      type(contacts_t), intent(in) :: contacts
      !> Thickness of the thinner piece of each contact, (contact) [m]
      real(wp), intent(in) :: thinner(:)
      !> Share of the thinner piece
      real(wp), intent(in) :: limit
      integer(ip) :: c
      logical :: deeper

      deeper = .false.
      !$omp parallel do if (contacts%n > min_parallel_size) schedule(static) default(none) &
      !$omp    shared(contacts, thinner, limit) private(c) reduction(.or.:deeper)
      do c = 1_ip, contacts%n
         deeper = deeper .or. contacts%row(c)%depth > limit*thinner(c)
      end do
      !$omp end parallel do
      any_deeper = deeper
   end function any_deeper

   !> Clause for a message: bodies, position and depth of a contact
   function depth_text(bodies, contacts, thinner, c) result(text)
      type(bodies_t), intent(in) :: bodies
      type(contacts_t), intent(in) :: contacts
      !> Thickness of the thinner piece of each contact, (contact) [m]
      real(wp), intent(in) :: thinner(:)
      !> Index of the contact
      integer(ip), intent(in) :: c
      character(len=:), allocatable :: text

      associate (i => contacts%row(c)%first, j => contacts%row(c)%second)
         text = 'the bodies '//to_text(bodies%id(i))//' and '//to_text(bodies%id(j))//' at ('// &
            to_text(bodies%position(1, i) + contacts%row(c)%arm_first(1))//', '// &
            to_text(bodies%position(2, i) + contacts%row(c)%arm_first(2))//') m overlap by '// &
            to_text(contacts%row(c)%depth, 3)//' m, '// &
            to_text(depth_share(contacts, thinner, c), 3)//' of the thinner body'
      end associate
   end function depth_text

end module polydem_contact_depth
