!> Sources and sinks: bodies that enter and leave between two steps.
!>
!> This is the first part of a step, so no checkpoint lies between it and the search for pairs that restores the contact
!> history. Bodies leave first. All ranks draw the same candidates; each marks those that would meet a body of its own,
!> and those that are left are compared with each other in the order in which they were drawn. All ranks decide alike.
module polydem_enter_and_leave
   use polydem_added_and_removed, only: append_added, number_added, removed_after
   use polydem_bodies, only: bodies_t
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_cell, only: cell_t, copies_within, shear_flow
   use polydem_changed_bodies, only: count_entering, find_leaving_totals, n_totals, take_leaving
   use polydem_changed_gravity, only: last_gravity, undo_change
   use polydem_communicator, only: communicator_t
   use polydem_elementary, only: hypotenuse
   use polydem_errors, only: error_t
   use polydem_exact_all_reduce, only: all_reduce_exact_sums
   use polydem_exact_sum, only: exact_sum_t
   use polydem_force_sums, only: energy_of_contact
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_ownership, only: owns_pair
   use polydem_replace_bodies, only: replace_bodies
   use polydem_room, only: list_near, meets_any, meets_fixed, put_candidates
   use polydem_simulation, only: simulation_t, time_of
   use polydem_sort, only: ascending_order, place_in
   use polydem_source, only: candidate_t, source_t
   use polydem_sources_and_sinks, only: departure_t, is_due, number_of_values
   use polydem_wall_energy, only: release_energy
   implicit none
   private
   public :: enter_and_leave, find_leaving

