!> Makes the force law of a run. Only this module uses all parts.
!>
!> To add a part, write it as a `force_part_t` in a file of its own, and add a `use` and a line of `choose_parts` here.
!> The order of the lines does not matter, because the `stage` of a part gives its place.
module polydem_law_factory
   use polydem_area_law, only: area_law_t
   use polydem_bodies, only: bodies_t
   use polydem_cohesion, only: cohesion_t
   use polydem_conservative_law, only: conservative_law_t
   use polydem_cundall_strack, only: cundall_strack_t
   use polydem_damping_onset, only: damping_onset_t
   use polydem_errors, only: error_t
   use polydem_exact_friction, only: exact_friction_t
   use polydem_force_law, only: force_law_t
   use polydem_hunt_crossley, only: hunt_crossley_t
   use polydem_kinds, only: ip, wp
   use polydem_matuttis_chen_damping, only: matuttis_chen_damping_t
   use polydem_overlap_measure, only: area_per_length, effective_area
   use polydem_pair_parameters, only: pair_parameters, pair_parameters_t, uniform_parameters
   use polydem_rate_damping, only: rate_damping_t
   use polydem_restitution_damping, only: restitution_damping_t
   use polydem_rolling_resistance, only: rolling_resistance_t
   use polydem_settings, only: forces_settings_t, settings_t
   use polydem_tilt_damping, only: tilt_damping_t
   implicit none
   private
   public :: new_force_law, choose_parts, check_law

contains

   !> Create the law that the settings ask for. It contains no other parts.
   subroutine new_force_law(settings, bodies, law, pairs)
      type(forces_settings_t), intent(in) :: settings
      !> Bodies, for their shapes
      type(bodies_t), intent(in) :: bodies
      type(force_law_t), intent(out) :: law
      !> Parameters of pairs of materials; default: those of the settings for all pairs
      type(pair_parameters_t), intent(in), optional :: pairs

      call choose_parts(settings, law, pairs)
      call law%measure(bodies)
   end subroutine new_force_law

   !> Choose the parts that the settings ask for, from the list of all parts. The law must `measure` the bodies before
   !> it computes forces.
   subroutine choose_parts(settings, law, pairs)
      type(forces_settings_t), intent(in) :: settings
      type(force_law_t), intent(out) :: law
      !> Parameters of pairs of materials; default: those of the settings for all pairs
      type(pair_parameters_t), intent(in), optional :: pairs

      if (present(pairs)) law%pairs = pairs
      if (.not. present(pairs)) law%pairs = uniform_parameters(settings)
      associate (s => settings)
         if (s%law == 'area') call law%add(area_law_t(name='area law'), s)
         if (s%law == 'conservative') &
            call law%add(conservative_law_t(name='conservative law', overlap_measure=effective_area), s)
         if (s%law == 'polar') call law%add(conservative_law_t(name='polar law', overlap_measure=area_per_length), s)
         if (s%damping == 'rate') then
            if (s%restitution > 0.0_wp) then
               call law%add(restitution_damping_t(name='damping of given restitution'), s)
            else
               call law%add(rate_damping_t(name='rate damping'), s)
            end if
         end if
         if (s%damping == 'hunt_crossley') &
            call law%add(hunt_crossley_t(name='Hunt-Crossley damping', is_of_bodies=s%law == 'polar'), s)
         if (s%damping == 'matuttis_chen') call law%add(matuttis_chen_damping_t(name='Matuttis-Chen damping'), s)
         if (s%damping == 'rate' .and. s%damping_from_touch) &
            call law%add(damping_onset_t(name='from first touch'), s)
         if (law%pairs%cohesion%greatest() > 0.0_wp) call law%add(cohesion_t(name='cohesion'), s)
         if (s%damping /= 'none' .and. s%tilt_damping > 0.0_wp) call law%add(tilt_damping_t(name='damping of tilts'), s)
         if (law%pairs%rolling_friction%greatest() > 0.0_wp) &
            call law%add(rolling_resistance_t(name='rolling resistance'), s)
         if (law%pairs%friction_coefficient%greatest() > 0.0_wp) then
            if (s%friction == 'cundall_strack') call law%add(cundall_strack_t(name='Cundall-Strack friction'), s)
            if (s%friction == 'exact') call law%add(exact_friction_t(name='exact friction'), s)
         end if
      end associate
      call law%collect_needs()
   end subroutine choose_parts

   !> Refuse settings that exclude a part of the law.
   subroutine check_law(settings, n_processes, error)
      type(settings_t), intent(in) :: settings
      !> Number of ranks
      integer(ip), intent(in) :: n_processes
      !> Allocated if a setting is refused; names the entry and the remedy
      type(error_t), allocatable, intent(inout) :: error
      type(force_law_t) :: law

      call choose_parts(settings%forces, law, pair_parameters(settings, settings%forces))
      call law%check(settings, n_processes, error)
   end subroutine check_law

end module polydem_law_factory
