!> Settings of a run: one type per namelist group. They do not change after reading.
!>
!> The defaults are in `namelist_entries`.
module polydem_settings
   use polydem_kinds, only: ip, wp
   use polydem_namelist_entries, only: first_row
   use polydem_strings, only: text_t
   implicit none
   private
   public :: settings_t, scene_settings_t, boxes_settings_t, neighbours_settings_t, overlap_settings_t
   public :: exchange_settings_t
   public :: place_of
   public :: forces_settings_t, integrate_settings_t, guards_settings_t, output_settings_t, checkpoint_settings_t

   !> Group &scene: bodies, walls and motions at the start
   type :: scene_settings_t
      !> Name of the generator, or 'file'
      character(len=:), allocatable :: name
      !> Path of the bodies file (HDF5) of the scene 'file'
      character(len=:), allocatable :: bodies_file
      !> Seed of the random number generator
      integer(ip) :: seed
      !> Number of boxes including those of walls (drum); 0: use `bodies`
      integer(ip) :: boxes
      !> Number of free bodies
      integer(ip) :: bodies
      !> Result folder, segment or bodies file of a settled bed; copies of it fill the container. Empty: loose grains
      character(len=:), allocatable :: packing
      !> Smallest number of corners of a grain
      integer(ip) :: corners_min
      !> Largest number of corners of a grain
      integer(ip) :: corners_max
      !> Short axis (full length) of the ellipse around a grain [m]
      real(wp) :: short_axis
      !> Smallest long axis (full length) of the ellipse around a grain [m]
      real(wp) :: long_axis_min
      !> Largest long axis (full length) of the ellipse around a grain [m]
      real(wp) :: long_axis_max
      !> Size factor (both axes) of the largest grain; the smallest grain has factor 1
      real(wp) :: size_ratio
      !> Order of the identifiers of the grains: 'natural' (as generated) or 'descending' (from right to left)
      character(len=:), allocatable :: order
      !> Density of the grains [kg/m2 per metre of depth, that is kg/m3]
      real(wp) :: density
      !> Radius of the drum [m]; 0: from the number of grains
      real(wp) :: radius
      !> Width of the container, of the floor (heap) or of a block [m]; 0: from the number of grains
      real(wp) :: width
      !> Height of a block [m]
      real(wp) :: height
      !> Opening of the hopper [m]
      real(wp) :: opening
      !> Slope of the incline or of the hopper walls [degree]
      real(wp) :: slope
      !> Fraction of the area that grains cover (gas, channel)
      real(wp) :: fraction
      !> Whether grains may overlap each other at the start (gas)
      logical :: overlap
      !> Root mean square speed of the grains, or speed of the block (incline), at the start [m/s]
      real(wp) :: speed
      !> Root mean square angular velocity of the grains at the start (gas, channel) [rad/s]
      real(wp) :: spin
      !> Number of grains that get a speed at the start (gas, channel); 0: all
      integer(ip) :: movers
      !> Prescribed motion of walls: 'none', 'rotation', 'translation' or 'oscillation'
      character(len=:), allocatable :: motion
      !> Identifiers of the fixed bodies that move, (body); empty: all fixed bodies
      integer(ip), allocatable :: motion_bodies(:)
      !> Pivot of a rotation, (2) [m]
      real(wp) :: motion_pivot(2)
      !> Rate of a rotation, anticlockwise [1/s, revolutions per second]
      real(wp) :: motion_rate
      !> Velocity of a translation, (2) [m/s]
      real(wp) :: motion_velocity(2)
      !> Amplitude of an oscillation, (2) [m]
      real(wp) :: motion_amplitude(2)
      !> Frequency of an oscillation [Hz]
      real(wp) :: motion_frequency
      !> Time at which the motion starts [s]
      real(wp) :: motion_start
      !> Time in which the motion reaches full speed [s]
      real(wp) :: motion_ramp
   end type scene_settings_t

   !> Group &boxes
   type :: boxes_settings_t
      !> Ratio of length to median diameter above which a body has several boxes
      real(wp) :: largest_ratio
      !> Enlargement of every box on each side [m]
      real(wp) :: margin
   end type boxes_settings_t

   !> Group &neighbours
   type :: neighbours_settings_t
      !> Name of the neighbour finder
      character(len=:), allocatable :: finder
      !> Skin of a Verlet list [m]; 0: automatic
      real(wp) :: skin
   end type neighbours_settings_t

   !> Group &overlap
   type :: overlap_settings_t
      !> Treatment of a contact without direction: 'push' along the line of centres, or 'stop' the run
      character(len=:), allocatable :: degenerate
   end type overlap_settings_t

   !> Group &forces
   type :: forces_settings_t
      !> Acceleration of gravity, (2) [m/s2]
      real(wp) :: gravity(2)
      !> Young's modulus E in two dimensions [N/m2]
      real(wp) :: stiffness
      !> Elastic force: a choice of the entry `law`
      character(len=:), allocatable :: law
      !> Normal damping: a choice of the entry `damping`
      character(len=:), allocatable :: damping
      !> Dimensionless damping coefficient gamma
      real(wp) :: damping_coefficient
      !> Whether damping starts at the time of first touch within the step, not at the start of that step
      logical :: damping_from_touch = .false.
      !> Restitution of a flat contact, in place of the damping coefficient; 0: not given
      real(wp) :: restitution
      !> Damping of tilting in units of sqrt(k I_eff)
      real(wp) :: tilt_damping = 0.0_wp
      !> Friction: a choice of the entry `friction`
      character(len=:), allocatable :: friction
      !> Friction coefficient mu
      real(wp) :: friction_coefficient
      !> Tangential stiffness in units of E
      real(wp) :: tangential_stiffness
      !> Tangential damping in units of sqrt(k_t m_t)
      real(wp) :: tangential_damping
      !> Whether the tangential spring uses the slip velocity at mid-step, not that at the end of the step
      logical :: midstep_slip = .false.
      !> Slip velocity that exact friction may leave at sticking contacts, relative to the largest slip velocity that
      !> friction removes from a contact in a step
      real(wp) :: friction_tolerance
   end type forces_settings_t

   !> Group &integrate
   type :: integrate_settings_t
      !> Integration scheme: 'velocity_verlet', 'gear' or 'gear_3_20'
      character(len=:), allocatable :: scheme
      !> Summation of velocity Verlet over the steps: 'plain' or 'compensated'
      character(len=:), allocatable :: accumulation
      !> Time step [s]; 0: `fraction` times the stable time step
      real(wp) :: dt
      !> Time step over stable time step if dt is 0
      real(wp) :: fraction
      !> Simulated time [s]
      real(wp) :: duration
   end type integrate_settings_t

   !> Group &guards: monitors of a run. Each one stops the run ('stop'), warns ('warn') or is 'off'
   type :: guards_settings_t
      !> Monitor of the displacement of a body in a step: 'stop', 'warn' or 'off'
      character(len=:), allocatable :: displacement
      !> Largest allowed displacement in a step relative to the thickness of the thinnest body
      real(wp) :: displacement_limit
      !> Monitor of the time step relative to the stable time step of the contacts: 'stop', 'warn' or 'off'
      character(len=:), allocatable :: step
      !> Monitor of the depth of contacts: 'stop', 'warn' or 'off'
      character(len=:), allocatable :: overlap
      !> Largest allowed depth relative to the thickness of the thinner body
      real(wp) :: overlap_limit
      !> Monitor of centres inside other bodies and of contacts whose direction reverses: 'stop', 'warn' or 'off'
      character(len=:), allocatable :: passing
      !> Monitor of unexplained energy gain (not from gravity or walls): 'stop', 'warn' or 'off'
      character(len=:), allocatable :: energy
      !> Largest allowed unexplained energy gain relative to the largest kinetic energy or work so far
      real(wp) :: energy_limit
      !> Depth above which contacts at the start are listed, relative to the thickness of the thinner body
      real(wp) :: listed_depth
      !> Depth to which contacts at the start are pushed apart, relative to the thickness of the thinner body; 0: not
      !> pushed apart
      real(wp) :: relaxed_depth
   end type guards_settings_t

   !> Group &output
   type :: output_settings_t
      !> Result folder; empty: results/<name of the namelist file>
      character(len=:), allocatable :: folder
      !> Simulated time between two frames [s]; 0: only the first and the last frame
      real(wp) :: frame_interval
      !> Number of frames of a trajectory segment
      integer(ip) :: frames_per_segment
      !> Simulated time between two lines of the log [s]; 0: twenty lines
      real(wp) :: log_interval
      !> Whether frames contain the contacts
      logical :: contacts
      !> Whether the energy and momentum balance is computed
      logical :: ledger
      !> Number of steps whose boxes are recorded; 0: none
      integer(ip) :: trace_steps
      !> Simulated time at which the recording starts [s]
      real(wp) :: trace_start
      !> Whether the times and counts of every step are written
      logical :: step_profile
   end type output_settings_t

   !> Group &exchange: distribution of the bodies over ranks. It does not affect results
   type :: exchange_settings_t
      !> Partition of space: 'bisection' or 'morton'
      character(len=:), allocatable :: cut
      !> Distance that bodies may move before ranks search for neighbouring ranks again [m]; 0: automatic
      real(wp) :: margin
      !> Load that is balanced: 'measured' or 'counted' work; 'off': no balancing after the start
      character(len=:), allocatable :: balance
      !> Ratio of the largest to the mean load of a rank above which space is partitioned again
      real(wp) :: imbalance
   end type exchange_settings_t

   !> Group &checkpoint. The next checkpoint is written when the first of the intervals has passed
   type :: checkpoint_settings_t
      !> Number of steps between two checkpoints; 0: not by steps
      integer(ip) :: steps
      !> Simulated time between two checkpoints [s]; 0: not by simulated time
      real(wp) :: interval
      !> Elapsed time between two checkpoints [s]; 0: not by elapsed time
      real(wp) :: elapsed
   end type checkpoint_settings_t

   !> All settings of a run
   type :: settings_t
      !> Path of the namelist file, for messages
      character(len=:), allocatable :: file
      !> Text of the namelist file, with a line end after each line
      character(len=:), allocatable :: text
      !> Every entry in use with its value, one per line, as namelist text
      character(len=:), allocatable :: resolved
      !> Where each entry was given, (rows of the table); not allocated in settings that no text gave
      type(text_t), allocatable :: places(:)
      !> Group &scene
      type(scene_settings_t) :: scene
      !> Group &boxes
      type(boxes_settings_t) :: boxes
      !> Group &neighbours
      type(neighbours_settings_t) :: neighbours
      !> Group &overlap
      type(overlap_settings_t) :: overlap
      !> Group &forces
      type(forces_settings_t) :: forces
      !> Group &integrate
      type(integrate_settings_t) :: integrate
      !> Group &guards
      type(guards_settings_t) :: guards
      !> Group &output
      type(output_settings_t) :: output
      !> Group &exchange
      type(exchange_settings_t) :: exchange
      !> Group &checkpoint
      type(checkpoint_settings_t) :: checkpoint
   end type settings_t

contains

   !> Where an entry was given, for the beginning of a message: file:line, --set group.key=value, or the file alone
   pure function place_of(settings, group, key) result(place)
      !> All settings
      type(settings_t), intent(in) :: settings
      !> Namelist group
      character(len=*), intent(in) :: group
      !> Name in the group; the entry must exist
      character(len=*), intent(in) :: key
      character(len=:), allocatable :: place

      place = settings%file
      if (allocated(settings%places)) place = settings%places(first_row(group, key))%text
   end function place_of

end module polydem_settings
