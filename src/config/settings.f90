!> The settings of a run: one type per namelist group, immutable once read.
!>
!> Defaults are not stated here but in `namelist_entries`, once.
module polydem_settings
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: settings_t, scene_settings_t, boxes_settings_t, neighbours_settings_t, overlap_settings_t
   public :: exchange_settings_t
   public :: forces_settings_t, integrate_settings_t, guards_settings_t, output_settings_t, checkpoint_settings_t

   !> Group &scene: what there is at the start
   type :: scene_settings_t
      !> Name of the generator, or 'file'
      character(len=:), allocatable :: name
      !> Bodies file (HDF5) of the scene 'file'
      character(len=:), allocatable :: bodies_file
      !> Seed of the random generator
      integer(ip) :: seed
      !> Number of boxes, walls included (drum); 0: use `bodies`
      integer(ip) :: boxes
      !> Number of free bodies
      integer(ip) :: bodies
      !> Result folder, segment or bodies file of a settled bed to fill the container with; empty: loose grains
      character(len=:), allocatable :: packing
      !> Least number of corners of a grain
      integer(ip) :: corners_min
      !> Greatest number of corners of a grain
      integer(ip) :: corners_max
      !> Full short axis of the ellipse around a grain [m]
      real(wp) :: short_axis
      !> Least full long axis of the ellipse around a grain [m]
      real(wp) :: long_axis_min
      !> Greatest full long axis of the ellipse around a grain [m]
      real(wp) :: long_axis_max
      !> Factor of both axes of the largest grain; 1: all alike
      real(wp) :: size_ratio
      !> Order of the identifiers of the grains: 'natural' or 'descending'
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
      !> Share of the area covered by grains (gas, channel)
      real(wp) :: fraction
      !> Whether grains may overlap each other at the start (gas)
      logical :: overlap
      !> Root mean square speed of the grains, or speed of the block (incline), at the start [m/s]
      real(wp) :: speed
      !> Root mean square angular velocity of the grains at the start (gas, channel) [rad/s]
      real(wp) :: spin
      !> Number of grains that get a speed at the start (gas, channel); 0: all
      integer(ip) :: movers
      !> Prescribed motion of walls: none, rotation, translation or oscillation
      character(len=:), allocatable :: motion
      !> Identifiers of the fixed bodies that move; empty: all fixed bodies
      integer(ip), allocatable :: motion_bodies(:)
      !> Pivot of a rotation [m]
      real(wp) :: motion_pivot(2)
      !> Rate of a rotation, anticlockwise [1/s, revolutions per second]
      real(wp) :: motion_rate
      !> Velocity of a translation [m/s]
      real(wp) :: motion_velocity(2)
      !> Amplitude of an oscillation [m]
      real(wp) :: motion_amplitude(2)
      !> Frequency of an oscillation [Hz]
      real(wp) :: motion_frequency
      !> Time at which the motion starts [s]
      real(wp) :: motion_start
      !> Time over which the motion gets to full speed [s]
      real(wp) :: motion_ramp
   end type scene_settings_t

   !> Group &boxes
   type :: boxes_settings_t
      !> A body longer than this many median grain diameters is cut into several boxes
      real(wp) :: largest_ratio
      !> By how much every box is larger on each side [m]
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
      !> What to do with a contact that has no direction: 'push' along the line of centres, or 'stop'
      character(len=:), allocatable :: degenerate
   end type overlap_settings_t

   !> Group &forces
   type :: forces_settings_t
      !> Acceleration of gravity, (2) [m/s2]
      real(wp) :: gravity(2)
      !> Young's modulus E in two dimensions [N/m2]
      real(wp) :: stiffness
      !> Elastic force: 'area' or 'conservative'
      character(len=:), allocatable :: law
      !> Normal damping: 'rate', 'hunt_crossley', 'book' or 'none'
      character(len=:), allocatable :: damping
      !> Dimensionless damping coefficient gamma
      real(wp) :: damping_coefficient
      !> Whether damping begins at the touch, not with the step in which it is first seen
      logical :: damping_from_touch = .false.
      !> Restitution of a flat contact, in place of the damping coefficient; 0: not given
      real(wp) :: restitution
      !> Damping of tilts as a share of sqrt(k I_eff)
      real(wp) :: tilt_damping = 0.0_wp
      !> Friction: 'cundall_strack', 'exact' or 'none'
      character(len=:), allocatable :: friction
      !> Friction coefficient mu
      real(wp) :: friction_coefficient
      !> Tangential stiffness as a share of E
      real(wp) :: tangential_stiffness
      !> Tangential damping as a share of sqrt(k_t m_t)
      real(wp) :: tangential_damping
      !> Whether the slip velocity in the middle of the step extends the tangential spring, not that at its end
      logical :: midstep_slip = .false.
      !> Slip that exact friction may leave, as a share of the greatest slip velocity it takes from a contact in a step
      real(wp) :: friction_tolerance
   end type forces_settings_t

   !> Group &integrate
   type :: integrate_settings_t
      !> 'velocity_verlet', 'gear' or 'gear_3_20'
      character(len=:), allocatable :: scheme
      !> Sums of velocity Verlet over steps: 'plain' or 'compensated'
      character(len=:), allocatable :: accumulation
      !> Time step [s]; 0: `fraction` of the stable step
      real(wp) :: dt
      !> Share of the stable step that is taken if dt is 0
      real(wp) :: fraction
      !> Simulated time [s]
      real(wp) :: duration
   end type integrate_settings_t

   !> Group &guards: what is watched, and whether it stops the run, warns or is 'off'
   type :: guards_settings_t
      !> Move of a body in a step: 'stop', 'warn' or 'off'
      character(len=:), allocatable :: displacement
      !> Greatest move in a step as a share of the thinnest body
      real(wp) :: displacement_limit
      !> Time step against the stable one of the contacts: 'stop', 'warn' or 'off'
      character(len=:), allocatable :: step
      !> Depth of contacts: 'stop', 'warn' or 'off'
      character(len=:), allocatable :: overlap
      !> Greatest depth as a share of the thinner body
      real(wp) :: overlap_limit
      !> Centres inside other bodies, contacts that turn round: 'stop', 'warn' or 'off'
      character(len=:), allocatable :: passing
      !> Energy that neither gravity nor walls gave: 'stop', 'warn' or 'off'
      character(len=:), allocatable :: energy
      !> Greatest such energy as a share of the energy turned over
      real(wp) :: energy_limit
      !> Contacts at the start deeper than this share of the thinner body are listed
      real(wp) :: listed_depth
      !> Contacts at the start are pushed apart to this share of the thinner body; 0: not
      real(wp) :: relaxed_depth
   end type guards_settings_t

   !> Group &output
   type :: output_settings_t
      !> Folder of the result; empty: results/<name of the input file>
      character(len=:), allocatable :: folder
      !> Simulated time between two frames [s]; 0: none but the first and last
      real(wp) :: frame_interval
      !> Frames per trajectory segment
      integer(ip) :: frames_per_segment
      !> Simulated time between two lines of the log [s]; 0: twenty lines
      real(wp) :: log_interval
      !> Whether frames hold the contacts
      logical :: contacts
      !> Whether energy and momentum are booked
      logical :: ledger
      !> Steps whose boxes are recorded; 0: none
      integer(ip) :: trace_steps
      !> Simulated time at which the recording starts [s]
      real(wp) :: trace_start
      !> Whether times and counts of every step are kept
      logical :: step_profile
   end type output_settings_t

   !> Group &exchange: how processes share the bodies; without effect on results
   type :: exchange_settings_t
      !> How space is divided: 'bisection' or 'morton'
      character(len=:), allocatable :: cut
      !> How far bodies may move until neighbours are found anew [m]; 0: automatic
      real(wp) :: margin
      !> What is shared evenly: 'measured' or 'counted' work, or nothing after the start: 'off'
      character(len=:), allocatable :: balance
      !> Greatest work over the mean at which space is divided anew
      real(wp) :: imbalance
   end type exchange_settings_t

   !> Group &checkpoint; whichever of the intervals has passed first makes the next checkpoint
   type :: checkpoint_settings_t
      !> Steps between two checkpoints; 0: not by steps
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
      !> The namelist as it was read, with a line end after each line
      character(len=:), allocatable :: text
      !> Every group with every entry as it is in force, one per line
      character(len=:), allocatable :: resolved
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

end module polydem_settings
