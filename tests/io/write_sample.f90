!> Writes a small result for the tests of the Python reader.
!>
!>     write_sample FOLDER FRAMES PER_SEGMENT end     close the last segment and write the profile
!>     write_sample FOLDER FRAMES PER_SEGMENT wait    print the number of each frame; at the end wait to be killed
!>
!> Frame k belongs to step k + 1. After an error the program prints the message and ends with its code.
program write_sample
   use, intrinsic :: iso_c_binding, only: c_int
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use polydem_bodies, only: bodies_t
   use polydem_contacts, only: contacts_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, lp, wp
   use polydem_named_values, only: named_values_t
   use polydem_posix_processes, only: c_exit
   use polydem_provenance, only: provenance_t
   use polydem_trajectory_writer, only: trajectory_writer_t
   use sample, only: sample_bodies, sample_contacts, sample_provenance, sample_row, write_sample_profile
   implicit none

   type(error_t), allocatable :: error
   character(len=1024) :: folder, word
   integer(ip) :: frames, per_segment

   call get_command_argument(1, folder)
   call get_command_argument(2, word)
   read (word, *) frames
   call get_command_argument(3, word)
   read (word, *) per_segment
   call get_command_argument(4, word)
   call write_all(trim(folder), error)
   if (allocated(error)) then
      write (error_unit, '(a)') error%message
      flush (error_unit)
      call c_exit(int(error%code, c_int))
   end if

contains

   subroutine write_all(folder, error)
      character(len=*), intent(in) :: folder
      type(error_t), allocatable, intent(inout) :: error
      type(trajectory_writer_t) :: trajectory
      type(provenance_t) :: provenance
      type(bodies_t) :: bodies
      type(contacts_t) :: contacts
      type(named_values_t) :: row
      integer(lp) :: step
      character(len=1) :: answer

      call sample_provenance(provenance)
      call trajectory%open(folder, per_segment, provenance, error)
      do step = 1_lp, int(frames, lp)
         call sample_bodies(step, bodies)
         call sample_contacts(step, contacts)
         call sample_row(step, row)
         call trajectory%write_frame(step, 0.5_wp*real(step, wp), bodies, error, contacts, row)
         if (allocated(error)) return
         if (word /= 'wait') cycle
         write (output_unit, '(i0)') step
         flush (output_unit)
      end do
      if (word == 'wait') then
         read (*, *) answer
      else
         call trajectory%close(error)
         call write_sample_profile(folder, error)
      end if
   end subroutine write_all

end program write_sample