contains

   !> Let bodies leave and enter before a step, if it is time. Collective; all ranks get the same error.
   subroutine enter_and_leave(self, error)
      !> The simulation between two steps
      type(simulation_t), intent(inout) :: self
      !> Allocated if there are no identifiers left
      type(error_t), allocatable, intent(inout) :: error
      type(departure_t) :: departing
      type(body_list_t) :: list
      type(bodies_t) :: added
      logical, allocatable :: kept(:)
      integer, allocatable :: origin(:)

      if (.not. (self%sources_and_sinks%has_event(self%step) .or. number_added(self%actions, self%step) > 0 &
                 .or. size(removed_after(self%actions, self%step)) > 0)) return
      call find_leaving(self)
      call list_departures(self, departing, kept)
      list%rank = self%comm%rank
      list%n_ranks = self%comm%size
      list%has_materials = size(self%settings%material) > 0
      call list_entries(self, size(departing%id, kind=lp), kept, list, origin)
      if (size(departing%id) > 0) then
         if (self%settings%output%energy_balance) then
            call undo_change(self%energy_balance, self%comm, self%dt, self%forces%gravity, self%bodies, .not. kept)
            call take_leaving(self%energy_balance, self%dt, last_gravity(self%energy_balance, self%forces%gravity), &
                              self%sources_and_sinks%leaving(:n_totals))
            call release_energy(self%energy_balance, self%sources_and_sinks%leaving(n_totals + 1))
         end if
         call self%sources_and_sinks%keep_departures(self%step + 1_lp, real(self%step + 1_lp, dp)*real(self%dt, dp), &
                                                    departing)
      end if
      if (allocated(self%sources_and_sinks%leaving)) deallocate (self%sources_and_sinks%leaving)
      if (size(departing%id) == 0 .and. list%n == 0_ip) return
      call new_bodies(list, added, error)
      call self%comm%all_reduce_error(error)
      if (allocated(error)) return
      call count_masses(self%comm, added, origin, self%sources_and_sinks%sources)
      if (self%settings%output%energy_balance) call count_entering(self%energy_balance, self%comm, self%dt, &
         self%forces%gravity, added)
      call replace_bodies(self, kept, added, error)
   end subroutine enter_and_leave

   !> Count the masses of bodies that enter, in the order of their identifiers. Collective.
   subroutine count_masses(comm, added, origin, sources)
      class(communicator_t), intent(inout) :: comm
      !> Bodies of this rank that enter
      type(bodies_t), intent(in) :: added
      !> Number of the source of each one of all ranks
      integer, intent(in) :: origin(:)
      type(source_t), intent(inout) :: sources(:)
      integer(lp), allocatable :: index(:)
      real(dp), allocatable :: mass(:)
      integer(ip), allocatable :: counts(:), order(:)
      integer :: k

      call comm%gather(int(added%global_index, lp), index, counts)
      call comm%gather(real(added%mass, dp), mass, counts)
      order = ascending_order(index)
      do k = 1, size(order)
         if (origin(k) == 0) cycle
         associate (source => sources(origin(k)))
            source%mass = source%mass + real(mass(order(k)), wp)
         end associate
      end do
   end subroutine count_masses

   !> Find what the balance must know of the bodies that leave before the next step, unless a restart has read it: their
   !> totals, and the elastic energy of their contacts. Collective.
   subroutine find_leaving(self)
      !> The simulation between two steps; `leaving` of its sources and sinks is set
      type(simulation_t), intent(inout) :: self
      type(departure_t) :: departing
      type(exact_sum_t) :: released(1)
      logical, allocatable :: kept(:)
      real(wp) :: total(n_totals)
      integer(ip) :: c

      if (.not. allocated(self%sources_and_sinks)) return
      if (self%loop%step /= self%step .or. .not. self%settings%output%energy_balance) return
      if (allocated(self%sources_and_sinks%leaving)) deallocate (self%sources_and_sinks%leaving)
      call list_departures(self, departing, kept)
      if (size(departing%id) == 0) return
      call find_leaving_totals(self%energy_balance, self%comm, &
                               last_gravity(self%energy_balance, self%forces%gravity), self%bodies, &
                               self%loop%force_sums, self%loop%walls, .not. kept, total)
      associate (contacts => self%contacts, bodies => self%bodies)
         if (self%loop%walls%energy_is_known) then
            do c = 1_ip, contacts%n
               if (.not. owns_pair(bodies, contacts%row(c)%first, contacts%row(c)%second)) cycle
               if (stays(contacts%row(c)%first) .and. stays(contacts%row(c)%second)) cycle
               ! The energy of a contact with a wall that is removed now leaves with the wall.
               if (is_removed(contacts%row(c)%first) .or. is_removed(contacts%row(c)%second)) cycle
               call released(1)%add(energy_of_contact(contacts, c))
            end do
         end if
      end associate
      call all_reduce_exact_sums(self%comm, released)
      self%sources_and_sinks%leaving = [total, released%value()]

   contains

      !> Whether a body is of a wall that is removed before the next step
      pure logical function is_removed(s)
         integer(ip), intent(in) :: s
         integer(ip) :: wall

         is_removed = .false.
         wall = self%walls%wall_of(s)
         if (wall > 0_ip) is_removed = time_of(self) >= self%walls%wall(wall)%vanish_at .and. &
            .not. self%walls%wall(wall)%is_removed
      end function is_removed

      !> Whether a body stays, also one of another rank
      pure logical function stays(s)
         integer(ip), intent(in) :: s
         integer :: k

         k = int(place_in(int(departing%id, ip), self%bodies%id(s)))
         stays = .true.
         if (k <= size(departing%id)) stays = departing%id(k) /= int(self%bodies%id(s), lp)
      end function stays

   end subroutine find_leaving

   !> List the bodies that leave before the next step. Collective.
   subroutine list_departures(self, departing, kept)
      type(simulation_t), intent(inout) :: self
      !> These bodies of all ranks
      type(departure_t), intent(out) :: departing
      !> Whether each body of this rank stays, (slot)
      logical, allocatable, intent(out) :: kept(:)
      integer(lp), allocatable :: mine(:), all_of_them(:)
      real(dp), allocatable :: values(:), all_values(:)
      integer(ip), allocatable :: counts(:), order(:)
      integer(ip), allocatable :: removed(:)
      integer(ip) :: j, k, material, w

      allocate (kept(self%bodies%n), source=.true.)
      allocate (departing%id(0), departing%sink(0), departing%value(number_of_values, 0))
      removed = removed_after(self%actions, self%step)
      if (.not. self%sources_and_sinks%has_departures(self%step) .and. size(removed) == 0) return
      allocate (mine(0), values(0))
      do k = 1_ip, size(self%bodies%free, kind=ip)
         associate (s => self%bodies%free(k), bodies => self%bodies)
            w = sink_of(self, bodies%position(:, s))
            if (w == 0_ip) then
               j = place_in(removed, bodies%id(s))
               if (j > size(removed)) cycle
               if (removed(j) /= bodies%id(s)) cycle
            end if
            kept(s) = .false.
            mine = [mine, int(bodies%id(s), lp), int(w, lp)]
            material = 0_ip
            if (allocated(bodies%material)) material = bodies%material(s)
            values = [values, real([bodies%mass(s), bodies%velocity(:, s), bodies%position(:, s), &
                                    real(material, wp)], dp)]
         end associate
      end do
      call self%comm%gather(mine, all_of_them, counts)
      call self%comm%gather(values, all_values, counts)
      order = ascending_order(all_of_them(1::2))
      departing%id = all_of_them(2*order - 1)
      departing%sink = all_of_them(2*order)
      deallocate (departing%value)
      allocate (departing%value(number_of_values, size(order)))
      do k = 1_ip, size(order, kind=ip)
         departing%value(:, k) = all_values((order(k) - 1)*number_of_values + 1:order(k)*number_of_values)
      end do

   end subroutine list_departures

   !> Number of the first sink in which a body or a copy of it is; 0: none
   pure integer(ip) function sink_of(self, point) result(number)
      type(simulation_t), intent(in) :: self
      !> Place of the body [m]
      real(wp), intent(in) :: point(2)

      do number = 1_ip, size(self%sources_and_sinks%sinks, kind=ip)
         associate (sink => self%sources_and_sinks%sinks(number))
            if (copies_within(self%bodies%cell, sink%settings%low, sink%settings%high, point) == 0_ip) cycle
            if (is_due(sink%settings%interval, sink%stage, self%step, self%stages%number)) return
         end associate
      end do
      number = 0_ip
   end function sink_of

   !> List the bodies that enter before the next step. Collective.
   subroutine list_entries(self, n_leaving, kept, list, origin)
      type(simulation_t), intent(inout) :: self
      !> Number of bodies that leave
      integer(lp), intent(in) :: n_leaving
      !> Whether each body stays
      logical, intent(in) :: kept(:)
      !> Bodies that enter
      type(body_list_t), intent(inout) :: list
      !> Number of the source of each of them
      integer, allocatable, intent(out) :: origin(:)
      type(candidate_t), allocatable :: candidates(:)
      integer(lp), allocatable :: is_blocked(:)
      real(wp), allocatable :: circles(:, :)
      integer(lp) :: first, n_free, wanted
      integer :: k, n_entered

      allocate (circles(3, 0), origin(0))
      if (number_added(self%actions, self%step) > 0) call admit_added(self, circles, list, origin)
      do k = 1, size(self%sources_and_sinks%sources)
         associate (source => self%sources_and_sinks%sources(k))
            if (.not. is_due(source%settings%interval, source%stage, self%step, self%stages%number)) cycle
            n_free = int(self%bodies%n_all - count(self%bodies%fixed, kind=ip) + list%n, lp) - n_leaving
            first = 0_lp
            if (source%stage > 0_ip) first = self%stages%first(source%stage)
            wanted = source%wanted(n_free, self%step, first, self%dt)
            if (wanted == 0_lp) cycle
            call source%draw_candidates(wanted, candidates)
            call put_candidates(self%bodies, candidates)
            call mark_blocked(self, source, candidates, kept, is_blocked)
            call self%comm%all_reduce_max(is_blocked)
            call admit(self, source, candidates, is_blocked, circles, list, n_entered)
            origin = [origin, spread(k, 1, n_entered)]
            if (n_entered < size(candidates)) source%blocked = source%blocked + 1_lp
         end associate
      end do
   end subroutine list_entries

   !> Append the bodies that actions add, before those of sources.
   subroutine admit_added(self, circles, list, origin)
      type(simulation_t), intent(in) :: self
      !> Circles around the bodies that enter; those of these are appended
      real(wp), allocatable, intent(inout) :: circles(:, :)
      type(body_list_t), intent(inout) :: list
      !> Number of the source of each body that enters; 0: none
      integer, allocatable, intent(inout) :: origin(:)
      type(body_list_t) :: whole
      type(bodies_t) :: added
      type(error_t), allocatable :: known
      integer(ip) :: k

      call append_added(self%settings, self%bodies%cell, self%actions, self%step, self%actions%n, list)
      ! All ranks must know their circles.
      call append_added(self%settings, self%bodies%cell, self%actions, self%step, self%actions%n, whole)
      call new_bodies(whole, added, known)
      if (allocated(known)) return
      do k = 1_ip, added%n
         circles = reshape([circles, added%position(:, k), added%radius(k)], [3, size(circles, 2) + 1])
         origin = [origin, 0]
      end do
   end subroutine admit_added

   !> Mark the places at which a candidate would meet a body of this rank.
   subroutine mark_blocked(self, source, candidates, kept, is_blocked)
      type(simulation_t), intent(in) :: self
      type(source_t), intent(in) :: source
      type(candidate_t), intent(in) :: candidates(:)
      logical, intent(in) :: kept(:)
      !> 1: it would, (place of the first candidate, ..., place of the last one)
      integer(lp), allocatable, intent(out) :: is_blocked(:)
      real(wp), allocatable :: near(:, :)
      real(wp) :: middle(2), reach, place(2)
      integer :: j, k, n

      middle = 0.5_wp*(source%settings%low + source%settings%high)
      reach = hypotenuse(source%settings%high(1) - middle(1), source%settings%high(2) - middle(2)) &
         + 2.0_wp*maxval(candidates%radius)
      call list_near(self%bodies, middle, reach, kept, near)
      allocate (is_blocked(size(candidates)*size(candidates(1)%place, 2)), source=0_lp)
      n = 0
      do k = 1, size(candidates)
         do j = 1, size(candidates(k)%place, 2)
            n = n + 1
            place = candidates(k)%place(:, j)
            if (meets_any(self%bodies, place, candidates(k)%radius, near) .or. &
                meets_fixed(self%bodies, place, candidates(k)%radius)) is_blocked(n) = 1_lp
         end do
      end do
   end subroutine mark_blocked

   !> Append the candidates that find room, in the order in which they were drawn, up to the first one that does not.
   subroutine admit(self, source, candidates, is_blocked, circles, list, n_entered)
      type(simulation_t), intent(in) :: self
      type(source_t), intent(inout) :: source
      type(candidate_t), intent(in) :: candidates(:)
      integer(lp), intent(in) :: is_blocked(:)
      !> Circles around the bodies that enter; those of these are appended
      real(wp), allocatable, intent(inout) :: circles(:, :)
      type(body_list_t), intent(inout) :: list
      !> Number of bodies that enter
      integer, intent(out) :: n_entered
      integer :: j, k, n, n_places

      n_places = size(candidates(1)%place, 2)
      n_entered = 0
      do k = 1, size(candidates)
         n = 0
         do j = 1, n_places
            if (is_blocked((k - 1)*n_places + j) == 1_lp) cycle
            if (meets_any(self%bodies, candidates(k)%place(:, j), candidates(k)%radius, circles)) cycle
            n = j
            exit
         end do
         if (n == 0) return
         circles = reshape([circles, candidates(k)%place(:, n), candidates(k)%radius], [3, size(circles, 2) + 1])
         call append_candidate(self%bodies%cell, source, candidates(k), candidates(k)%place(:, n), list)
         n_entered = n_entered + 1
      end do
   end subroutine admit

   !> Append a body that enters. Its velocity is that of the source, relative to the shear of the cell.
   subroutine append_candidate(cell, source, candidate, place, list)
      type(cell_t), intent(in) :: cell
      type(source_t), intent(inout) :: source
      type(candidate_t), intent(in) :: candidate
      !> Its place [m]
      real(wp), intent(in) :: place(2)
      type(body_list_t), intent(inout) :: list
      real(wp) :: flow(3)

      flow = shear_flow(cell, place(2))
      call list%append(candidate%corners + spread(place, 2, size(candidate%corners, 2)), density=source%density, &
                       velocity=source%settings%velocity + flow(:2), material=source%material, piece=candidate%piece)
      source%entered = source%entered + 1_lp
      source%shapes = candidate%after
   end subroutine append_candidate

end module polydem_enter_and_leave
