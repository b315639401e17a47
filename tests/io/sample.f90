!> A small artificial state with known numbers, for the tests of writers and readers.
module sample
   use polydem_bodies, only: bodies_t, turn_bodies
   use polydem_contacts, only: contacts_t, reserve_contacts
   use polydem_counters, only: counters_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: dp, ip, lp, wp
   use polydem_named_values, only: named_values_t
   use polydem_profile_file, only: write_profile
   use polydem_provenance, only: collect_provenance, provenance_t
   use polydem_timers, only: timers_t
   implicit none
   private
   public :: sample_bodies, sample_contacts, sample_row, sample_provenance, write_sample_profile

contains

   !> Three bodies at a given step: a fixed square 10, a triangle 20, a square 30 at (step, 0.5).
   !>
   !> Angle of body k: k*step/8; velocity (k, -step); angular velocity k + step/4.
   subroutine sample_bodies(step, bodies)
      !> Number of the step
      integer(lp), intent(in) :: step
      !> The bodies
      type(bodies_t), intent(out) :: bodies
      real(wp) :: t
      integer(ip) :: k

      t = real(step, wp)
      bodies%n = 3_ip
      bodies%id = [10_ip, 20_ip, 30_ip]
      bodies%fixed = [.true., .false., .false.]
      bodies%free = [2_ip, 3_ip]
      bodies%in_halo = [.false., .false., .false.]
      bodies%global_index = [1_ip, 2_ip, 3_ip]
      bodies%n_all = 3_ip
      bodies%mass = [0.0_wp, 2.0_wp, 4.0_wp]
      bodies%inertia = [0.0_wp, 0.5_wp, 0.25_wp]
      bodies%pieces%vertex_start = [1_ip, 5_ip, 8_ip, 12_ip]
      bodies%pieces%vertex = reshape([-1.0_wp, -1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, 1.0_wp, -1.0_wp, 1.0_wp, &
                              -1.0_wp, -1.0_wp, 2.0_wp, -1.0_wp, -1.0_wp, 2.0_wp, &
                              -0.5_wp, -0.5_wp, 0.5_wp, -0.5_wp, 0.5_wp, 0.5_wp, -0.5_wp, 0.5_wp], [2, 11])
      bodies%position = reshape([0.0_wp, 0.0_wp, -t, 3.0_wp, t, 0.5_wp], [2, 3])
      bodies%angle = [(real(k, wp)*t/8.0_wp, k=1_ip, 3_ip)]
      bodies%velocity = reshape([1.0_wp, -t, 2.0_wp, -t, 3.0_wp, -t], [2, 3])
      bodies%angular_velocity = [(real(k, wp) + t/4.0_wp, k=1_ip, 3_ip)]
      bodies%force = reshape([t, 2.0_wp*t, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], [2, 3])
      bodies%torque = [-t, 0.0_wp, 0.0_wp]
      allocate (bodies%pieces%turned(2, 11))
      call turn_bodies(bodies, [1_ip, 2_ip, 3_ip])
   end subroutine sample_bodies

   !> Contacts of bodies 10 and 30: step modulo 3 in number; contact c has the area step + c.
   subroutine sample_contacts(step, contacts)
      !> Number of the step
      integer(lp), intent(in) :: step
      !> The contacts
      type(contacts_t), intent(out) :: contacts
      integer(ip) :: c

      contacts%n = int(mod(step, 3_lp), ip)
      call reserve_contacts(contacts, contacts%n)
      do c = 1_ip, contacts%n
         contacts%row(c)%first = 1_ip
         contacts%row(c)%second = 3_ip
         contacts%row(c)%area = real(step, wp) + real(c, wp)
         contacts%row(c)%arm_first = [0.25_wp, real(c, wp)]
         contacts%row(c)%normal = [0.0_wp, 0.125_wp]
         contacts%row(c)%depth = contacts%row(c)%area/0.125_wp
         contacts%row(c)%direction = [1.0_wp, 0.0_wp]
         contacts%row(c)%normal_force = real(c, wp)
         contacts%row(c)%tangential_force = -real(step, wp)
      end do
   end subroutine sample_contacts

   !> Two entries of the energy balance
   subroutine sample_row(step, row)
      !> Number of the step
      integer(lp), intent(in) :: step
      !> kinetic = step/2 and momentum_x = -step
      type(named_values_t), intent(inout) :: row

      call row%set('kinetic', 0.5_wp*real(step, wp), 'J/m', 'kinetic energy')
      call row%set('momentum_x', -real(step, wp), 'kg/s', 'momentum along x')
   end subroutine sample_row

   !> Provenance with an input of two lines
   subroutine sample_provenance(provenance)
      !> Provenance of this program
      type(provenance_t), intent(out) :: provenance

      call collect_provenance(provenance, 'sample.nml', '&scene'//new_line('a')//'/ ! ½', 'scene%seed = 7', 7_ip)
   end subroutine sample_provenance

   !> Profile with two stages that ran and two counters
   subroutine write_sample_profile(folder, error)
      !> Folder of the result
      character(len=*), intent(in) :: folder
      !> Allocated on failure
      type(error_t), allocatable, intent(inout) :: error
      type(provenance_t) :: provenance
      type(timers_t) :: timers
      type(counters_t) :: counters

      call sample_provenance(provenance)
      timers%calls(1:2) = [4_lp, 2_lp]
      timers%total(1:2) = [1.0_dp, 0.5_dp]
      timers%least(1:2) = [0.125_dp, 0.25_dp]
      timers%most(1:2) = [0.5_dp, 0.25_dp]
      call counters%set('pairs', 5000000000_lp)
      call counters%set('contacts', 12_lp)
      call write_profile(folder, timers, 2.0_dp, counters, provenance, 81985529216486895_lp, 'finished', '', error)
   end subroutine write_sample_profile

end module sample
