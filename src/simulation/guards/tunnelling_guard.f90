!> Guard of bodies that pass through each other. The loop over the contacts finds them (`polydem_contact_flags`).
module polydem_tunnelling_guard
   use polydem_bodies, only: bodies_t
   use polydem_contact_flags, only: centre_inside, flag_deeper, former_direction, least_depth
   use polydem_contact_history, only: add_column, column_of
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_guard, only: shorter_step
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_motion_tests, only: place_of
   use polydem_settings, only: settings_t
   use polydem_simulation, only: guard_t, simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: tunnelling_guard_t

   !> Guard of tunnelling
   type, extends(guard_t) :: tunnelling_guard_t
   contains
      procedure :: configure
      procedure :: set_local_limits
      procedure :: look
   end type tunnelling_guard_t

contains

   !> Set what the guard says of itself.
   subroutine configure(self, settings)
      class(tunnelling_guard_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings

      self%noun = 'step'
      self%finding = 'in which a body was passing through another'
      self%choice = settings%guards%tunnelling
      self%stops_alone = .true.
   end subroutine configure

   !> Flag deep contacts, and let the contact history keep their directions.
   subroutine set_local_limits(self, simulation)
      class(tunnelling_guard_t), intent(in) :: self
      type(simulation_t), intent(inout) :: simulation

      if (.not. self%is_on) return
      call flag_deeper(simulation%loop%flag_limits, least_depth, simulation%bodies)
      call add_column(simulation%history, former_direction, 0_ip)
      simulation%loop%flag_limits%column = column_of(simulation%history, former_direction%name)
   end subroutine set_local_limits

   !> Respond to bodies that pass through each other. The rank with the first such pair of all ranks reports it.
   subroutine look(self, simulation, error)
      class(tunnelling_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: found
      integer(lp) :: place

      if (simulation%loop%passing_pair == 0_ip .or. allocated(error)) return
      associate (s => simulation, flagged => simulation%loop%flagged)
         found = findloc(flagged%row(:flagged%n)%pair, s%loop%passing_pair, dim=1)
         place = place_of(s%bodies, flagged%row(found)%first, flagged%row(found)%second)
         call self%warning%respond(self%choice, 'step '//to_text(s%step)//': '// &
                                   passing_text(s%bodies, flagged, s%bodies%radius, found, &
                                                shorter_step(s%settings%integrate)), error, -real(place, dp))
      end associate
      if (allocated(error)) error%place = place
   end subroutine look

   !> Message about a contact whose bodies pass through each other
   function passing_text(bodies, contacts, radius, c, shorter_step) result(text)
      !> Bodies at the end of the step
      type(bodies_t), intent(in) :: bodies
      !> Contacts of the step
      type(contacts_t), intent(in) :: contacts
      !> Greatest distance of a vertex from the centre of each body, (slot) [m]
      real(wp), intent(in) :: radius(:)
      !> Index of the contact
      integer(ip), intent(in) :: c
      !> Clause that says how to shorten the time step
      character(len=*), intent(in) :: shorter_step
      character(len=:), allocatable :: text

      associate (i => contacts%row(c)%first, j => contacts%row(c)%second)
         if (bodies%pieces%most > 1_ip) then
            text = 'of the contact of the bodies '//to_text(bodies%id(i))//' and '//to_text(bodies%id(j))//' at ('// &
               to_text(bodies%position(1, i) + contacts%row(c)%arm_first(1))//', '// &
               to_text(bodies%position(2, i) + contacts%row(c)%arm_first(2))// &
               ') m a piece has its centre inside the other, or the direction changed by more than 90 degrees'
         else if (centre_inside(bodies, radius, i, j)) then
            text = centre_text(i, j)
         else if (centre_inside(bodies, radius, j, i)) then
            text = centre_text(j, i)
         else
            text = 'the contact of the bodies '//to_text(bodies%id(i))//' and '//to_text(bodies%id(j))//' at ('// &
               to_text(bodies%position(1, i) + contacts%row(c)%arm_first(1))//', '// &
               to_text(bodies%position(2, i) + contacts%row(c)%arm_first(2))// &
               ') m changed its direction by more than 90 degrees in the step'
         end if
      end associate
      text = text//': one may pass through the other. Increase the stiffness, use thicker or slower bodies, or '// &
         shorter_step

   contains

      function centre_text(s, other) result(words)
         integer(ip), intent(in) :: s, other
         character(len=:), allocatable :: words

         words = 'the centre of body '//to_text(bodies%id(s))//' at ('//to_text(bodies%position(1, s))//', '// &
            to_text(bodies%position(2, s))//') m is inside body '//to_text(bodies%id(other))
      end function centre_text

   end function passing_text

end module polydem_tunnelling_guard
