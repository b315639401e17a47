!> The C interface, whose contract is polydem.h: values and arrays of a simulation by name.
module polydem_library_values
   use, intrinsic :: iso_c_binding, only: c_double, c_f_pointer, c_int, c_int64_t, c_long, c_ptr
   use polydem_actions, only: text_of
   use polydem_added_and_removed, only: number_added
   use polydem_arrays, only: find_array
   use polydem_errors, only: error_t, input_error, raise
   use polydem_gathered_rows, only: number_of_contacts
   use polydem_global_hash, only: hash_all_bodies
   use polydem_handles, only: enter, error_handle_t, find_error, fortran_text, give_text, leave, simulation_handle_t
   use polydem_hash, only: hexadecimal
   use polydem_kinds, only: ip, lp
   use polydem_named_values, only: named_values_t
   use polydem_run_output, only: update_balance
   use polydem_run_simulation, only: is_over
   use polydem_simulation, only: time_of
   use polydem_strings, only: to_text
   use polydem_wall_names, only: wall_names_text
   implicit none
   private

contains

   !> A real value by its name.
   function polydem_real(error, handle, name) bind(C) result(value)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      !> time, dt [s], gravity_x, gravity_y [m/s2], drag [1/s], friction (factor of the coefficients)
      type(c_ptr), value :: name
      real(c_double) :: value
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self

      value = 0.0_c_double
      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      select case (fortran_text(name))
      case ('time')
         value = real(time_of(self%run%simulation), c_double)
      case ('dt')
         value = real(self%run%simulation%dt, c_double)
      case ('gravity_x')
         value = real(self%run%simulation%forces%gravity(1), c_double)
      case ('gravity_y')
         value = real(self%run%simulation%forces%gravity(2), c_double)
      case ('drag')
         value = real(self%run%simulation%forces%drag, c_double)
      case ('friction')
         value = real(self%run%simulation%stages%friction_scale, c_double)
      case default
         call raise(e%error, input_error, 'there is no real value "'//fortran_text(name)//'"')
      end select
      call leave(self)
   end function polydem_real

   !> A whole number by its name.
   function polydem_integer(error, handle, name) bind(C) result(value)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      !> step, n_steps (of the whole run, as far as known), stage (number from 1; 0: none), bodies, contacts, threads,
      !> next_id (identifier of the next body that is added), is_over (1: all steps are done)
      type(c_ptr), value :: name
      integer(c_long) :: value
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self

      value = 0_c_long
      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      associate (s => self%run%simulation)
         select case (fortran_text(name))
         case ('step')
            value = int(s%step, c_long)
         case ('n_steps')
            value = int(s%n_steps, c_long)
         case ('stage')
            value = int(s%stages%number, c_long)
         case ('bodies')
            value = int(s%bodies%n_all, c_long)
         case ('contacts')
            value = int(number_of_contacts(self%run%comm, s%bodies, s%contacts), c_long)
         case ('threads')
            value = int(self%threads, c_long)
         case ('next_id')
            value = int(s%bodies%last_id, c_long) + number_added(s%actions, s%step) + 1_c_long
         case ('is_over')
            value = merge(1_c_long, 0_c_long, is_over(self%run) .and. .not. allocated(self%failure))
         case default
            call raise(e%error, input_error, 'there is no whole number "'//fortran_text(name)//'"')
         end select
      end associate
      call leave(self)
   end function polydem_integer

   !> A text by its name.
   function polydem_text(error, handle, name, buffer, size) bind(C) result(length)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      !> state_hash, stage, settings (resolved), folder, walls (as in the provenance), loads (a name per line),
      !> actions (a line each), energy and series (lines of name, unit and meaning, with tabs between)
      type(c_ptr), value :: name
      !> Where it goes
      type(c_ptr), value :: buffer
      !> Room in characters
      integer(c_long), value :: size
      integer(c_long) :: length
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self
      character(len=:), allocatable :: text

      length = 0_c_long
      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      call find_text(self, fortran_text(name), text, e%error)
      if (.not. allocated(e%error)) length = give_text(text, buffer, size)
      call leave(self)
   end function polydem_text

   !> Find a text.
   subroutine find_text(self, name, text, error)
      type(simulation_handle_t), intent(inout) :: self
      !> As in `polydem_text`
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: text
      !> Allocated if there is no such text
      type(error_t), allocatable, intent(inout) :: error
      integer(lp) :: hash
      integer :: k

      text = ''
      associate (s => self%run%simulation)
         select case (name)
         case ('state_hash')
            call hash_all_bodies(self%run%comm, s%bodies, hash)
            text = hexadecimal(hash)
         case ('stage')
            if (s%stages%number > 0_ip) text = s%settings%stage(s%stages%number)%name
         case ('settings')
            text = self%settings%resolved
         case ('folder')
            if (self%run%options%has_files) text = self%run%folder
         case ('walls')
            text = wall_names_text(s%walls%wall)
         case ('loads')
            if (.not. allocated(s%walls%loads)) return
            do k = 1, size(s%walls%loads)
               text = text//s%walls%loads(k)%name//new_line('a')
            end do
         case ('actions')
            text = text_of(s%actions)
         case ('energy')
            call update_balance(self%run)
            text = lines_of(self%run%row)
         case ('series')
            text = lines_of(s%series%row)
         case default
            call raise(error, input_error, 'there is no text "'//name//'"')
         end select
      end associate
   end subroutine find_text

   !> Name, unit and meaning of named values, a line each
   pure function lines_of(row) result(text)
      type(named_values_t), intent(in) :: row
      character(len=:), allocatable :: text
      integer :: k

      text = ''
      if (.not. allocated(row%label)) return
      do k = 1, size(row%label)
         associate (label => row%label(k))
            text = text//trim(label%name)//achar(9)//trim(label%unit)//achar(9)//trim(label%meaning)//new_line('a')
         end associate
      end do
   end function lines_of

   !> Find an array and keep it to be copied.
   function polydem_find_array(error, handle, name, shape) bind(C) result(kind)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      !> Name of the array
      type(c_ptr), value :: name
      !> Numbers of rows and of values per row
      integer(c_long), intent(out) :: shape(2)
      integer(c_int) :: kind
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self
      integer(lp) :: rows, width
      integer :: found

      kind = 0_c_int
      shape = 0_c_long
      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      call find_array(self, fortran_text(name), rows, width, found, e%error)
      shape = [int(rows, c_long), int(width, c_long)]
      kind = int(found, c_int)
      call leave(self)
   end function polydem_find_array

   !> Copy the whole numbers that were found last.
   subroutine polydem_copy_integers(error, handle, values, size) bind(C)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      !> Where they go
      type(c_ptr), value :: values
      !> Their number
      integer(c_long), value :: size
      integer(c_int64_t), pointer :: target(:)
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self

      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      if (.not. allocated(self%integers)) allocate (self%integers(0))
      call check_size(size, ubound(self%integers, 1, kind=c_long), e%error)
      if (.not. allocated(e%error) .and. size > 0_c_long) then
         call c_f_pointer(values, target, [size])
         target = int(self%integers, c_int64_t)
      end if
      call leave(self)
   end subroutine polydem_copy_integers

   !> Copy the real numbers that were found last.
   subroutine polydem_copy_reals(error, handle, values, size) bind(C)
      type(c_ptr), value :: error
      type(c_ptr), value :: handle
      !> Where they go
      type(c_ptr), value :: values
      !> Their number
      integer(c_long), value :: size
      real(c_double), pointer :: target(:)
      type(error_handle_t), pointer :: e
      type(simulation_handle_t), pointer :: self

      call find_error(error, e)
      if (.not. associated(e)) return
      call enter(handle, self, e%error)
      if (.not. associated(self)) return
      if (.not. allocated(self%reals)) allocate (self%reals(0))
      call check_size(size, ubound(self%reals, 1, kind=c_long), e%error)
      if (.not. allocated(e%error) .and. size > 0_c_long) then
         call c_f_pointer(values, target, [size])
         target = real(self%reals, c_double)
      end if
      call leave(self)
   end subroutine polydem_copy_reals

   !> Refuse to copy to an array of another size.
   subroutine check_size(given, found, error)
      !> Size of the array of the caller, and of the one that was found last
      integer(c_long), intent(in) :: given, found
      type(error_t), allocatable, intent(inout) :: error

      if (given /= found) call raise(error, input_error, 'the array that was found last has '// &
         to_text(int(found, lp))//' values, not '//to_text(int(given, lp)))
   end subroutine check_size

end module polydem_library_values
