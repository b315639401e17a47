!> Guard of contacts that are deep relative to their bodies.
module polydem_overlap_guard
   use polydem_contact_flags, only: flag_deeper
   use polydem_contact_depth, only: any_deeper, deepest_contact, depth_share, depth_text, thinner_pieces
   use polydem_errors, only: error_t
   use polydem_guard, only: shorter_step
   use polydem_kinds, only: dp, ip, wp
   use polydem_settings, only: settings_t
   use polydem_simulation, only: guard_t, simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: overlap_guard_t

   !> Guard of the depth of contacts
   type, extends(guard_t) :: overlap_guard_t
   contains
      procedure :: configure
      procedure :: set_local_limits
      procedure :: look
   end type overlap_guard_t

contains

   !> Set what the guard says of itself.
   subroutine configure(self, settings)
      class(overlap_guard_t), intent(inout) :: self
      type(settings_t), intent(in) :: settings

      self%noun = 'step'
      self%finding = 'with a contact that was too deep'
      self%choice = settings%guards%overlap
   end subroutine configure

   !> Flag contacts that are too deep.
   subroutine set_local_limits(self, simulation)
      class(overlap_guard_t), intent(in) :: self
      type(simulation_t), intent(inout) :: simulation

      if (self%is_on) call flag_deeper(simulation%loop%flag_limits, simulation%settings%guards%overlap_limit, &
                                       simulation%bodies)
   end subroutine set_local_limits

   !> Respond to the deepest contact. The rank with the deepest contact of all ranks reports it, at once if it stops the
   !> run.
   subroutine look(self, simulation, error)
      class(overlap_guard_t), intent(inout) :: self
      type(simulation_t), intent(inout) :: simulation
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text
      real(wp), allocatable :: thinner(:)
      integer(ip) :: worst
      real(dp) :: share

      share = 0.0_dp
      associate (s => simulation, settings => simulation%settings%guards, &
                 pairs => simulation%search%neighbours%pairs)
         thinner = thinner_pieces(s%bodies, s%loop%flagged, pairs%first, pairs%second)
         if (any_deeper(s%loop%flagged, thinner, settings%overlap_limit)) then
            worst = deepest_contact(s%loop%flagged, thinner)
            text = depth_text(s%bodies, s%loop%flagged, thinner, worst)
            share = real(depth_share(s%loop%flagged, thinner, worst), dp)
         end if
         if (settings%overlap == 'stop') call s%comm%all_reduce_text(text, share)
         if (.not. allocated(text)) return
         call self%warning%respond(self%choice, 'step '//to_text(s%step)//': '//text// &
                                   '. Increase stiffness in &forces, remove deep initial overlaps (remove_overlap '// &
                                   'in &scene), or '//shorter_step(s%settings%integrate), error, share)
      end associate
   end subroutine look

end module polydem_overlap_guard
