!> Stop at contacts without direction, as a participant of the steps: with `degenerate = 'stop'` in &overlap.
module polydem_undirected_contacts
   use polydem_contact_block, only: is_degenerate
   use polydem_errors, only: error_t, raise, run_error
   use polydem_kinds, only: ip
   use polydem_motion_tests, only: place_error
   use polydem_simulation, only: participant_t, simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: undirected_contacts_t

   !> The stop: a rank that finds such a contact stops all of them
   type, extends(participant_t) :: undirected_contacts_t
   contains
      procedure :: check_contacts
   end type undirected_contacts_t

contains

   !> Stop at the first contact without direction.
   subroutine check_contacts(self, simulation, error)
      class(undirected_contacts_t), intent(in) :: self
      type(simulation_t), intent(in) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      integer(ip) :: c

      associate (unused => self, bodies => simulation%bodies, contacts => simulation%loop%flagged)
         if (contacts%n_degenerate == 0_ip) return
         do c = 1_ip, contacts%n
            if (is_degenerate(contacts%row(c))) exit
         end do
         associate (i => contacts%row(c)%first, j => contacts%row(c)%second)
            call raise(error, run_error, 'step '//to_text(simulation%step)//': the contact of the bodies '// &
                       to_text(bodies%id(i))//' and '//to_text(bodies%id(j))//' near ('// &
                       to_text(bodies%position(1, i))//', '//to_text(bodies%position(2, i))//') m has no '// &
                       'direction: one body is inside the other, or they cross. Set degenerate = ''push'' in '// &
                       '&overlap to continue')
            call place_error(error, bodies, i, j)
         end associate
      end associate
   end subroutine check_contacts

end module polydem_undirected_contacts
