!> The C interface, whose contract is polydem.h: actions.
module polydem_library_actions
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int64_t, c_long, c_ptr
   use polydem_action_record, only: append_to_record
   use polydem_actions, only: action_t, new_action, remove_bodies
   use polydem_errors, only: input_error, raise
   use polydem_handles, only: enter, error_handle_t, find_error, fortran_text, leave, simulation_handle_t
   use polydem_kinds, only: lp, wp
   use polydem_perform_actions, only: check_action
   use polydem_run_simulation, only: is_over
   implicit none
   private

contains

   !> Record an action, which takes effect at the begin of the next step.
   subroutine polydem_act(error, handle, kind, name, n_bodies, bodies, n_values, values) bind(C)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      !> Name of its kind, and of the wall or load; null: none
      type(c_ptr), value :: kind, name
      !> Number of bodies
      integer(c_long), value :: n_bodies
      !> Their identifiers
      type(c_ptr), value :: bodies
      !> Number of values
      integer(c_long), value :: n_values
      !> The values
      type(c_ptr), value :: values
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self
      type(action_t) :: action

      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      if (allocated(self%failure)) call raise(e%error, input_error, 'the run has stopped: '//self%failure%message)
      if (is_over(self%run)) call raise(e%error, input_error, 'the run is over: no step follows')
      if (.not. allocated(e%error)) call new_action(self%run%simulation%step, fortran_text(kind), &
         fortran_text(name), integers_at(n_bodies, bodies), reals_at(n_values, values), action, e%error)
      if (.not. allocated(e%error)) call check_action(self%run%simulation, action, &
         self%run%simulation%actions%n, e%error)
      if (action%kind == remove_bodies .and. self%run%simulation%loop%step /= self%run%simulation%step) &
         call raise(e%error, input_error, 'bodies cannot be removed before the first step of a run that is resumed')
      if (.not. allocated(e%error) .and. self%run%options%has_files .and. self%run%comm%is_root()) &
         call append_to_record(self%run, action, e%error)
      call self%run%comm%all_reduce_error(e%error)
      if (.not. allocated(e%error)) call self%run%simulation%actions%append(action)
      call leave(self)
   end subroutine polydem_act

   !> Whole numbers of the caller
   function integers_at(n, place) result(copy)
      !> Their number
      integer(c_long), intent(in) :: n
      !> Where they are
      type(c_ptr), intent(in) :: place
      integer(lp), allocatable :: copy(:)
      integer(c_int64_t), pointer :: values(:)

      allocate (copy(0))
      if (n <= 0_c_long .or. .not. c_associated(place)) return
      call c_f_pointer(place, values, [n])
      copy = int(values, lp)
   end function integers_at

   !> Real numbers of the caller
   function reals_at(n, place) result(copy)
      !> Their number
      integer(c_long), intent(in) :: n
      !> Where they are
      type(c_ptr), intent(in) :: place
      real(wp), allocatable :: copy(:)
      real(c_double), pointer :: values(:)

      allocate (copy(0))
      if (n <= 0_c_long .or. .not. c_associated(place)) return
      call c_f_pointer(place, values, [n])
      copy = real(values, wp)
   end function reals_at

end module polydem_library_actions
