!> Table of namelist entries. The reader, its checks and the manual use this table.
!>
!> A new entry needs a row here, a component in `settings` and a line in `fill_settings`; afterwards the manual must be
!> generated again (see `entries_manual`). An entry whose meaning depends on the scene has several rows of the same
!> type; at most one of them is in use. The row of a key named in `needs` must come before the row that needs it.
module polydem_namelist_entries
   use polydem_strings, only: count_words, split_words
   implicit none
   private
   public :: entry_t, entries, required, group_length, bench_group, first_row, groups, keys_of, choices_of

   !> Lengths of the character components of a row
   integer, parameter :: group_length = 10, key_length = 24, allowed_length = 200

   !> One row of the table
   type :: entry_t
      !> Namelist group
      character(len=group_length) :: group
      !> Key of the entry in its group
      character(len=key_length) :: key
      !> real, integer, logical, word (one of `allowed`) or path (any text)
      character(len=7) :: type
      !> Number of values; 0: a list, which is empty by default and has at least one value if given
      integer :: count
      !> Default in namelist syntax without quotes, or `required`
      character(len=20) :: default
      !> Unit; blank if dimensionless
      character(len=8) :: unit
      !> Choices of a word, or bounds of a number such as '>= 0, < 1'; blank: any (finite) value
      character(len=allowed_length) :: allowed
      !> Condition under which the entry is in use: 'key: word word' in the same group; blank: always
      character(len=48) :: needs
      !> Meaning in one sentence
      character(len=100) :: meaning
   end type entry_t

   !> Default of an entry that must be given if it is in use
   character(len=*), parameter :: required = '(required)'

   !> Group of a bench. A bench uses only this group, and a run does not use it
   character(len=*), parameter :: bench_group = 'bench'

   !> Conditions `needs`: scenes with grains, and prescribed motions
   character(len=*), parameter :: grains = 'name: drum hopper gas bed heap channel'
   character(len=*), parameter :: moving = 'motion: rotation translation oscillation'

   !> Names of the finders, which `new_finder` of the room neighbours makes, and of their variants, as in
   !> `variant_names`
   !> of the room bench
   character(len=*), parameter :: finders = 'all_pairs sort_and_sweep unsorted_sweep partitioned_sweep quadtree '// &
      'pruned_quadtree binary_tree linked_cells verlet hierarchical_grid'
   character(len=*), parameter :: variants = 'quadtree_called quadtree_o2 sort_and_sweep_o2'

   !> Group &scene
   type(entry_t), parameter :: scene_entries(*) = [ &
      entry_t('scene', 'name', 'word', 1, required, '', 'drum hopper gas bed heap channel incline stack file', '', &
      'Scene to generate; `file` reads the bodies from `bodies_file`'), &
      entry_t('scene', 'bodies_file', 'path', 1, required, '', '', 'name: file', &
      'HDF5 file of the bodies'), &
      entry_t('scene', 'seed', 'integer', 1, '1', '', '>= 0', grains, &
      'Seed of the random numbers; the same seed makes the same scene'), &
      entry_t('scene', 'boxes', 'integer', 1, '0', '', '>= 0', 'name: drum', &
      'Number of boxes including those of walls; 0: from `bodies`'), &
      entry_t('scene', 'bodies', 'integer', 1, '0', '', '>= 0', 'name: drum', &
      'Number of grains; 0: from `boxes`'), &
      entry_t('scene', 'bodies', 'integer', 1, required, '', '> 0', 'name: hopper gas bed heap channel stack', &
      'Number of free bodies'), &
      entry_t('scene', 'packing', 'path', 1, '', '', '', 'name: drum bed', &
      'Result folder or file of a settled bed; copies of it fill the container; empty: loose grains'), &
      entry_t('scene', 'corners_min', 'integer', 1, '7', '', '>= 3, <= 64', grains, &
      'Smallest number of corners of a grain'), &
      entry_t('scene', 'corners_max', 'integer', 1, '12', '', '>= 3, <= 64', grains, &
      'Largest number of corners of a grain'), &
      entry_t('scene', 'short_axis', 'real', 1, '8e-3', 'm', '>= 1e-15, <= 1e12', grains, &
      'Short axis (full length) of the ellipse around a grain'), &
      entry_t('scene', 'long_axis_min', 'real', 1, '8e-3', 'm', '>= 1e-15, <= 1e12', grains, &
      'Smallest long axis (full length) of the ellipse around a grain'), &
      entry_t('scene', 'long_axis_max', 'real', 1, '11e-3', 'm', '>= 1e-15, <= 1e12', grains, &
      'Largest long axis (full length) of the ellipse around a grain'), &
      entry_t('scene', 'size_ratio', 'real', 1, '1', '', '>= 1, <= 1000', 'name: gas bed', &
      'Size factor (both axes) of the largest grain; each octave of sizes covers the same area'), &
      entry_t('scene', 'order', 'word', 1, 'natural', '', 'natural descending', grains, &
      'Numbering of the grains: as generated, or from right to left (the worst start of a sweep)'), &
      entry_t('scene', 'density', 'real', 1, '2500', 'kg/m3', '> 0', '', &
      'Density of bodies without a density of their own'), &
      entry_t('scene', 'radius', 'real', 1, '0', 'm', '>= 0, <= 1e12', 'name: drum', &
      'Inner radius of the drum; 0: from the number of grains'), &
      entry_t('scene', 'width', 'real', 1, '0', 'm', '>= 0, <= 1e12', 'name: hopper gas bed', &
      'Width of the container; 0: from the number of grains'), &
      entry_t('scene', 'width', 'real', 1, '0', 'm', '>= 0, <= 1e12', 'name: heap', &
      'Length of the floor; 0: from the number of grains'), &
      entry_t('scene', 'width', 'real', 1, required, 'm', '> 0, <= 1e12', 'name: incline stack', &
      'Width of a block'), &
      entry_t('scene', 'height', 'real', 1, required, 'm', '> 0, <= 1e12', 'name: incline stack', &
      'Height of a block'), &
      entry_t('scene', 'opening', 'real', 1, required, 'm', '> 0, <= 1e12', 'name: hopper', &
      'Width of the opening at the bottom'), &
      entry_t('scene', 'slope', 'real', 1, required, 'degree', '> 0, < 90', 'name: hopper', &
      'Angle of the inclined walls to the horizontal'), &
      entry_t('scene', 'slope', 'real', 1, required, 'degree', '>= 0, < 90', 'name: incline', &
      'Angle of the incline to the horizontal'), &
      entry_t('scene', 'fraction', 'real', 1, '0.3', '', '> 0, <= 100', 'name: gas channel', &
      'Fraction of the area that grains cover'), &
      entry_t('scene', 'overlap', 'logical', 1, '.false.', '', '', 'name: gas', &
      'Whether grains may overlap each other at the start'), &
      entry_t('scene', 'speed', 'real', 1, required, 'm/s', '>= 0, < 1e6', 'name: gas channel', &
      'Root mean square speed of the grains at the start'), &
      entry_t('scene', 'spin', 'real', 1, '0', 'rad/s', '>= 0, < 1e9', 'name: gas channel', &
      'Root mean square angular velocity of the grains at the start'), &
      entry_t('scene', 'movers', 'integer', 1, '0', '', '>= 0', 'name: gas channel', &
      'Number of grains that move at the start; 0: all'), &
      entry_t('scene', 'speed', 'real', 1, '0', 'm/s', '>= 0, < 1e6', 'name: drum hopper bed heap', &
      'Root mean square speed of the grains at the start'), &
      entry_t('scene', 'speed', 'real', 1, '0', 'm/s', '>= 0, < 1e6', 'name: incline', &
      'Speed of the block down the incline at the start'), &
      entry_t('scene', 'motion', 'word', 1, 'none', '', 'none rotation translation oscillation', '', &
      'Prescribed motion of fixed bodies'), &
      entry_t('scene', 'motion_bodies', 'integer', 0, '', '', '', moving, &
      'Identifiers of the fixed bodies that move; omitted: all fixed bodies'), &
      entry_t('scene', 'motion_pivot', 'real', 2, '0, 0', 'm', '>= -1e12, <= 1e12', 'motion: rotation', &
      'Centre of the rotation'), &
      entry_t('scene', 'motion_rate', 'real', 1, required, '1/s', '> -1e9, < 1e9', 'motion: rotation', &
      'Revolutions per second, anticlockwise'), &
      entry_t('scene', 'motion_velocity', 'real', 2, required, 'm/s', '> -1e6, < 1e6', 'motion: translation', &
      'Velocity of the translation'), &
      entry_t('scene', 'motion_amplitude', 'real', 2, required, 'm', '>= -1e12, <= 1e12', 'motion: oscillation', &
      'Amplitude of the oscillation'), &
      entry_t('scene', 'motion_frequency', 'real', 1, required, 'Hz', '> 0, < 1e12', 'motion: oscillation', &
      'Frequency of the oscillation'), &
      entry_t('scene', 'motion_start', 'real', 1, '0', 's', '>= 0, <= 1e12', moving, &
      'Time at which the motion starts'), &
      entry_t('scene', 'motion_ramp', 'real', 1, '0', 's', '>= 0, <= 1e12', moving, &
      'Time in which the motion smoothly reaches full speed')]

   !> Groups of the stages of a time step, from boxes to forces
   type(entry_t), parameter :: stage_entries(*) = [ &
      entry_t('boxes', 'largest_ratio', 'real', 1, '4', '', '>= 1', '', &
      'A body longer than this many median diameters gets several boxes'), &
      entry_t('boxes', 'margin', 'real', 1, '0', 'm', '>= 0, <= 1e12', '', &
      'Enlargement of every box on each side, for interactions at a distance'), &
      entry_t('neighbours', 'finder', 'word', 1, 'quadtree', '', finders, '', &
      'Method that finds pairs of overlapping boxes'), &
      entry_t('neighbours', 'skin', 'real', 1, '0', 'm', '>= 0, <= 1e12', 'finder: verlet', &
      'Approach of two boxes that triggers a rebuild of the Verlet list; 0: set from counted cost'), &
      entry_t('overlap', 'degenerate', 'word', 1, 'push', '', 'push stop', '', &
      'Contact without direction: push apart along the line of centres, or stop the run'), &
      entry_t('forces', 'gravity', 'real', 2, '0, -9.81', 'm/s2', '> -1e12, < 1e12', '', &
      'Acceleration of gravity'), &
      entry_t('forces', 'stiffness', 'real', 1, '1e7', 'N/m2', '> 0, <= 1e30', '', &
      'Young''s modulus E in two dimensions'), &
      entry_t('forces', 'law', 'word', 1, 'area', '', 'area conservative', '', &
      'Elastic force: E A/l (Matuttis & Chen), or from the energy E G^2/(2 l b), G the effective area'), &
      entry_t('forces', 'damping', 'word', 1, 'rate', '', 'rate hunt_crossley book none', '', &
      'Normal damping: rate of the area, that rate times elastic force, Matuttis & Chen, or none'), &
      entry_t('forces', 'damping_coefficient', 'real', 1, '0.0251', '', '>= 0, <= 1e6', &
      'damping: rate hunt_crossley book', &
      'Damping coefficient gamma; a few hundred with hunt_crossley, which damps little at low speed'), &
      entry_t('forces', 'restitution', 'real', 1, '0', '', '>= 0, <= 1', 'damping: rate', &
      'Restitution of flat contacts, 0.01 to 1; replaces `damping_coefficient` if given'), &
      entry_t('forces', 'damping_from_touch', 'logical', 1, '.false.', '', '', 'damping: rate', &
      'Whether damping starts at first touch within the step (restitution of second order in dt)'), &
      entry_t('forces', 'tilt_damping', 'real', 1, '0', '', '>= 0, <= 1e6', '', &
      'Damping of tilting in units of sqrt(k I), k = E L^3/(12 l); 0: none, 2: critical for two bodies'), &
      entry_t('forces', 'friction', 'word', 1, 'cundall_strack', '', 'cundall_strack exact none', '', &
      'Friction: tangential spring, exact without spring (needs `scheme` velocity_verlet), or none'), &
      entry_t('forces', 'friction_coefficient', 'real', 1, '0.23', '', '>= 0, <= 1e12', &
      'friction: cundall_strack exact', &
      'Friction coefficient mu'), &
      entry_t('forces', 'tangential_stiffness', 'real', 1, '0.2857142857142857', '', '> 0, <= 1e6', &
      'friction: cundall_strack', &
      'Tangential stiffness in units of E'), &
      entry_t('forces', 'tangential_damping', 'real', 1, '0.25', '', '>= 0, <= 1e6', 'friction: cundall_strack', &
      'Tangential damping in units of sqrt(k_t m_t)'), &
      entry_t('forces', 'midstep_slip', 'logical', 1, '.false.', '', '', 'friction: cundall_strack', &
      'Whether friction uses the slip velocity at mid-step (friction of second order in dt)'), &
      entry_t('forces', 'friction_tolerance', 'real', 1, '1e-10', '', '> 0, <= 1e-3', 'friction: exact', &
      'Slip left at sticking contacts, relative to the largest slip velocity removed in a step')]

   !> Group &guards: monitors of a run. A body whose position is NaN stops every run
   type(entry_t), parameter :: guard_entries(*) = [ &
      entry_t('guards', 'displacement', 'word', 1, 'stop', '', 'stop warn off', '', &
      'Monitor of bodies that move so far in a step that they could pass through another body'), &
      entry_t('guards', 'displacement_limit', 'real', 1, '0.25', '', '> 0, <= 1e6', 'displacement: stop warn', &
      'Largest displacement of a point in a step, relative to the thinnest body'), &
      entry_t('guards', 'step', 'word', 1, 'stop', '', 'stop warn off', '', &
      'Monitor of time steps above the stable time step of the contacts; above half of it: a warning'), &
      entry_t('guards', 'overlap', 'word', 1, 'warn', '', 'stop warn off', '', &
      'Monitor of contacts that are deep relative to their bodies'), &
      entry_t('guards', 'overlap_limit', 'real', 1, '0.25', '', '> 0, <= 1e6', 'overlap: stop warn', &
      'Largest depth (area over length) of a contact, relative to the thinner body'), &
      entry_t('guards', 'passing', 'word', 1, 'warn', '', 'stop warn off', '', &
      'Monitor of centres inside other bodies and of contacts whose direction reverses in a step'), &
      entry_t('guards', 'energy', 'word', 1, 'off', '', 'stop warn off', '', &
      'Monitor of unexplained energy gain, every 100 steps; needs `ledger` in &output'), &
      entry_t('guards', 'energy_limit', 'real', 1, '0.1', '', '> 0, <= 1e6', 'energy: stop warn', &
      'Largest unexplained energy gain, relative to the largest kinetic energy or work so far'), &
      entry_t('guards', 'listed_depth', 'real', 1, '1e-3', '', '>= 0, <= 1e6', '', &
      'Initial contacts deeper than this fraction of the thinner body are listed individually'), &
      entry_t('guards', 'relaxed_depth', 'real', 1, '0', '', '>= 0, <= 1e6', '', &
      'Before time 0, bodies are pushed apart until no contact exceeds this relative depth; 0: never')]

   !> Groups of time integration, ranks, output and checkpoints
   type(entry_t), parameter :: run_entries(*) = [ &
      entry_t('integrate', 'scheme', 'word', 1, 'velocity_verlet', '', 'velocity_verlet gear gear_3_20', '', &
      'Integration scheme; gear: position coefficient 3/16; gear_3_20: 3/20, for forces of positions only'), &
      entry_t('integrate', 'accumulation', 'word', 1, 'plain', '', 'plain compensated', 'scheme: velocity_verlet', &
      'Summation of positions and velocities over the steps: plain, or compensated for rounding errors'), &
      entry_t('integrate', 'dt', 'real', 1, '0', 's', '>= 0', '', &
      'Time step; 0: `fraction` times the stable time step'), &
      entry_t('integrate', 'fraction', 'real', 1, '0.3', '', '> 0', '', &
      'Time step over stable time step if `dt` is 0'), &
      entry_t('integrate', 'duration', 'real', 1, required, 's', '> 0', '', &
      'Simulated time'), &
      entry_t('exchange', 'cut', 'word', 1, 'bisection', '', 'bisection morton', '', &
      'Partition of space over ranks: bisection across the longer side, or along the Morton curve'), &
      entry_t('exchange', 'margin', 'real', 1, '0', 'm', '>= 0, <= 1e12', '', &
      'Distance bodies may move before neighbouring ranks are found again; 0: from how often that happens'), &
      entry_t('exchange', 'balance', 'word', 1, 'measured', '', 'measured counted off', '', &
      'Work balanced over ranks: measured times, counted pairs, or off (partition of the start)'), &
      entry_t('exchange', 'imbalance', 'real', 1, '1.1', '', '>= 1, <= 1e6', 'balance: measured counted', &
      'Ratio of largest to mean work of a rank above which space is partitioned again'), &
      entry_t('output', 'folder', 'path', 1, '', '', '', '', &
      'Result folder; empty: results/ and the name of the namelist file'), &
      entry_t('output', 'frame_interval', 'real', 1, '0', 's', '>= 0', '', &
      'Simulated time between two frames; 0: the first and the last frame only'), &
      entry_t('output', 'frames_per_segment', 'integer', 1, '20', '', '>= 1', '', &
      'Number of frames in a trajectory segment (one file)'), &
      entry_t('output', 'log_interval', 'real', 1, '0', 's', '>= 0', '', &
      'Simulated time between two lines of the log; 0: twenty lines in total'), &
      entry_t('output', 'contacts', 'logical', 1, '.false.', '', '', '', &
      'Whether frames contain the contacts'), &
      entry_t('output', 'ledger', 'logical', 1, '.true.', '', '', '', &
      'Whether the energy and momentum balance is computed'), &
      entry_t('output', 'trace_steps', 'integer', 1, '0', '', '>= 0', '', &
      'Number of steps whose boxes are recorded in trace.h5'), &
      entry_t('output', 'trace_start', 'real', 1, '0', 's', '>= 0, <= 1e12', '', &
      'Simulated time at which the recording of boxes starts'), &
      entry_t('output', 'step_profile', 'logical', 1, '.false.', '', '', '', &
      'Whether steps.h5 contains the times and counts of every step'), &
      entry_t('checkpoint', 'steps', 'integer', 1, '0', '', '>= 0', '', &
      'Steps between two checkpoints, from which a run can restart; 0: not by steps'), &
      entry_t('checkpoint', 'interval', 'real', 1, '0', 's', '>= 0', '', &
      'Simulated time between two checkpoints; 0: not by simulated time'), &
      entry_t('checkpoint', 'elapsed', 'real', 1, '600', 's', '>= 0', '', &
      'Elapsed time between two checkpoints; 0: not by elapsed time')]

   !> Group &bench
   type(entry_t), parameter :: bench_entries(*) = [ &
      entry_t(bench_group, 'scenes', 'path', 0, required, '', '', '', &
      'Scenes to measure, each a trace or a namelist file with overrides (file.nml group.key=value ...)'), &
      entry_t(bench_group, 'names', 'path', 0, required, '', '', '', &
      'One name per scene: letters, digits, . and _'), &
      entry_t(bench_group, 'prepare', 'path', 0, '', '', '', '', &
      'Namelist files with overrides to run before all scenes unless their results exist'), &
      entry_t(bench_group, 'finders', 'word', 0, required, '', finders//' '//variants, '', &
      'Neighbour finders to measure'), &
      entry_t(bench_group, 'threads', 'integer', 0, '1', '', '>= 1, <= 9999', '', &
      'Numbers of threads to measure with'), &
      entry_t(bench_group, 'repeats', 'integer', 1, '7', '', '>= 1, <= 9999', '', &
      'Number of timed repeats after a warm-up that checks every pair list'), &
      entry_t(bench_group, 'mode', 'word', 1, 'replay', '', 'replay live', '', &
      'Replay of recorded boxes, or live time steps'), &
      entry_t(bench_group, 'steps', 'integer', 1, '0', '', '>= 0', '', &
      'Number of steps of a sample; 0: all of the trace, or (live) `trace_steps` of the scene'), &
      entry_t(bench_group, 'folder', 'path', 1, '', '', '', '', &
      'Folder of traces and samples; empty: results/ and the name of the namelist file')]

   !> The table of entries
   type(entry_t), parameter :: entries(*) = [scene_entries, stage_entries, guard_entries, run_entries, bench_entries]

