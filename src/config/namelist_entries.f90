!> The one table of namelist entries, from which the reader, its checks and the manual are made.
!>
!> To add an entry: a row here, a component in `settings`, a line in `fill_settings`; then let the manual be
!> written anew (see `entries_manual`). An entry that means different things in different scenes has several
!> rows of the same type of which at most one is in force. The row of a key named in `needs` stands above.
module polydem_namelist_entries
   use polydem_words, only: count_words, split_words
   implicit none
   private
   public :: entry_t, entries, required, group_length, bench_group, first_row, groups, keys_of, choices_of

   !> Greatest lengths in the table
   integer, parameter :: group_length = 10, key_length = 24, allowed_length = 200

   !> One row of the table
   type :: entry_t
      !> Namelist group
      character(len=group_length) :: group
      !> Name in the group
      character(len=key_length) :: key
      !> real, integer, logical, word (one of `allowed`) or path (any text)
      character(len=7) :: type
      !> Number of values; 0: any number from one on, none unless given or by default
      integer :: count
      !> Default as in a namelist, but without quotes; or `required`
      character(len=20) :: default
      !> Unit, blank if there is none
      character(len=8) :: unit
      !> Choices of a word, bounds of a number such as '>= 0, < 1'; blank: anything (finite)
      character(len=allowed_length) :: allowed
      !> When it is in force: 'key: word word' of the same group; blank: always
      character(len=48) :: needs
      !> What it means, in one sentence
      character(len=100) :: meaning
   end type entry_t

   !> Default of an entry that must be given while it is in force
   character(len=*), parameter :: required = '(required)'

   !> The group of a bench, which needs no other; no run takes it
   character(len=*), parameter :: bench_group = 'bench'

   character(len=*), parameter :: grains = 'name: drum hopper gas bed heap channel'
   character(len=*), parameter :: moving = 'motion: rotation translation oscillation'

   !> The finders, as in `finder_names` of the room neighbours
   character(len=*), parameter :: finders = 'all_pairs sort_and_sweep unsorted_sweep partitioned_sweep quadtree '// &
      'quadtree_called pruned_quadtree binary_tree linked_cells verlet hierarchical_grid sort_and_sweep_o2 quadtree_o2'

   !> Group &scene
   type(entry_t), parameter :: scene_entries(*) = [ &
      entry_t('scene', 'name', 'word', 1, required, '', 'drum hopper gas bed heap channel incline stack file', '', &
      'Scene to make, or file to read the bodies from `bodies_file`'), &
      entry_t('scene', 'bodies_file', 'path', 1, required, '', '', 'name: file', &
      'HDF5 file of the bodies'), &
      entry_t('scene', 'seed', 'integer', 1, '1', '', '>= 0', grains, &
      'Seed of the random numbers; the same seed makes the same scene'), &
      entry_t('scene', 'boxes', 'integer', 1, '0', '', '>= 0', 'name: drum', &
      'Number of boxes, those of walls included; 0: as many as `bodies` needs'), &
      entry_t('scene', 'bodies', 'integer', 1, '0', '', '>= 0', 'name: drum', &
      'Number of grains; 0: as many as `boxes` leaves'), &
      entry_t('scene', 'bodies', 'integer', 1, required, '', '> 0', 'name: hopper gas bed heap channel stack', &
      'Number of free bodies'), &
      entry_t('scene', 'packing', 'path', 1, '', '', '', 'name: drum bed', &
      'Result folder (or file) of a settled bed, whose copies fill the container; empty: loose grains'), &
      entry_t('scene', 'corners_min', 'integer', 1, '7', '', '>= 3, <= 64', grains, &
      'Least number of corners of a grain'), &
      entry_t('scene', 'corners_max', 'integer', 1, '12', '', '>= 3, <= 64', grains, &
      'Greatest number of corners of a grain'), &
      entry_t('scene', 'short_axis', 'real', 1, '8e-3', 'm', '>= 1e-15, <= 1e12', grains, &
      'Short axis (full length) of the ellipse around a grain'), &
      entry_t('scene', 'long_axis_min', 'real', 1, '8e-3', 'm', '>= 1e-15, <= 1e12', grains, &
      'Least long axis (full length) of the ellipse around a grain'), &
      entry_t('scene', 'long_axis_max', 'real', 1, '11e-3', 'm', '>= 1e-15, <= 1e12', grains, &
      'Greatest long axis (full length) of the ellipse around a grain'), &
      entry_t('scene', 'size_ratio', 'real', 1, '1', '', '>= 1, <= 1000', 'name: gas bed', &
      'Factor of both axes of the largest grain; each octave of sizes covers the same area'), &
      entry_t('scene', 'order', 'word', 1, 'natural', '', 'natural descending', grains, &
      'Numbers of grains as they are made, or from right to left: a sweep''s worst start'), &
      entry_t('scene', 'density', 'real', 1, '2500', 'kg/m3', '> 0', '', &
      'Density of the bodies that have none of their own'), &
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
      'Share of the area that grains cover'), &
      entry_t('scene', 'overlap', 'logical', 1, '.false.', '', '', 'name: gas', &
      'Whether grains may overlap each other at the start'), &
      entry_t('scene', 'speed', 'real', 1, required, 'm/s', '>= 0, < 1e6', 'name: gas channel', &
      'Root mean square speed of the grains at the start'), &
      entry_t('scene', 'spin', 'real', 1, '0', 'rad/s', '>= 0, < 1e9', 'name: gas channel', &
      'Root mean square angular velocity of the grains at the start'), &
      entry_t('scene', 'movers', 'integer', 1, '0', '', '>= 0', 'name: gas channel', &
      'Number of grains that get a speed at the start; 0: all'), &
      entry_t('scene', 'speed', 'real', 1, '0', 'm/s', '>= 0, < 1e6', 'name: drum hopper bed heap', &
      'Root mean square speed of the grains at the start'), &
      entry_t('scene', 'speed', 'real', 1, '0', 'm/s', '>= 0, < 1e6', 'name: incline', &
      'Speed of the block down the incline at the start'), &
      entry_t('scene', 'motion', 'word', 1, 'none', '', 'none rotation translation oscillation', '', &
      'Prescribed motion of fixed bodies'), &
      entry_t('scene', 'motion_bodies', 'integer', 0, '', '', '', moving, &
      'Identifiers of the fixed bodies that move; left out: all fixed bodies'), &
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
      'Time over which the motion smoothly gets to full speed')]

   !> Groups of the stages of a step, from boxes to forces
   type(entry_t), parameter :: stage_entries(*) = [ &
      entry_t('boxes', 'largest_ratio', 'real', 1, '4', '', '>= 1', '', &
      'A body longer than this many median grain diameters is cut into several boxes'), &
      entry_t('boxes', 'margin', 'real', 1, '0', 'm', '>= 0, <= 1e12', '', &
      'By how much every box is larger on each side, for interactions with a range'), &
      entry_t('neighbours', 'finder', 'word', 1, 'quadtree', '', finders, '', &
      'How pairs of overlapping boxes are found'), &
      entry_t('neighbours', 'skin', 'real', 1, '0', 'm', '>= 0, <= 1e12', 'finder: verlet', &
      'What two boxes may approach before the Verlet list is made anew; 0: from its cost so far'), &
      entry_t('overlap', 'degenerate', 'word', 1, 'push', '', 'push stop', '', &
      'A contact without direction is pushed apart along the line of centres, or stops the run'), &
      entry_t('forces', 'gravity', 'real', 2, '0, -9.81', 'm/s2', '> -1e12, < 1e12', '', &
      'Acceleration of gravity'), &
      entry_t('forces', 'stiffness', 'real', 1, '1e7', 'N/m2', '> 0, <= 1e30', '', &
      'Young''s modulus E in two dimensions'), &
      entry_t('forces', 'law', 'word', 1, 'area', '', 'area conservative', '', &
      'Elastic force: E A/l of the book, or with the energy E G^2/(2 l b), G the effective area'), &
      entry_t('forces', 'damping', 'word', 1, 'rate', '', 'rate hunt_crossley book none', '', &
      'Normal damping by the rate of the area, by that times the elastic force, as in the book, or none'), &
      entry_t('forces', 'damping_coefficient', 'real', 1, '0.0251', '', '>= 0, <= 1e6', &
      'damping: rate hunt_crossley book', &
      'Damping coefficient gamma; some hundreds with hunt_crossley, which takes little at low speed'), &
      entry_t('forces', 'restitution', 'real', 1, '0', '', '>= 0, <= 1', 'damping: rate', &
      'Restitution of flat contacts, 0.01 to 1, in place of `damping_coefficient`; left out: by the latter'), &
      entry_t('forces', 'damping_from_touch', 'logical', 1, '.false.', '', '', 'damping: rate', &
      'Whether damping begins at the touch within the step: restitution of second order in dt'), &
      entry_t('forces', 'tilt_damping', 'real', 1, '0', '', '>= 0, <= 1e6', '', &
      'Damping of tilts as a share of sqrt(k I), k = E L^3/(12 l); 0: none, 2: critical for two bodies'), &
      entry_t('forces', 'friction', 'word', 1, 'cundall_strack', '', 'cundall_strack exact none', '', &
      'Friction by a tangential spring, without one (needs `scheme` velocity_verlet), or none'), &
      entry_t('forces', 'friction_coefficient', 'real', 1, '0.23', '', '>= 0, <= 1e12', &
      'friction: cundall_strack exact', &
      'Friction coefficient mu'), &
      entry_t('forces', 'tangential_stiffness', 'real', 1, '0.2857142857142857', '', '> 0, <= 1e6', &
      'friction: cundall_strack', &
      'Tangential stiffness as a share of E'), &
      entry_t('forces', 'tangential_damping', 'real', 1, '0.25', '', '>= 0, <= 1e6', 'friction: cundall_strack', &
      'Tangential damping as a share of sqrt(k_t m_t)'), &
      entry_t('forces', 'midstep_slip', 'logical', 1, '.false.', '', '', 'friction: cundall_strack', &
      'Whether the slip velocity is taken in the middle of the step: friction of second order in dt'), &
      entry_t('forces', 'friction_tolerance', 'real', 1, '1e-10', '', '> 0, <= 1e-3', 'friction: exact', &
      'Slip that may remain where contacts stick, as a share of the greatest that friction takes in a step')]

   !> What is watched; a body that is nowhere (NaN) stops every run
   type(entry_t), parameter :: guard_entries(*) = [ &
      entry_t('guards', 'displacement', 'word', 1, 'stop', '', 'stop warn off', '', &
      'A body that moves so far in a step that it could pass through another'), &
      entry_t('guards', 'displacement_limit', 'real', 1, '0.25', '', '> 0, <= 1e6', 'displacement: stop warn', &
      'Greatest move of a point in a step, as a share of the thinnest body'), &
      entry_t('guards', 'step', 'word', 1, 'stop', '', 'stop warn off', '', &
      'A time step above the stable one of the contacts; above half of that there is a warning'), &
      entry_t('guards', 'overlap', 'word', 1, 'warn', '', 'stop warn off', '', &
      'A contact that is deep against its bodies'), &
      entry_t('guards', 'overlap_limit', 'real', 1, '0.25', '', '> 0, <= 1e6', 'overlap: stop warn', &
      'Greatest depth (area over length) of a contact, as a share of the thinner body'), &
      entry_t('guards', 'passing', 'word', 1, 'warn', '', 'stop warn off', '', &
      'A body whose centre is inside another, or a contact that turns round in a step'), &
      entry_t('guards', 'energy', 'word', 1, 'off', '', 'stop warn off', '', &
      'Energy that neither gravity nor walls gave; needs the ledger, looks every 100 steps'), &
      entry_t('guards', 'energy_limit', 'real', 1, '0.1', '', '> 0, <= 1e6', 'energy: stop warn', &
      'Greatest such energy, as a share of the energy turned over'), &
      entry_t('guards', 'listed_depth', 'real', 1, '1e-3', '', '>= 0, <= 1e6', '', &
      'Contacts at the start that are deeper than this share of the thinner body are listed one by one'), &
      entry_t('guards', 'relaxed_depth', 'real', 1, '0', '', '>= 0, <= 1e6', '', &
      'Bodies are pushed apart before time 0 until no contact is deeper than this share; 0: they are not')]

   !> Groups of the run
   type(entry_t), parameter :: run_entries(*) = [ &
      entry_t('integrate', 'scheme', 'word', 1, 'velocity_verlet', '', 'velocity_verlet gear gear_3_20', '', &
      'Integration scheme; Gear corrects positions by 3/16, or 3/20, meant for forces of positions alone'), &
      entry_t('integrate', 'accumulation', 'word', 1, 'plain', '', 'plain compensated', 'scheme: velocity_verlet', &
      'Sums of positions and velocities over steps as they are, or with what rounding takes carried along'), &
      entry_t('integrate', 'dt', 'real', 1, '0', 's', '>= 0', '', &
      'Time step; 0: `fraction` of the stable step'), &
      entry_t('integrate', 'fraction', 'real', 1, '0.3', '', '> 0', '', &
      'Share of the stable step that is taken if `dt` is 0'), &
      entry_t('integrate', 'duration', 'real', 1, required, 's', '> 0', '', &
      'Simulated time'), &
      entry_t('exchange', 'cut', 'word', 1, 'bisection', '', 'bisection morton', '', &
      'How space is divided among processes: by cuts across its longer side, or along Morton''s curve'), &
      entry_t('exchange', 'margin', 'real', 1, '0', 'm', '>= 0, <= 1e12', '', &
      'How far bodies may move until neighbouring processes are found anew; 0: from how often they are'), &
      entry_t('exchange', 'balance', 'word', 1, 'measured', '', 'measured counted off', '', &
      'Work that processes share evenly: as timed, as counted in pairs, or as it fell at the start'), &
      entry_t('exchange', 'imbalance', 'real', 1, '1.1', '', '>= 1, <= 1e6', 'balance: measured counted', &
      'Greatest work of a process over the mean at which space is divided anew'), &
      entry_t('output', 'folder', 'path', 1, '', '', '', '', &
      'Folder of the result; empty: results/ and the name of the namelist file'), &
      entry_t('output', 'frame_interval', 'real', 1, '0', 's', '>= 0', '', &
      'Simulated time between two frames; 0: the first and the last frame only'), &
      entry_t('output', 'frames_per_segment', 'integer', 1, '20', '', '>= 1', '', &
      'Frames in a file of the trajectory'), &
      entry_t('output', 'log_interval', 'real', 1, '0', 's', '>= 0', '', &
      'Simulated time between two lines of the log; 0: twenty lines in all'), &
      entry_t('output', 'contacts', 'logical', 1, '.false.', '', '', '', &
      'Whether frames hold the contacts'), &
      entry_t('output', 'ledger', 'logical', 1, '.true.', '', '', '', &
      'Whether energy and momentum are booked'), &
      entry_t('output', 'trace_steps', 'integer', 1, '0', '', '>= 0', '', &
      'Steps whose boxes are recorded in trace.h5'), &
      entry_t('output', 'trace_start', 'real', 1, '0', 's', '>= 0, <= 1e12', '', &
      'Simulated time at which the recording of boxes starts'), &
      entry_t('output', 'step_profile', 'logical', 1, '.false.', '', '', '', &
      'Whether steps.h5 tells the times and counts of every single step'), &
      entry_t('checkpoint', 'steps', 'integer', 1, '0', '', '>= 0', '', &
      'Steps between two checkpoints, from which a run can go on; 0: not by steps'), &
      entry_t('checkpoint', 'interval', 'real', 1, '0', 's', '>= 0', '', &
      'Simulated time between two checkpoints; 0: not by simulated time'), &
      entry_t('checkpoint', 'elapsed', 'real', 1, '600', 's', '>= 0', '', &
      'Elapsed time between two checkpoints; 0: not by elapsed time')]

   !> The group of a bench
   type(entry_t), parameter :: bench_entries(*) = [ &
      entry_t(bench_group, 'scenes', 'path', 0, required, '', '', '', &
      'Scenes to measure, each a trace or a namelist file with overrides (file.nml group.key=value ...)'), &
      entry_t(bench_group, 'names', 'path', 0, required, '', '', '', &
      'One name per scene: letters, digits, . and _'), &
      entry_t(bench_group, 'prepare', 'path', 0, '', '', '', '', &
      'Namelist files with overrides that are run before all scenes, unless their results are there'), &
      entry_t(bench_group, 'finders', 'word', 0, required, '', finders, '', &
      'Neighbour finders to measure'), &
      entry_t(bench_group, 'threads', 'integer', 0, '1', '', '>= 1, <= 9999', '', &
      'Numbers of threads to measure with'), &
      entry_t(bench_group, 'repeats', 'integer', 1, '7', '', '>= 1, <= 9999', '', &
      'Timed repeats, after a warm-up in which every list is checked'), &
      entry_t(bench_group, 'mode', 'word', 1, 'replay', '', 'replay live', '', &
      'Whether recorded boxes are replayed or whole time steps are done'), &
      entry_t(bench_group, 'steps', 'integer', 1, '0', '', '>= 0', '', &
      'Steps of a sample; 0: all of the trace, or (live) as many as `trace_steps` of the scene'), &
      entry_t(bench_group, 'folder', 'path', 1, '', '', '', '', &
      'Folder of traces and samples; empty: results/ and the name of the namelist file')]

   !> The table
   type(entry_t), parameter :: entries(*) = [scene_entries, stage_entries, guard_entries, run_entries, bench_entries]

contains

   !> First row of an entry; 0 if there is no such entry
   pure integer function first_row(group, key)
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Name in the group
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

   !> Names of the entries of a group in the order of the table, each once
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

   !> Choices of a word entry, for instance the names of the finders
   pure function choices_of(group, key) result(words)
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Name in the group; the entry must exist
      character(len=*), intent(in) :: key
      character(len=allowed_length) :: words(count_words(entries(first_row(group, key))%allowed))

      words = split_words(entries(first_row(group, key))%allowed)
   end function choices_of

end module polydem_namelist_entries
