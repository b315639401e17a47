!> Scenes of a bench: reads and checks their entries, and runs the simulations that record their traces.
module polydem_bench_scene
   use polydem_errors, only: error_t, input_error, raise
   use polydem_file_system, only: exists
   use polydem_hdf5_file, only: hdf5_file_t
   use polydem_read_settings, only: read_settings
   use polydem_result_files, only: manifest_name, profile_name, trace_name
   use polydem_run, only: run_options_t, result_folder
   use polydem_run_simulation, only: run_simulation
   use polydem_settings, only: settings_t
   use polydem_strings, only: quoted
   implicit none
   private
   public :: scene_t, read_scene, provide_result, provide_trace

   !> A scene of a bench
   type :: scene_t
      !> Name of the scene in results
      character(len=:), allocatable :: name
      !> Entry of the bench namelist: a trace, or a namelist file with overrides
      character(len=:), allocatable :: text
      !> Whether the entry is a trace
      logical :: is_trace = .false.
      !> Path of the trace, which a run records unless `is_trace`
      character(len=:), allocatable :: path
      !> Settings of the run; unallocated if `is_trace`
      type(settings_t), allocatable :: settings
   end type scene_t

contains

   !> Read a scene, and check that its file exists and that a namelist is valid.
   subroutine read_scene(place, text, scene, error, name, folder)
      !> File and line of the entry, for error messages
      character(len=*), intent(in) :: place
      !> The entry: a trace, or a namelist file followed by overrides
      character(len=*), intent(in) :: text
      type(scene_t), intent(out) :: scene
      !> Allocated if the scene cannot be used
      type(error_t), allocatable, intent(inout) :: error
      !> Name of the scene in results; a scene with a name must have a trace or record one
      character(len=*), intent(in), optional :: name
      !> Result folder of its run; absent: the folder in its settings
      character(len=*), intent(in), optional :: folder
      character(len=len(text) + 512), allocatable :: words(:), overrides(:)
      integer :: n

      call split_at_blanks(text, words)
      scene%text = text
      scene%path = trim(words(1))
      scene%name = ''
      if (present(name)) scene%name = name
      if (.not. exists(scene%path, error)) then
         call raise(error, input_error, place//': there is no file '//quoted(scene%path))
         return
      end if
      scene%is_trace = index(scene%path//' ', '.nml ') == 0
      if (scene%is_trace) then
         if (size(words) > 1) call raise(error, input_error, place//': '//quoted(scene%path)//' is not a '// &
            'namelist file (*.nml), so no overrides may follow it')
         if (.not. present(name)) call raise(error, input_error, place//': '//quoted(scene%path)// &
            ' is not a namelist file (*.nml)')
         return
      end if
      n = size(words)
      allocate (overrides(n))
      overrides(:n - 1) = words(2:)
      if (present(folder)) overrides(n) = 'output.folder='//folder
      allocate (scene%settings)
      call read_settings(scene%path, overrides(:merge(n, n - 1, present(folder))), scene%settings, error)
      if (allocated(error)) then
         error%message = place//': '//quoted(text)//': '//error%message
         return
      end if
      if (present(folder)) scene%path = folder//'/'//trace_name
      if (present(name) .and. scene%settings%output%trace_steps == 0) call raise(error, input_error, place//': '// &
         quoted(text)//' records no boxes; set trace_steps in &output, or add output.trace_steps=N after the file name')
   end subroutine read_scene

   !> Run a namelist to its end, unless its result exists.
   subroutine provide_result(settings, error)
      type(settings_t), intent(in) :: settings
      !> Allocated if the run fails, or if the result belongs to other settings
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: folder

      folder = result_folder(settings)
      if (.not. exists(folder//'/'//profile_name, error)) call begin_run(settings, error)
      if (.not. allocated(error)) call check_origin(folder//'/'//profile_name, settings, error)
      if (.not. allocated(error)) call check_end(folder//'/'//profile_name, error)
   end subroutine provide_result

   !> Record the trace of a scene, unless it exists.
   subroutine provide_trace(scene, error)
      type(scene_t), intent(in) :: scene
      !> Allocated if the run fails, or if the trace belongs to other settings
      type(error_t), allocatable, intent(inout) :: error

      if (scene%is_trace) return
      associate (settings => scene%settings)
         if (.not. exists(scene%path, error)) call begin_run(settings, error)
         if (.not. exists(scene%path, error)) then
            call raise(error, input_error, quoted(scene%text)//': the run ended before its trace began; reduce '// &
                       'output.trace_start or increase integrate.duration')
            return
         end if
         call check_origin(scene%path, settings, error)
      end associate
   end subroutine provide_trace

   !> Run a namelist, and replace a result without an end.
   subroutine begin_run(settings, error)
      type(settings_t), intent(in) :: settings
      type(error_t), allocatable, intent(inout) :: error
      logical :: is_old

      if (allocated(error)) return
      is_old = exists(result_folder(settings)//'/'//manifest_name, error)
      if (.not. allocated(error)) call run_simulation(settings, is_old, error, run_options_t(is_brief=.true.))
   end subroutine begin_run

   !> Check that an existing result has the same settings.
   subroutine check_origin(path, settings, error)
      character(len=*), intent(in) :: path
      type(settings_t), intent(in) :: settings
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text

      call read_one_text(path, '/provenance/resolved_input', text, error)
      if (allocated(error)) return
      if (text /= settings%resolved) call raise(error, input_error, path//': was made with other settings than '// &
         'those of '//settings%file//'; remove its folder to make it again, or choose another folder')
   end subroutine check_origin

   !> Check that a run is finished.
   subroutine check_end(path, error)
      character(len=*), intent(in) :: path
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: text

      call read_one_text(path, '/status', text, error)
      if (allocated(error)) return
      if (text /= 'finished') call raise(error, input_error, path//': this run did not finish: '//text)
   end subroutine check_end

   !> Read one text from an HDF5 file.
   subroutine read_one_text(path, name, text, error)
      character(len=*), intent(in) :: path, name
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable, intent(inout) :: error
      type(hdf5_file_t) :: file

      call file%open(path, error)
      if (allocated(error)) return
      call file%read(name, text, error)
      call file%close(error)
   end subroutine read_one_text

   !> Split a text at blanks; commas belong to words. A blank text gives one empty word.
   pure subroutine split_at_blanks(text, words)
      character(len=*), intent(in) :: text
      character(len=*), allocatable, intent(out) :: words(:)
      integer :: k, n, first

      n = 0
      do k = 1, len(text)
         if (text(k:k) /= ' ' .and. text(max(1, k - 1):max(1, k - 1)) == ' ') n = n + 1
      end do
      if (scan(text(:min(1, len(text))), ' ') == 0) n = n + 1
      allocate (words(n))
      first = 1
      do k = 1, n
         first = first + verify(text(first:), ' ') - 1
         words(k) = text(first:first + index(text(first:)//' ', ' ') - 2)
         first = first + len_trim(words(k))
      end do
   end subroutine split_at_blanks

end module polydem_bench_scene
