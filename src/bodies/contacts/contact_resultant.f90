!> Where the force of a contact acts.
!>
!> The law states a force at the centroid of the overlap, and a torque besides: the normal force times `lever`, that of
!> cohesion, and `couple`. A normal force at another point of the line through the centroid, along the contact, has this
!> torque alone. The tangential force acts along this line, so its moment is the same at each of its points. The point
!> lies within both bodies. What torque is left, as where attraction and repulsion nearly cancel, is a couple.
module polydem_contact_resultant
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: find_resultant

contains

   !> Find the point of the force of a contact, and the couple on its first body; the opposite acts on the second.
   pure subroutine find_resultant(bodies, contacts, c, shift, couple)
      !> Bodies with turned vertices
      type(bodies_t), intent(in) :: bodies
      !> Contacts with their forces
      type(contacts_t), intent(in) :: contacts
      !> Index of the contact
      integer(ip), intent(in) :: c
      !> Vector from the centroid of the overlap to the point (2) [m]
      real(wp), intent(out) :: shift(2)
      !> What is left of the torque [N]
      real(wp), intent(out) :: couple
      real(wp) :: along(2), line(2), place, across

      shift = 0.0_wp
      across = contacts%row(c)%normal_force
      couple = across*contacts%row(c)%lever
      if (contacts%has_cohesion) then
         across = across + inner_product(contacts%row(c)%cohesion(:2), contacts%row(c)%direction)
         couple = couple + contacts%row(c)%cohesion(3)
      end if
      if (contacts%has_couple) couple = couple + contacts%row(c)%couple
      if (.not. abs(couple) > 0.0_wp .or. .not. abs(across) > 0.0_wp) return
      along = [-contacts%row(c)%direction(2), contacts%row(c)%direction(1)]
      line = [-huge(1.0_wp), huge(1.0_wp)]
      call shorten(bodies, contacts%row(c)%first, contacts%row(c)%arm_first, along, line)
      call shorten(bodies, contacts%row(c)%second, contacts%row(c)%arm_second, along, line)
      place = -couple/across
      if (place >= line(1) .and. place <= line(2)) then
         couple = 0.0_wp
      else
         place = max(line(1), min(line(2), place))
         couple = couple + place*across
      end if
      shift = place*along
   end subroutine find_resultant

   !> Shorten a line through a point to the part that is within a body, of several pieces within that with the point.
   pure subroutine shorten(bodies, s, point, along, line)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> The point, relative to the centre of the body, and the direction of the line (2) [m, 1]
      real(wp), intent(in) :: point(2), along(2)
      !> Both ends of the line, distances from the point; never behind it [m]
      real(wp), intent(inout) :: line(2)
      real(wp) :: normal(2), distance, slope
      integer(ip) :: vertices(2), v

      vertices = piece_at(bodies, s, point)
      do v = vertices(1), vertices(2)
         associate (from => bodies%pieces%turned(:, v), to => bodies%pieces%turned(:, next(v, vertices)))
            normal = [to(2) - from(2), from(1) - to(1)]
            ! Rounding may leave the point of a shallow overlap outside.
            distance = max(0.0_wp, -inner_product(normal, point - from))
         end associate
         slope = inner_product(normal, along)
         if (slope > 0.0_wp) line(2) = min(line(2), distance/slope)
         if (slope < 0.0_wp) line(1) = max(line(1), distance/slope)
      end do
   end subroutine shorten

   !> First and last vertex of a body, of several pieces those of the piece within which a point is deepest
   pure function piece_at(bodies, s, point) result(vertices)
      type(bodies_t), intent(in) :: bodies
      !> Slot of the body
      integer(ip), intent(in) :: s
      !> The point, relative to the centre of the body (2) [m]
      real(wp), intent(in) :: point(2)
      integer(ip) :: vertices(2), p
      real(wp) :: deepest, depth

      associate (pieces => bodies%pieces)
         vertices = [pieces%vertex_start(s), pieces%vertex_start(s + 1_ip) - 1_ip]
         if (pieces%most == 1_ip) return
         deepest = -huge(1.0_wp)
         do p = pieces%first(s), pieces%first(s + 1_ip) - 1_ip
            depth = depth_within(bodies, [pieces%start(p), pieces%start(p + 1_ip) - 1_ip], point)
            if (depth <= deepest) cycle
            deepest = depth
            vertices = [pieces%start(p), pieces%start(p + 1_ip) - 1_ip]
         end do
      end associate
   end function piece_at

   !> Least distance of a point from the edges of a polygon; negative outside [m]
   pure real(wp) function depth_within(bodies, vertices, point) result(depth)
      type(bodies_t), intent(in) :: bodies
      !> First and last vertex
      integer(ip), intent(in) :: vertices(2)
      real(wp), intent(in) :: point(2)
      real(wp) :: normal(2)
      integer(ip) :: v

      depth = huge(1.0_wp)
      do v = vertices(1), vertices(2)
         associate (from => bodies%pieces%turned(:, v), to => bodies%pieces%turned(:, next(v, vertices)))
            normal = [to(2) - from(2), from(1) - to(1)]
            depth = min(depth, -inner_product(normal, point - from) &
                        /max(sqrt(inner_product(normal, normal)), tiny(depth)))
         end associate
      end do
   end function depth_within

   !> The vertex behind another one, anticlockwise
   pure integer(ip) function next(v, vertices)
      integer(ip), intent(in) :: v
      !> First and last vertex of the polygon
      integer(ip), intent(in) :: vertices(2)

      next = merge(vertices(1), v + 1_ip, v == vertices(2))
   end function next

   !> Inner product of two vectors
   pure real(wp) function inner_product(first, second)
      real(wp), intent(in) :: first(2), second(2)

      inner_product = first(1)*second(1) + first(2)*second(2)
   end function inner_product

end module polydem_contact_resultant
