!> The force law of a run, a list of parts. It knows no part by name; `polydem_law_factory` does.
!>
!> The `stage` of a part gives its place in the list. A law may have a constraint on velocities, which acts when all
!> other forces on the bodies are known.
module polydem_force_law
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: contact_block_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_contact_history, only: contact_history_t, history_kind_t
   use polydem_errors, only: error_t
   use polydem_force_part, only: force_part_t, resting_block_t, softness_fit_t, stage_elastic, stage_on_damping
   use polydem_kinds, only: ip, wp
   use polydem_overlap_measure, only: overlap_measure_t
   use polydem_pair_entries, only: n_pair_entries
   use polydem_pair_parameters, only: pair_parameters_t, uniform_parameters
   use polydem_settings, only: forces_settings_t, settings_t
   use polydem_velocity_constraint, only: velocity_constraint_t
   implicit none
   private
   public :: force_law_t

   !> A part of any type
   type :: part_holder_t
      !> The part
      class(force_part_t), allocatable :: part
   end type part_holder_t

   !> A force law: its parts in the order in which they act, and their requirements
   type :: force_law_t
      type(part_holder_t), allocatable, private :: parts(:)
      !> Parameters that may differ between pairs of materials; not allocated before the first part
      type(pair_parameters_t), allocatable :: pairs
      !> Constraint that acts after all parts; not allocated if there is none
      class(velocity_constraint_t), allocatable :: constraint
      !> First columns of the contact history, in this order; not allocated before `choose_parts`
      type(history_kind_t), allocatable :: history_kinds(:)
      !> How far the law is from rigid
      type(softness_fit_t) :: fit
      !> How the law measures overlaps
      type(overlap_measure_t) :: overlap_measure
      !> Whether a part adds to the column `cohesion`
      logical :: needs_cohesion = .false.
      !> Whether a part adds to the column `couple`
      logical :: needs_couple = .false.
      !> Whether a part needs the shares of contacts between the same two bodies
      logical :: needs_shares = .false.
      !> Whether a part needs the accelerations of the last step
      logical :: needs_accelerations = .false.
      !> Whether the energy of all elastic forces is known: half of elastic area/length, and that of cohesion
      logical :: energy_is_known = .false.
      !> Names of the parts, for `polydem check` and the log
      character(len=:), allocatable :: description
      !> Parameters that the log has for each pair of materials, by their places in `pair_entries`
      logical :: logged(n_pair_entries) = .false.
   contains
      procedure, private :: add_part
      procedure, private :: add_constraint
      !> Add a part or a constraint with the parameters of the settings
      generic :: add => add_part, add_constraint
      procedure :: collect_needs
      procedure :: measure
      procedure :: scale_friction
      procedure :: check
      procedure :: apply
      procedure :: apply_elastic
      procedure :: stiffen
      procedure :: static_depth
      procedure :: undamped_warning
      procedure :: rest_note
   end type force_law_t

