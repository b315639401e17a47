!> The force law of a run: the list of its parts. The only file that knows all parts by name.
!>
!> To add a part: write it as a `force_part_t` in a file of its own, add its name to the choices of the
!> namelist, and append it here in the order in which parts must act (elastic, damping, friction). A law may end with a
!> constraint on velocities, which acts when all other forces on the bodies are known.
module polydem_force_law
   use polydem_area_law, only: area_law_t
   use polydem_bodies, only: bodies_t
   use polydem_conservative_law, only: conservative_law_t, new_conservative_law
   use polydem_contact_history, only: at_area, at_tangential, contact_memory_t, memory_kinds
   use polydem_contacts, only: contacts_t
   use polydem_cundall_strack, only: cundall_strack_t
   use polydem_damping_onset, only: damping_onset_t
   use polydem_exact_friction, only: exact_friction_t
   use polydem_force_part, only: force_part_t
   use polydem_hunt_crossley, only: hunt_crossley_t
   use polydem_kinds, only: ip, wp
   use polydem_matuttis_chen_damping, only: book_damping_t
   use polydem_rate_damping, only: rate_damping_t
   use polydem_restitution_damping, only: damping_ratio_of, restitution_damping_t
   use polydem_settings, only: forces_settings_t
   use polydem_tilt_damping, only: tilt_damping_t
   use polydem_velocity_constraint, only: velocity_constraint_t
   implicit none
   private
   public :: force_law_t, new_force_law, evaluate_law

   !> A part of any type
   type :: part_holder_t
      !> The part
      class(force_part_t), allocatable :: part
   end type part_holder_t

   !> Parts in the order in which they act, and which columns of memory they need
   type :: force_law_t
      type(part_holder_t), allocatable, private :: parts(:)
      !> What acts after all parts; unallocated if there is none
      class(velocity_constraint_t), allocatable :: constraint
      !> Whether a part needs a column of memory, in the order of `memory_kinds`
      logical :: needs(size(memory_kinds)) = .false.
      !> Whether the law asks for the effective area of overlaps
      logical :: needs_effective_area = .false.
      !> Whether a part adds torques of its own
      logical :: needs_twist = .false.
      !> Names of the parts, for `check` and the log
      character(len=:), allocatable :: description
   end type force_law_t

contains

   !> Make the law that the settings ask for; what is off is absent.
   subroutine new_force_law(settings, bodies, law)
      !> Group &forces
      type(forces_settings_t), intent(in) :: settings
      !> Bodies, for their shapes
      type(bodies_t), intent(in) :: bodies
      !> The law
      type(force_law_t), intent(out) :: law
      type(conservative_law_t) :: conservative

      allocate (law%parts(0))
      law%description = settings%law//' law'
      if (settings%law == 'conservative') then
         call new_conservative_law(settings%stiffness, bodies, conservative)
         call append(law, conservative)
         law%needs_effective_area = .true.
      else
         call append(law, area_law_t(stiffness=settings%stiffness))
      end if
      call append_damping(settings, law)
      if (settings%damping_from_touch) then
         call append(law, damping_onset_t())
         law%description = law%description//' from first touch'
         law%needs(at_area) = .true.
      end if
      if (settings%tilt_damping > 0.0_wp) then
         call append(law, tilt_damping_t(stiffness=settings%stiffness, share=settings%tilt_damping))
         law%description = law%description//', damping of tilts'
         law%needs_twist = .true.
      end if
      select case (settings%friction)
      case ('cundall_strack')
         call append(law, cundall_strack_t(coefficient=settings%friction_coefficient, &
                                           stiffness=settings%tangential_stiffness*settings%stiffness, &
                                           damping=settings%tangential_damping, &
                                           midstep=settings%midstep_slip))
         law%description = law%description//', Cundall-Strack friction'
         law%needs(at_tangential) = .true.
      case ('exact')
         law%constraint = exact_friction_t(coefficient=settings%friction_coefficient, &
                                           tolerance=settings%friction_tolerance)
         law%description = law%description//', exact friction'
         law%needs(at_tangential) = .true.
      end select
   end subroutine new_force_law

   subroutine append_damping(settings, law)
      type(forces_settings_t), intent(in) :: settings
      type(force_law_t), intent(inout) :: law

      associate (stiffness => settings%stiffness, coefficient => settings%damping_coefficient)
         select case (settings%damping)
         case ('rate')
            if (settings%restitution > 0.0_wp) then
               call append(law, restitution_damping_t(stiffness=stiffness, &
                                                      ratio=damping_ratio_of(settings%restitution)))
               law%description = law%description//', damping of given restitution'
            else
               call append(law, rate_damping_t(stiffness=stiffness, coefficient=coefficient))
               law%description = law%description//', rate damping'
            end if
         case ('hunt_crossley')
            call append(law, hunt_crossley_t(stiffness=stiffness, coefficient=coefficient))
            law%description = law%description//', Hunt-Crossley damping'
         case ('book')
            call append(law, book_damping_t(stiffness=stiffness, coefficient=coefficient))
            law%description = law%description//', book damping'
            law%needs(at_area) = .true.
         end select
      end associate
   end subroutine append_damping

   !> Compute the normal and tangential forces of all contacts.
   subroutine evaluate_law(law, bodies, dt, contacts, memory)
      !> The law
      type(force_law_t), intent(in) :: law
      !> Bodies with the positions and velocities of this step
      type(bodies_t), intent(in) :: bodies
      !> Time since the last evaluation [s]; 0 at the start of a run
      real(wp), intent(in) :: dt
      !> Contacts; `elastic`, `normal_force`, `tangential_force` and `twist` are set
      type(contacts_t), intent(inout) :: contacts
      !> What is remembered of the pairs
      type(contact_memory_t), intent(inout) :: memory
      integer :: k

      contacts%elastic(1:contacts%n) = 0.0_wp
      contacts%normal_force(1:contacts%n) = 0.0_wp
      contacts%tangential_force(1:contacts%n) = 0.0_wp
      if (contacts%has_twist) contacts%twist(1:contacts%n) = 0.0_wp
      do k = 1, size(law%parts)
         call law%parts(k)%part%add(bodies, dt, contacts, memory)
      end do
   end subroutine evaluate_law

   subroutine append(law, part)
      type(force_law_t), intent(inout) :: law
      class(force_part_t), intent(in) :: part
      type(part_holder_t), allocatable :: longer(:)
      integer(ip) :: k, n

      n = size(law%parts, kind=ip)
      allocate (longer(n + 1_ip))
      do k = 1_ip, n
         call move_alloc(law%parts(k)%part, longer(k)%part)
      end do
      allocate (longer(n + 1_ip)%part, source=part)
      call move_alloc(longer, law%parts)
   end subroutine append

end module polydem_force_law
