!> The force law of a run: the list of its parts. The only file that knows all parts by name.
!>
!> To add a part: write it as a `force_part_t` in a file of its own, add its name to the choices of the
!> namelist, and append it here in the order in which parts must act (elastic, damping, friction).
module polydem_force_law
   use polydem_area_law, only: area_law_t
   use polydem_bodies, only: bodies_t
   use polydem_book_damping, only: book_damping_t
   use polydem_conservative_law, only: conservative_law_t, new_conservative_law
   use polydem_contacts, only: contact_memory_t, contacts_t
   use polydem_cundall_strack, only: cundall_strack_t
   use polydem_force_part, only: force_part_t
   use polydem_hunt_crossley, only: hunt_crossley_t
   use polydem_kinds, only: ip, wp
   use polydem_rate_damping, only: rate_damping_t
   use polydem_restitution_damping, only: damping_ratio_of, restitution_damping_t
   use polydem_settings, only: forces_settings_t
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
      !> Whether a part remembers tangential springs
      logical :: needs_tangential = .false.
      !> Whether a part remembers the area of the last step
      logical :: needs_area = .false.
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
      else
         call append(law, area_law_t(stiffness=settings%stiffness))
      end if
      call append_damping(settings, law)
      if (settings%friction == 'cundall_strack') then
         call append(law, cundall_strack_t(coefficient=settings%friction_coefficient, &
                                           stiffness=settings%tangential_stiffness*settings%stiffness, &
                                           damping=settings%tangential_damping))
         law%description = law%description//', Cundall-Strack friction'
         law%needs_tangential = .true.
      end if
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
            law%needs_area = .true.
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
      !> Contacts; `elastic`, `normal_force` and `tangential_force` are set
      type(contacts_t), intent(inout) :: contacts
      !> What is remembered of the pairs
      type(contact_memory_t), intent(inout) :: memory
      integer :: k

      contacts%elastic(1:contacts%n) = 0.0_wp
      contacts%normal_force(1:contacts%n) = 0.0_wp
      contacts%tangential_force(1:contacts%n) = 0.0_wp
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
