!> Guard of bodies that pass through each other. The loop over the contacts finds them (`polydem_contact_flags`).
module polydem_tunnelling_guard
   use polydem_contact_flags, only: passing_text
   use polydem_errors, only: error_t
   use polydem_guard, only: guard_t
   use polydem_kinds, only: dp, ip, lp
   use polydem_motion_check, only: place_of, shorter_step
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: tunnelling_guard_t

   !> Guard of tunnelling
   type, extends(guard_t) :: tunnelling_guard_t
   contains
      procedure :: start
      procedure :: look
   end type tunnelling_guard_t

contains

   !> Set what the guard says of itself.
   subroutine start(self, simulation)
      class(tunnelling_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation

      self%noun = 'step'
      self%finding = 'in which a body was passing through another'
      self%choice = simulation%settings%guards%tunnelling
      self%stops_alone = .true.
   end subroutine start

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

end module polydem_tunnelling_guard