contains

   !> Add a part with the parameters of the settings. Parts are sorted by their stages.
   subroutine add_part(law, new, settings)
      !> The law; `collect_needs` must follow the last part
      class(force_law_t), intent(inout) :: law
      !> The part with its name
      class(force_part_t), intent(in) :: new
      type(forces_settings_t), intent(in) :: settings
      type(part_holder_t), allocatable :: longer(:)
      class(force_part_t), allocatable :: part
      integer :: k, n, place

      if (.not. allocated(law%pairs)) law%pairs = uniform_parameters(settings)
      if (.not. allocated(law%parts)) allocate (law%parts(0))
      allocate (part, source=new)
      call part%configure(settings, law%pairs)
      n = size(law%parts)
      place = 1
      do k = 1, n
         if (law%parts(k)%part%stage <= part%stage) place = k + 1
      end do
      allocate (longer(n + 1))
      do k = 1, n
         call move_alloc(law%parts(k)%part, longer(merge(k, k + 1, k < place))%part)
      end do
      call move_alloc(part, longer(place)%part)
      call move_alloc(longer, law%parts)
   end subroutine add_part

   !> Set the constraint, with the parameters of the settings. A law has at most one.
   subroutine add_constraint(law, new, settings)
      class(force_law_t), intent(inout) :: law
      !> The constraint with its name
      class(velocity_constraint_t), intent(in) :: new
      type(forces_settings_t), intent(in) :: settings

      if (.not. allocated(law%pairs)) law%pairs = uniform_parameters(settings)
      if (allocated(law%constraint)) deallocate (law%constraint)
      allocate (law%constraint, source=new)
      call law%constraint%configure(settings, law%pairs)
   end subroutine add_constraint

   !> Collect the requirements, the contact history and the names of the parts.
   subroutine collect_needs(law)
      class(force_law_t), intent(inout) :: law
      integer :: k

      if (allocated(law%history_kinds)) deallocate (law%history_kinds)
      allocate (law%history_kinds(0))
      law%description = ''
      do k = 1, size(law%parts)
         associate (part => law%parts(k)%part)
            if (part%stage == stage_elastic) then
               law%overlap_measure = part%overlap_measure
               law%fit = part%fit
               law%needs_shares = law%needs_shares .or. part%overlap_measure%per_length
            end if
            law%needs_cohesion = law%needs_cohesion .or. part%needs_cohesion
            law%needs_couple = law%needs_couple .or. part%needs_couple
            law%needs_shares = law%needs_shares .or. part%needs_shares
            law%needs_accelerations = law%needs_accelerations .or. part%needs_accelerations
            law%energy_is_known = law%energy_is_known .or. part%energy_is_known
            part%first_column = size(law%history_kinds) + 1
            if (allocated(part%history_kinds)) law%history_kinds = [law%history_kinds, part%history_kinds]
            if (allocated(part%logged)) law%logged(part%logged) = .true.
            if (k > 1 .and. part%stage /= stage_on_damping) law%description = law%description//','
            law%description = law%description//' '//trim(part%name)
         end associate
      end do
      if (allocated(law%constraint)) then
         associate (part => law%constraint)
            part%first_column = size(law%history_kinds) + 1
            if (allocated(part%history_kinds)) law%history_kinds = [law%history_kinds, part%history_kinds]
            if (allocated(part%logged)) law%logged(part%logged) = .true.
            law%description = law%description//', '//trim(part%name)
         end associate
      end if
      do k = 1, size(law%parts)
         law%parts(k)%part%friction_column = column_of_friction(law%history_kinds)
         associate (part => law%parts(k)%part)
            if (part%needs_cohesion .and. .not. part%cohesion_has_energy) law%energy_is_known = .false.
         end associate
      end do
      law%overlap_measure%with_area = law%needs_cohesion
      law%description = trim(adjustl(law%description))
   end subroutine collect_needs

   !> Column of the contact history with the force of friction of the last step; 0 if there is none
   pure integer function column_of_friction(kinds) result(column)
      type(history_kind_t), intent(in) :: kinds(:)

      do column = size(kinds), 1, -1
         if (kinds(column)%name == 'tangential') exit
      end do
   end function column_of_friction

   !> Let the parts measure the bodies.
   subroutine measure(law, bodies)
      class(force_law_t), intent(inout) :: law
      !> Bodies, for their shapes
      type(bodies_t), intent(in) :: bodies
      integer :: k

      do k = 1, size(law%parts)
         call law%parts(k)%part%measure(bodies)
      end do
      if (allocated(law%constraint)) call law%constraint%measure(bodies)
   end subroutine measure

   !> Scale all friction coefficients relative to those of the settings.
   subroutine scale_friction(law, factor)
      class(force_law_t), intent(inout) :: law
      !> The factor; with 0 there is no friction, but the contact history stays
      real(wp), intent(in) :: factor
      integer :: k

      do k = 1, size(law%parts)
         call law%parts(k)%part%scale_friction(factor)
      end do
      if (allocated(law%constraint)) call law%constraint%scale_friction(factor)
   end subroutine scale_friction

   !> Refuse settings that exclude a part of the law.
   subroutine check(law, settings, n_processes, error)
      class(force_law_t), intent(in) :: law
      type(settings_t), intent(in) :: settings
      !> Number of ranks
      integer(ip), intent(in) :: n_processes
      !> Allocated if a setting is refused; names the entry and the remedy
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, size(law%parts)
         call law%parts(k)%part%check(settings, n_processes, error)
      end do
      if (allocated(law%constraint)) call law%constraint%check(settings, n_processes, error)
   end subroutine check

   !> Compute the normal and tangential forces of a block of contacts.
   subroutine apply(law, bodies, dt, block, history)
      class(force_law_t), intent(in) :: law
      !> Bodies with the positions and velocities of this step
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s]; 0 at the start of a run
      real(wp), intent(in) :: dt
      !> Contacts; `elastic`, `cohesion`, `normal_force`, `tangential_force` and `couple` are set
      type(contact_block_t), intent(inout) :: block
      !> Contact history; only the pairs of these contacts change
      type(contact_history_t), intent(inout) :: history
      integer :: k

      block%has_cohesion = law%needs_cohesion
      associate (n => block%n)
         block%elastic(:n) = 0.0_wp
         if (law%needs_cohesion) block%cohesion(:n, :) = 0.0_wp
         block%normal_force(:n) = 0.0_wp
         block%tangential_force(:n) = 0.0_wp
         block%couple(:n) = 0.0_wp
         if (law%needs_couple) block%dashpot(:n) = 0.0_wp
      end associate
      do k = 1, size(law%parts)
         call law%parts(k)%part%add(bodies, dt, block, history)
      end do
   end subroutine apply

   !> Compute the elastic forces of a block of contacts, and its characteristic lengths.
   subroutine apply_elastic(law, bodies, block, history)
      class(force_law_t), intent(in) :: law
      !> Bodies with the positions of this step
      type(bodies_t), intent(in) :: bodies
      !> Contacts; `inverse_length`, `lever`, `elastic` and `normal_force` are set
      type(contact_block_t), intent(inout) :: block
      !> Contact history
      type(contact_history_t), intent(inout) :: history
      integer :: k

      block%elastic(:block%n) = 0.0_wp
      block%normal_force(:block%n) = 0.0_wp
      do k = 1, size(law%parts)
         if (law%parts(k)%part%stage == stage_elastic) call law%parts(k)%part%add(bodies, 0.0_wp, block, history)
      end do
   end subroutine apply_elastic

   !> Add the springs and dashpots of all parts to those of a contact.
   subroutine stiffen(law, element)
      class(force_law_t), intent(in) :: law
      !> The contact; masses and geometry are set
      type(linearised_contact_t), intent(inout) :: element
      integer :: k

      do k = 1, size(law%parts)
         call law%parts(k)%part%stiffen(element)
      end do
      if (allocated(law%constraint)) call law%constraint%stiffen(element)
   end subroutine stiffen

   !> Depth at which a flat contact carries a block at rest [m]; 0 if no part carries a load
   real(wp) function static_depth(law, block) result(depth)
      class(force_law_t), intent(in) :: law
      type(resting_block_t), intent(in) :: block
      integer :: k

      depth = 0.0_wp
      do k = 1, size(law%parts)
         depth = depth + law%parts(k)%part%static_depth(block)
      end do
   end function static_depth

   !> Warning of a law without dissipation; blank if there is none
   function undamped_warning(law) result(warning)
      class(force_law_t), intent(in) :: law
      character(len=:), allocatable :: warning
      integer :: k

      warning = ''
      do k = 1, size(law%parts)
         if (law%parts(k)%part%dissipates) return
      end do
      do k = 1, size(law%parts)
         associate (part => law%parts(k)%part)
            if (warning == '' .and. allocated(part%undamped_warning)) warning = part%undamped_warning
         end associate
      end do
   end function undamped_warning

   !> Why bodies may not come to rest with this law; blank if they do (benchmark B23)
   pure function rest_note(law) result(note)
      class(force_law_t), intent(in) :: law
      character(len=:), allocatable :: note
      logical :: damps, damps_tilts, is_weak
      integer :: k

      note = ''
      damps = .false.
      damps_tilts = .false.
      is_weak = .false.
      do k = 1, size(law%parts)
         associate (part => law%parts(k)%part)
            damps = damps .or. part%dissipates
            damps_tilts = damps_tilts .or. part%damps_tilts
            is_weak = is_weak .or. (part%dissipates .and. part%is_weak)
         end associate
      end do
      if (.not. law%overlap_measure%has_moments) then
         note = note//', the area law gains energy where slender bodies rock'
      else if (.not. law%energy_is_known) then
         note = note//', cohesion has no potential with this law'
      end if
      if (.not. damps) note = note//', nothing is damped'
      if (damps .and. is_weak) note = note//', damping is weak'
      if (damps .and. .not. damps_tilts) note = note//', tilts are not damped'
      if (note /= '') note = 'bodies may rock for long: '//note(3:)//'. The defaults of &forces let them rest'
   end function rest_note

end module polydem_force_law
