!> What the start of a simulation finds out about its scene.
module polydem_start_findings
   use polydem_kinds, only: ip, lp, wp
   implicit none
   private
   public :: relaxation_t, expected_impact_t, static_pressure_t

   !> Summary of the relaxation before time 0
   type :: relaxation_t
      !> Number of sweeps, 0 if no relaxation was necessary
      integer(ip) :: sweeps = 0_ip
      !> Depth of the deepest contact before and after, as a fraction of the thickness of the thinner body
      real(wp) :: before = 0.0_wp, after = 0.0_wp
      !> Greatest displacement of the centre of a body [m]
      real(wp) :: move = 0.0_wp
      !> Positions before the relaxation, allocated while it lasts, (2, slot) [m]
      real(wp), allocatable :: from(:, :)
   end type relaxation_t

   !> The impact for which the time step is chosen
   type :: expected_impact_t
      !> Speed of approach [m/s]
      real(wp) :: speed = 0.0_wp
      !> Where the speed comes from
      character(len=:), allocatable :: origin
      !> Depth of the contact of two equal bodies, area over length [m]
      real(wp) :: depth = 0.0_wp
      !> Length of this contact [m], and its stable step over that without dashpots
      real(wp) :: length = 0.0_wp, damped = 1.0_wp
      !> Identifier of the body whose contacts limit the step; 0 if there is no free body
      integer(lp) :: body = 0_lp
   end type expected_impact_t

   !> The greatest static pressure of the scene
   type :: static_pressure_t
      !> Pressure; 0: there is none [N/m2]
      real(wp) :: greatest = 0.0_wp
      !> Where it comes from
      character(len=:), allocatable :: origin
      !> Whether it is the weight of the free bodies
      logical :: is_of_bodies = .false.
   end type static_pressure_t

end module polydem_start_findings
