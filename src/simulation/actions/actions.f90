!> Actions: what a program that holds a simulation, or a file of its actions, changes between two steps.
!>
!> An action is recorded with the number of steps done, and takes effect at the begin of the next step. So a run with
!> the same actions at the same steps has the same bits, whoever records them. Parameters, velocities and forces hold
!> until they are given others; a stage that begins sets gravity, drag and friction as the namelist says.
!>
!> In a file each action is a line: its step and kind, a name if the kind has one, the number of identifiers and the
!> identifiers if it has them, and its values in SI units. A real number has as many digits as its bits need.
module polydem_actions
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: ip, lp, wp
   use polydem_strings, only: suggestion, to_text
   implicit none
   private
   public :: action_t, actions_t, action_kind_t, action_kinds, kind_of, new_action, line_of, read_action, text_of
   public :: wall_velocity, wall_load, gravity, drag, friction, force, add_bodies, remove_bodies, end_stage, end_run

   !> A kind of actions
   type :: action_kind_t
      !> Name in files
      character(len=13) :: name
      !> What its name is the name of; empty: it has none
      character(len=8) :: object
      !> Whether it has identifiers of bodies, or numbers of corners of bodies that enter
      logical :: has_bodies
      !> Number of values, of those with identifiers for each of them; negative: any number
      integer :: n_values
      !> The values with their units
      character(len=80) :: meaning
   end type action_kind_t

   !> Kinds by their numbers in the table
   integer, parameter :: wall_velocity = 1, wall_load = 2, gravity = 3, drag = 4, friction = 5, force = 6, &
      add_bodies = 7, remove_bodies = 8, end_stage = 9, end_run = 10
   !> Table of kinds
   type(action_kind_t), parameter :: action_kinds(*) = [ &
      action_kind_t('wall_velocity', 'wall', .false., 5, 'velocity [m/s], angular velocity [rad/s], its pivot [m]'), &
      action_kind_t('load', 'load', .false., 1, 'force [N/m] or torque [N] of the load, in place of that of &load'), &
      action_kind_t('gravity', '', .false., 2, 'acceleration of gravity [m/s2]'), &
      action_kind_t('drag', '', .false., 1, 'rate of the drag [1/s]'), &
      action_kind_t('friction', '', .false., 1, 'factor of the friction coefficients of the namelist'), &
      action_kind_t('force', '', .true., 3, 'force [N/m] and torque [N] on each body'), &
      action_kind_t('add', 'material', .true., -1, 'density; velocity, angular velocity and corners of each body'), &
      action_kind_t('remove', '', .true., 0, 'bodies that leave'), &
      action_kind_t('end_stage', '', .false., 0, 'the next step is the last of the present stage'), &
      action_kind_t('end_run', '', .false., 0, 'the next step is the last of the run')]

   !> An action
   type :: action_t
      !> Number of steps done when it was recorded
      integer(lp) :: step = 0_lp
      !> Number of its kind
      integer :: kind = 0
      !> Name of the wall, load or material
      character(len=:), allocatable :: name
      !> Identifiers of bodies, or numbers of corners
      integer(ip), allocatable :: id(:)
      !> Values, those of each body in turn
      real(wp), allocatable :: value(:)
   end type action_t

   !> Actions of a run
   type :: actions_t
      !> Name of their file, for messages; unallocated if the actions come one by one
      character(len=:), allocatable :: file
      !> Number of actions, and of the first of them that has not taken effect
      integer :: n = 0, next = 1
      !> The actions in the order of their steps, (n) or longer
      type(action_t), allocatable :: list(:)
      !> Last step of the run, if an action has decided it
      integer(lp) :: last_step = huge(1_lp)
   contains
      procedure :: append
      procedure :: place
   end type actions_t