contains

   !> First row of an entry; 0 if the table does not contain it
   pure integer function first_row(group, key)
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Key of the entry in its group
      character(len=*), intent(in) :: key

      do first_row = 1, size(entries)
         if (entries(first_row)%group == group .and. entries(first_row)%key == key) return
      end do
      first_row = 0
   end function first_row

   !> Names of the groups in the order of the table
   pure function groups() result(names)
      character(len=group_length), allocatable :: names(:)
      logical :: is_new(size(entries))
      integer :: k, n

      do k = 1, size(entries)
         is_new(k) = all(entries(:k - 1)%group /= entries(k)%group)
      end do
      allocate (names(count(is_new)))
      n = 0
      do k = 1, size(entries)
         if (.not. is_new(k)) cycle
         n = n + 1
         names(n) = entries(k)%group
      end do
   end function groups

   !> Keys of the entries of a group in the order of the table, each key once
   pure function keys_of(group) result(names)
      !> Namelist group
      character(len=*), intent(in) :: group
      character(len=key_length), allocatable :: names(:)
      logical :: is_new(size(entries))
      integer :: k, n

      do k = 1, size(entries)
         is_new(k) = entries(k)%group == group .and. first_row(group, trim(entries(k)%key)) == k
      end do
      allocate (names(count(is_new)))
      n = 0
      do k = 1, size(entries)
         if (.not. is_new(k)) cycle
         n = n + 1
         names(n) = entries(k)%key
      end do
   end function keys_of

   !> Choices of a word entry, such as the names of the finders
   pure function choices_of(group, key) result(words)
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Key of the entry in its group; the entry must exist
      character(len=*), intent(in) :: key
      character(len=allowed_length) :: words(count_words(entries(first_row(group, key))%allowed))

      words = split_words(entries(first_row(group, key))%allowed)
   end function choices_of

end module polydem_namelist_entries
