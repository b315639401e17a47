!> Bodies that actions add and remove. They enter and leave with those of sources and sinks, at the begin of the next
!> step; a checkpoint and the balance treat them alike.
module polydem_added_and_removed
   use polydem_actions, only: action_t, actions_t, add_bodies, remove_bodies
   use polydem_bodies, only: bodies_t
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_cell, only: cell_t, into_cell, minimum_image
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, lp, wp
   use polydem_pair_parameters, only: density_of, material_number
   use polydem_settings, only: settings_t
   use polydem_simulation, only: simulation_t
   use polydem_sort, only: ascending_order
   use polydem_strings, only: to_text
   implicit none
   private
   public :: removed_after, number_added, append_added, check_addition

contains

   !> Identifiers of the bodies that actions remove after a step, ascending
   pure function removed_after(actions, step, n) result(id)
      type(actions_t), intent(in), allocatable :: actions
      !> Number of steps done
      integer(lp), intent(in) :: step
      !> Number of the actions that count; absent: all
      integer, intent(in), optional :: n
      integer(ip), allocatable :: id(:)
      integer :: k, last

      allocate (id(0))
      if (.not. allocated(actions)) return
      last = actions%n
      if (present(n)) last = n
      do k = last, 1, -1
         if (actions%list(k)%step < step) exit
         if (actions%list(k)%step == step .and. actions%list(k)%kind == remove_bodies) id = [id, actions%list(k)%id]
      end do
      id = id(ascending_order(int(id, lp)))
   end function removed_after

   !> Number of bodies that actions add after a step
   pure integer function number_added(actions, step) result(number)
      type(actions_t), intent(in), allocatable :: actions
      !> Number of steps done
      integer(lp), intent(in) :: step
      integer :: k

      number = 0
      if (.not. allocated(actions)) return
      do k = actions%n, 1, -1
         if (actions%list(k)%step < step) exit
         if (actions%list(k)%step == step .and. actions%list(k)%kind == add_bodies) &
            number = number + size(actions%list(k)%id)
      end do
   end function number_added

   !> Append the bodies that actions add after a step.
   subroutine append_added(settings, cell, actions, step, n, list)
      type(settings_t), intent(in) :: settings
      type(cell_t), intent(in) :: cell
      type(actions_t), intent(in) :: actions
      !> Number of steps done
      integer(lp), intent(in) :: step
      !> Number of the actions that count
      integer, intent(in) :: n
      type(body_list_t), intent(inout) :: list
      integer :: k

      do k = 1, n
         if (actions%list(k)%step == step .and. actions%list(k)%kind == add_bodies) &
            call append_bodies(settings, cell, actions%list(k), list)
      end do
   end subroutine append_added

   !> Append the bodies of an action. In a periodic cell they are their copies there.
   subroutine append_bodies(settings, cell, action, list)
      type(settings_t), intent(in) :: settings
      type(cell_t), intent(in) :: cell
      type(action_t), intent(in) :: action
      type(body_list_t), intent(inout) :: list
      real(wp), allocatable :: corners(:, :)
      real(wp) :: middle(2), density
      integer(ip) :: material
      integer :: first, k, n

      material = 0_ip
      if (action%name /= '-') material = material_number(settings, action%name)
      density = action%value(1)
      if (.not. density > 0.0_wp) density = density_of(settings, material)
      first = 2
      do k = 1, size(action%id)
         n = int(action%id(k))
         associate (motion => action%value(first:first + 2))
            corners = reshape(action%value(first + 3:first + 2 + 2*n), [2, n])
            if (cell%is_periodic) then
               middle = sum(corners, 2)/real(n, wp)
               corners = corners + spread(into_cell(cell, middle) - middle, 2, n)
            end if
            call list%append(corners, density=density, velocity=motion(:2), angular_velocity=motion(3), &
                             material=material)
         end associate
         first = first + 3 + 2*n
      end do
   end subroutine append_bodies

   !> Check that bodies can be added: convex outlines, a material, room. Each rank compares them with its own bodies.
   subroutine check_addition(self, action, before, error)
      type(simulation_t), intent(in) :: self
      !> An action that adds bodies
      type(action_t), intent(in) :: action
      !> Number of the actions before it
      integer, intent(in) :: before
      !> Says what is wrong
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      type(bodies_t) :: added
      integer(ip) :: k
      integer :: axis

      if (any(action%id < 3_ip)) then
         call raise(error, input_error, 'a body has at least three corners')
      else if (size(action%value, kind=lp) /= 1_lp + sum(3_lp + 2_lp*int(action%id, lp))) then
         call raise(error, input_error, 'its values are density, then velocity, angular velocity and corners of '// &
                    'each body')
      else if (action%value(1) < 0.0_wp) then
         call raise(error, input_error, 'the density must be >= 0, not '//to_text(action%value(1)))
      else if (action%name /= '-' .and. material_number(self%settings, action%name) == 0_ip) then
         call raise(error, input_error, 'there is no material "'//action%name//'"')
      end if
      if (allocated(error)) return
      list%has_materials = size(self%settings%material) > 0
      associate (bodies => self%bodies)
         call append_added(self%settings, bodies%cell, self%actions, self%step, before, list)
         call append_bodies(self%settings, bodies%cell, action, list)
         call new_bodies(list, added, error)
         if (allocated(error)) return
         do axis = 1, 2
            if (.not. bodies%cell%size(axis) > 0.0_wp) cycle
            if (any(4.0_wp*(added%radius(:added%n) + self%settings%boxes%margin) >= bodies%cell%size(axis))) &
               call raise(error, input_error, 'a body is too long for the periodic cell')
         end do
      end associate
      do k = added%n - size(action%id, kind=ip) + 1_ip, added%n
         if (.not. allocated(error)) call find_room(self, added, k, before, error)
      end do
   end subroutine check_addition

   !> Check that a body that is added overlaps no other.
   subroutine find_room(self, added, k, before, error)
      type(simulation_t), intent(in) :: self
      !> The bodies that are added
      type(bodies_t), intent(in) :: added
      !> Number of the body among them, of which those before it have room
      integer(ip), intent(in) :: k
      !> Number of the actions before it
      integer, intent(in) :: before
      type(error_t), allocatable, intent(inout) :: error
      integer(ip), allocatable :: removed(:)
      integer(ip) :: s

      removed = removed_after(self%actions, self%step, before)
      do s = 1_ip, k - 1_ip
         if (overlap(added, s, self%bodies%cell%inverse)) call raise(error, input_error, 'body '//to_text(k)// &
            ' of those that are added overlaps body '//to_text(s)//' of them')
      end do
      do s = 1_ip, self%bodies%n
         if (allocated(error)) return
         if (allocated(self%bodies%removed)) then
            if (self%bodies%removed(s)) cycle
         end if
         if (any(removed == self%bodies%id(s))) cycle
         if (self%bodies%fixed(s) .and. allocated(self%bodies%inverse_period)) then
            if (overlap(self%bodies, s, self%bodies%inverse_period(:, s))) call refuse()
         else if (overlap(self%bodies, s, self%bodies%cell%inverse)) then
            call refuse()
         end if
      end do

   contains

      !> Name the body that is in the way.
      subroutine refuse()
         call raise(error, input_error, 'body '//to_text(k)//' of those that are added overlaps '//name_of(self, s))
      end subroutine refuse

      !> Whether the body overlaps another one
      logical function overlap(bodies, s, inverse_period)
         type(bodies_t), intent(in) :: bodies
         !> Slot of the other one
         integer(ip), intent(in) :: s
         !> As of `minimum_image`
         real(wp), intent(in) :: inverse_period(2)
         real(wp) :: offset(2)
         integer(ip) :: p, pieces(2), own(2)

         offset = minimum_image(self%bodies%cell, inverse_period, bodies%position(:, s) - added%position(:, k))
         overlap = .false.
         if (hypotenuse(offset(1), offset(2)) >= bodies%radius(s) + added%radius(k)) return
         own = added%pieces%pieces_of(k)
         pieces = bodies%pieces%pieces_of(s)
         do p = pieces(1), pieces(2)
            overlap = overlap .or. are_joined(added%pieces%turned_piece(own(1)), bodies%pieces%turned_piece(p), offset)
         end do
      end function overlap

   end subroutine find_room

   !> Name of a body in a message: 'the body 3 of the wall floor'
   pure function name_of(self, s) result(text)
      type(simulation_t), intent(in) :: self
      !> Its slot
      integer(ip), intent(in) :: s
      character(len=:), allocatable :: text
      integer(ip) :: wall

      text = 'the body '//to_text(self%bodies%id(s))
      wall = self%walls%wall_of(s)
      if (wall > 0_ip) text = text//' of the wall '//self%walls%wall(wall)%name
   end function name_of

   !> Whether two convex polygons overlap: no edge of either separates them.
   pure logical function are_joined(first, second, offset)
      !> Vertices, anticlockwise, each relative to its own centre, (2, :) [m]
      real(wp), intent(in) :: first(:, :), second(:, :)
      !> Centre of the second minus that of the first [m]
      real(wp), intent(in) :: offset(2)

      are_joined = .not. (separates(first, second, offset) .or. separates(second, first, -offset))
   end function are_joined

   !> Whether an edge of a polygon has all vertices of another one outside
   pure logical function separates(polygon, other, offset)
      real(wp), intent(in) :: polygon(:, :), other(:, :), offset(2)
      real(wp) :: edge(2)
      integer :: k, n

      separates = .true.
      n = size(polygon, 2)
      do k = 1, n
         edge = polygon(:, mod(k, n) + 1) - polygon(:, k)
         if (all((other(1, :) + offset(1) - polygon(1, k))*edge(2) &
                 - (other(2, :) + offset(2) - polygon(2, k))*edge(1) >= 0.0_wp)) return
      end do
      separates = .false.
   end function separates

end module polydem_added_and_removed
