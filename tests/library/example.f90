!> Advance a simulation from Fortran through the C interface: example FILE.nml STEPS
program example
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_long, c_null_char, c_null_ptr, c_ptr
   implicit none

   interface
      function polydem_new_error() bind(C) result(error)
         import :: c_ptr
         type(c_ptr) :: error
      end function polydem_new_error

      function polydem_error_code(error) bind(C) result(code)
         import :: c_int, c_ptr
         type(c_ptr), value :: error
         integer(c_int) :: code
      end function polydem_error_code

      function polydem_new_simulation(error, file, text, n_overrides, overrides, folder, mode, threads) bind(C) &
         result(simulation)
         import :: c_char, c_int, c_long, c_ptr
         type(c_ptr), value :: error
         character(kind=c_char), intent(in) :: file(*)
         type(c_ptr), value :: text
         integer(c_long), value :: n_overrides
         type(c_ptr), value :: overrides
         type(c_ptr), value :: folder
         integer(c_int), value :: mode, threads
         type(c_ptr) :: simulation
      end function polydem_new_simulation

      function polydem_advance(error, simulation, steps, seconds) bind(C) result(done)
         import :: c_double, c_long, c_ptr
         type(c_ptr), value :: error, simulation
         integer(c_long), value :: steps
         real(c_double), value :: seconds
         integer(c_long) :: done
      end function polydem_advance

      function polydem_text(error, simulation, name, buffer, size) bind(C) result(length)
         import :: c_char, c_long, c_ptr
         type(c_ptr), value :: error, simulation
         character(kind=c_char), intent(in) :: name(*)
         character(kind=c_char), intent(out) :: buffer(*)
         integer(c_long), value :: size
         integer(c_long) :: length
      end function polydem_text

      subroutine polydem_delete_simulation(error, simulation) bind(C)
         import :: c_ptr
         type(c_ptr), value :: error
         type(c_ptr), intent(inout) :: simulation
      end subroutine polydem_delete_simulation
   end interface

   type(c_ptr) :: error, simulation
   character(len=1000) :: file, steps
   character(kind=c_char) :: hash(17)
   integer(c_long) :: done, length, n

   call get_command_argument(1, file)
   call get_command_argument(2, steps)
   read (steps, *) n
   error = polydem_new_error()
   simulation = polydem_new_simulation(error, trim(file)//c_null_char, c_null_ptr, 0_c_long, c_null_ptr, c_null_ptr, &
                                       0_c_int, 1_c_int)
   if (polydem_error_code(error) /= 0_c_int) error stop 'the simulation cannot be made'
   done = polydem_advance(error, simulation, n, 0.0_c_double)
   length = polydem_text(error, simulation, 'state_hash'//c_null_char, hash, 17_c_long)
   print '(i0, 1x, 16a)', done, hash(:length)
   call polydem_delete_simulation(error, simulation)
end program example