contains

   !> Append an action.
   subroutine append(self, action)
      class(actions_t), intent(inout) :: self
      !> The action, of a step that is not before that of the last one
      type(action_t), intent(in) :: action
      type(action_t), allocatable :: longer(:)
      integer :: k

      if (.not. allocated(self%list)) allocate (self%list(8))
      if (self%n == size(self%list)) then
         allocate (longer(2*self%n))
         do k = 1, self%n
            longer(k)%step = self%list(k)%step
            longer(k)%kind = self%list(k)%kind
            call move_alloc(self%list(k)%name, longer(k)%name)
            call move_alloc(self%list(k)%id, longer(k)%id)
            call move_alloc(self%list(k)%value, longer(k)%value)
         end do
         call move_alloc(longer, self%list)
      end if
      self%n = self%n + 1
      self%list(self%n) = action
   end subroutine append

   !> Where an action stands, for a message: 'actions.txt: action 3, after step 200 (load lid)'
   pure function place(self, k) result(text)
      class(actions_t), intent(in) :: self
      !> Number of the action
      integer, intent(in) :: k
      character(len=:), allocatable :: text

      associate (action => self%list(k))
         text = 'action '//to_text(int(k, ip))//', after step '//to_text(action%step)//' ('// &
            trim(action_kinds(action%kind)%name)
         if (action%name /= '') text = text//' '//action%name
         text = text//')'
      end associate
      if (allocated(self%file)) text = self%file//': '//text
   end function place

   !> Number of the kind with a name
   subroutine kind_of(name, kind, error)
      !> The name
      character(len=*), intent(in) :: name
      !> Its number
      integer, intent(out) :: kind
      !> Allocated if there is none
      type(error_t), allocatable, intent(inout) :: error

      do kind = size(action_kinds), 1, -1
         if (action_kinds(kind)%name == name) return
      end do
      call raise(error, input_error, 'there is no action "'//name//'"'//suggestion(name, action_kinds%name))
   end subroutine kind_of

   !> Make an action, and check that its kind has such a name and as many numbers.
   subroutine new_action(step, kind, name, id, value, action, error)
      !> Number of steps done
      integer(lp), intent(in) :: step
      !> Name of its kind, and of the wall or load; empty: none
      character(len=*), intent(in) :: kind, name
      !> Identifiers of bodies
      integer(lp), intent(in) :: id(:)
      !> Values
      real(wp), intent(in) :: value(:)
      type(action_t), intent(out) :: action
      !> Says what is missing or not allowed
      type(error_t), allocatable, intent(inout) :: error
      type(action_kind_t) :: known
      integer :: wanted

      call kind_of(kind, action%kind, error)
      if (allocated(error)) return
      known = action_kinds(action%kind)
      action%step = step
      action%name = name
      action%value = value
      wanted = known%n_values
      if (known%has_bodies) wanted = wanted*size(id)
      if (known%object == '' .and. name /= '') then
         call raise(error, input_error, kind//': it has no name, but "'//name//'" is given')
      else if (known%object /= '' .and. name == '') then
         call raise(error, input_error, kind//': the name of the '//trim(known%object)//' is missing')
      else if (known%has_bodies .neqv. size(id) > 0) then
         call raise(error, input_error, kind//': identifiers of bodies are missing, or not allowed')
      else if (size(value) /= wanted .and. wanted >= 0) then
         call raise(error, input_error, kind//': it has '//to_text(int(size(value), ip))//' values, not '// &
            to_text(int(wanted, ip))//': '//trim(known%meaning))
      else if (any(id < 1_lp .or. id > int(huge(1_ip), lp))) then
         call raise(error, input_error, kind//': an identifier is a whole number from 1, not '//to_text(minval(id)))
      else if (.not. all(abs(value) <= huge(1.0_wp))) then
         call raise(error, input_error, trim(kind//' '//name)//': a value is not finite')
      end if
      if (.not. allocated(error)) action%id = int(id, ip)
   end subroutine new_action

   !> Line of an action in a file
   function line_of(action) result(line)
      type(action_t), intent(in) :: action
      character(len=:), allocatable :: line
      character(len=:), allocatable :: numbers

      line = to_text(action%step)//' '//trim(action_kinds(action%kind)%name)
      if (action%name /= '') line = line//' '//action%name
      if (action_kinds(action%kind)%has_bodies) then
         allocate (character(len=12*(size(action%id) + 1)) :: numbers)
         write (numbers, '(*(1x, i0))') size(action%id), action%id
         line = line//trim(numbers)
         deallocate (numbers)
      end if
      if (size(action%value) == 0) return
      allocate (character(len=50*size(action%value)) :: numbers)
      write (numbers, '(*(1x, g0))') action%value
      line = line//trim(numbers)
   end function line_of

   !> Lines of all actions, as in a file
   function text_of(actions) result(text)
      type(actions_t), intent(in) :: actions
      character(len=:), allocatable :: text
      character(len=:), allocatable :: line
      integer :: bytes, k

      bytes = 0
      do k = 1, actions%n
         bytes = bytes + len(line_of(actions%list(k))) + 1
      end do
      allocate (character(len=bytes) :: text)
      bytes = 0
      do k = 1, actions%n
         line = line_of(actions%list(k))
         text(bytes + 1:bytes + len(line) + 1) = line//new_line('a')
         bytes = bytes + len(line) + 1
      end do
   end function text_of

   !> Read an action from a line.
   subroutine read_action(line, action, error)
      !> The line
      character(len=*), intent(in) :: line
      type(action_t), intent(out) :: action
      !> Says what is wrong
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: rest, word, kind, name
      integer(lp), allocatable :: id(:)
      real(wp), allocatable :: value(:)
      integer(lp) :: n, step
      integer :: n_words, number, status

      rest = line
      call take_word(rest, word)
      read (word, '(i20)', iostat=status) step
      if (status /= 0 .or. verify(word, '0123456789') > 0) call raise(error, input_error, &
         'the line begins with "'//word//'", not with a number of steps')
      call take_word(rest, kind)
      if (.not. allocated(error)) call kind_of(kind, number, error)
      if (allocated(error)) return
      name = ''
      if (action_kinds(number)%object /= '') call take_word(rest, name)
      n = 0_lp
      if (action_kinds(number)%has_bodies) then
         call take_word(rest, word)
         read (word, '(i20)', iostat=status) n
         if (status /= 0 .or. verify(word, '0123456789') > 0 .or. n > len(rest)) call raise(error, input_error, &
            kind//': "'//word//'" is no number of bodies')
      end if
      if (verify(rest, '0123456789+-.eEdD ') > 0) call raise(error, input_error, kind//': "'//rest( &
         verify(rest, '0123456789+-.eEdD '):verify(rest, '0123456789+-.eEdD '))//'" is in no number')
      n_words = number_of_words(rest)
      if (n_words < n) call raise(error, input_error, kind//': there are fewer than '//to_text(n)// &
                                            ' identifiers')
      if (allocated(error)) return
      allocate (id(n), value(n_words - n))
      read (rest, *, iostat=status) id, value
      if (size(id) + size(value) > 0 .and. status /= 0) call raise(error, input_error, kind//': a number is wrong')
      if (.not. allocated(error)) call new_action(step, kind, name, id, value, action, error)
   end subroutine read_action

   !> Number of words in a text, which may be long; blanks separate words
   pure integer function number_of_words(text) result(n)
      !> The text
      character(len=*), intent(in) :: text
      integer :: k

      n = 0
      do k = 1, len(text)
         if (text(k:k) == ' ') cycle
         if (k == 1) then
            n = n + 1
         else if (text(k - 1:k - 1) == ' ') then
            n = n + 1
         end if
      end do
   end function number_of_words

   !> Take the first word from a text.
   subroutine take_word(text, word)
      !> Words with blanks between; on return without the first one
      character(len=:), allocatable, intent(inout) :: text
      !> The first one; empty if there is none
      character(len=:), allocatable, intent(out) :: word
      integer :: last

      text = adjustl(text)
      last = index(text//' ', ' ') - 1
      word = text(:last)
      text = text(last + 1:)
   end subroutine take_word

end module polydem_actions
