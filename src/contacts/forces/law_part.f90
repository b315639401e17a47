!> Base type of the members of a force law: parts of the contact force, and a constraint on velocities.
!>
!> A member copies its parameters from the settings, refuses settings that exclude it, declares its contact history, and
!> adds its stiffness to that of a contact. The names of members occur only in their own files and in the factory
!> (`force_law`), which adds the members that the settings ask for. A member overrides only those defaults that do not
!> fit.
module polydem_law_part
   use polydem_bodies, only: bodies_t
   use polydem_linearised_contact, only: linearised_contact_t
   use polydem_contact_history, only: history_kind_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: ip, wp
   use polydem_pair_parameters, only: pair_parameters_t
   use polydem_settings, only: forces_settings_t, settings_t
   implicit none
   private
   public :: law_part_t

   !> A member of a force law
   type, abstract :: law_part_t
      !> Name for `polydem check` and the log
      character(len=40) :: name = ''
      !> Places in `pair_entries` of the parameters that the log has for each pair of materials; not allocated: none
      integer, allocatable :: logged(:)
      !> Index of the first column of this member in `contact_history_t`; the law sets it
      integer :: first_column = 1
      !> Its contact history: column(first_column), column(first_column + 1) ... of `contact_history_t`; not allocated
      !> if there is none. Names must differ from those of other members of the same law
      type(history_kind_t), allocatable :: history_kinds(:)
   contains
      !> Copy its parameters from the settings, and set its other components
      procedure :: configure
      !> Refuse settings that exclude this member
      procedure :: check
      !> Measure the bodies
      procedure :: measure
      !> Scale its friction
      procedure :: scale_friction
      !> Add its springs and dashpots to those of a contact
      procedure :: stiffen
   end type law_part_t

contains

   !> Copy the parameters from the settings. Default: there are none.
   subroutine configure(self, settings, pairs)
      class(law_part_t), intent(inout) :: self
      !> Group &forces
      type(forces_settings_t), intent(in) :: settings
      !> Those of its entries that may differ between pairs of materials
      type(pair_parameters_t), intent(in) :: pairs

      associate (unused_self => self, unused_settings => settings, unused_pairs => pairs)
      end associate
   end subroutine configure

   !> Refuse settings that exclude this member. Default: none.
   subroutine check(self, settings, n_processes, error)
      class(law_part_t), intent(in) :: self
      type(settings_t), intent(in) :: settings
      !> Number of ranks
      integer(ip), intent(in) :: n_processes
      !> Allocated if a setting is refused; names the entry and the remedy
      type(error_t), allocatable, intent(inout) :: error

      associate (unused_self => self, unused_settings => settings, unused_n => n_processes, unused_error => error)
      end associate
   end subroutine check

   !> Measure the bodies, at the start and after each redistribution. Default: nothing.
   subroutine measure(self, bodies)
      class(law_part_t), intent(inout) :: self
      !> Bodies, for their shapes
      type(bodies_t), intent(in) :: bodies

      associate (unused_self => self, unused_bodies => bodies)
      end associate
   end subroutine measure

   !> Scale its friction coefficients relative to those of the settings. Default: it has none.
   subroutine scale_friction(self, factor)
      class(law_part_t), intent(inout) :: self
      !> The factor
      real(wp), intent(in) :: factor

      associate (unused_self => self, unused => factor)
      end associate
   end subroutine scale_friction

   !> Add the springs and dashpots to those of a contact, for the stable step. Default: none. The parts add theirs in
   !> the order of their stages.
   subroutine stiffen(self, element)
      class(law_part_t), intent(in) :: self
      !> The contact; masses and geometry are set
      type(linearised_contact_t), intent(inout) :: element

      associate (unused_self => self, unused => element)
      end associate
   end subroutine stiffen

end module polydem_law_part
