!> Benchmark B24: a floor acts alike however it is cut into pieces.
!>
!> A square falls on a floor in one piece, on the same floor given twice, and on floors of pieces of 2, 1 and 0.2 mm, on
!> a face and on a corner, at two speeds. Expected is the restitution of the namelist, except with the area law also at
!> corners; with the area law corners have another one, which must be that of the whole floor. The contacts of a body
!> with several fixed bodies share the dashpot (`contact_shares`). With the polar law the static depth is that of the
!> whole floor, too (`joined_overlaps`). Shown are what no sharing mends: the static depth with the other laws, the
!> restitution of a given damping coefficient, and, with the area law, that of a corner whose contact is longer than a
!> piece: its parts have other lengths l than the whole.
module b24_cut_floor
   use outlines, only: gravity, pi
   use trial, only: begin, block_at, steps
   use verification_table, only: table_t
   use polydem_body_list, only: body_list_t
   use polydem_errors, only: error_t
   use polydem_kinds, only: wp
   use polydem_simulation, only: simulation_t
   use polydem_strings, only: to_text
   implicit none
   private
   public :: run_cut_floor

   !> Side of the square, and distance of its fall [m]
   real(wp), parameter :: width = 0.01_wp, gap = 2.0e-5_wp
   !> Lengths of the pieces; 0: one piece, negative: the whole floor twice [m]
   real(wp), parameter :: cuts(5) = [0.0_wp, -1.0_wp, 2.0e-3_wp, 1.0e-3_wp, 2.0e-4_wp]

   !> The contact of the corner is up to about 1.2 mm long; pieces below this length cut it into several [m]
   real(wp), parameter :: narrow = 5.0e-4_wp

contains

   !> Impacts on faces and corners, and static depths.
   subroutine run_cut_floor(table, thorough)
      !> Table to fill
      type(table_t), intent(inout) :: table
      !> Whether to take all cuts and speeds
      logical, intent(in) :: thorough
      character(len=12), parameter :: laws(3) = [character(len=12) :: 'conservative', 'area', 'polar']
      character(len=:), allocatable :: name
      real(wp) :: e, whole, depth, deep
      integer :: corner, j, k, v

      call table%begin('B24', 'floors in pieces')
      do j = 1, 3
         do corner = 0, 1
            whole = 0.0_wp
            do k = 1, merge(5, 3, thorough)
               do v = 1, merge(2, 1, thorough)
                  call bounce(table, laws(j), 'restitution = 0.5', cuts(k), corner == 1, 0.5_wp**(4*v - 3), e)
                  if (k == 1 .and. v == 1) whole = merge(0.5_wp, e, j /= 2 .or. corner == 0)
                  name = trim(laws(j))//', '//trim(merge('corner', 'face  ', corner == 1))//', '//cut_text(cuts(k))// &
                         ', '//trim(merge('0.5 m/s ', '0.03 m/s', v == 1))//': restitution'
                  if (j == 2 .and. corner == 1 .and. cuts(k) > 0.0_wp .and. cuts(k) < narrow) then
                     call table%show(name, e)
                  else
                     call table%expect_absolute(name, whole, e, 0.03_wp*whole)
                  end if
               end do
            end do
         end do
         call rest_on(table, laws(j), cuts(1), depth)
         do k = 2, merge(5, 3, thorough)
            call rest_on(table, laws(j), cuts(k), deep)
            name = trim(laws(j))//', '//cut_text(cuts(k))//': static depth over that of the whole floor'
            if (j == 3 .and. cuts(k) > 0.0_wp) then
               call table%expect_absolute(name, 1.0_wp, deep/depth, 1.0e-6_wp)
            else
               call table%show(name, deep/depth)
            end if
         end do
         do k = 1, merge(5, 3, thorough)
            call bounce(table, laws(j), 'damping_coefficient = 0.2', cuts(k), .false., 0.5_wp, e)
            call table%show(trim(laws(j))//', face, '//cut_text(cuts(k))//', coefficient 0.2: restitution', e)
         end do
      end do
   end subroutine run_cut_floor

   !> Words for a cut
   function cut_text(cut) result(text)
      real(wp), intent(in) :: cut
      character(len=:), allocatable :: text

      text = 'whole'
      if (cut < 0.0_wp) text = 'twice'
      if (cut > 0.0_wp) text = 'pieces of '//to_text(nint(1.0e6_wp*cut))//' um'
   end function cut_text

   !> List the pieces of a floor.
   subroutine cut_floor(cut, list)
      real(wp), intent(in) :: cut
      type(body_list_t), intent(out) :: list
      integer :: k, n

      if (cut <= 0.0_wp) then
         do k = 1, merge(2, 1, cut < 0.0_wp)
            call list%append(block_at(0.0_wp, -0.05_wp, 4.1_wp*width, 0.1_wp, 0.0_wp), fixed=.true.)
         end do
      else
         n = nint(2.05_wp*width/cut)
         do k = -n, n
            call list%append(block_at(k*cut, -0.05_wp, cut, 0.1_wp, 0.0_wp), fixed=.true.)
         end do
      end if
   end subroutine cut_floor

   !> Restitution of an impact without gravity and friction
   subroutine bounce(table, law, damping, cut, on_corner, speed, restitution)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: law, damping
      real(wp), intent(in) :: cut
      logical, intent(in) :: on_corner
      !> Speed of the impact [m/s]
      real(wp), intent(in) :: speed
      real(wp), intent(out) :: restitution
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error
      real(wp) :: height

      restitution = huge(restitution)
      call cut_floor(cut, list)
      height = merge(sqrt(0.5_wp), 0.5_wp, on_corner)*width
      call list%append(block_at(0.0_wp, height + gap, width, width, merge(0.25_wp*pi, 0.0_wp, on_corner)), &
                       velocity=[0.0_wp, -speed])
      call begin("&forces gravity = 0, 0 friction = 'none' law = '"//trim(law)//"' "//damping// &
                 ' / &boxes largest_ratio = 1e4 / &output energy_balance = .false. / &integrate '// &
                 'safety_factor = 0.1 duration = '//to_text(0.02_wp + 10.0_wp*gap/speed)//' /', list, simulation, error)
      if (.not. allocated(error)) call steps(simulation, int(simulation%n_steps), error)
      call table%note_error(error)
      if (allocated(error)) return
      associate (n => simulation%bodies%n)
         restitution = simulation%bodies%velocity(2, n)/speed
      end associate
   end subroutine bounce

   !> Depth of the square at rest on a floor [m]
   subroutine rest_on(table, law, cut, depth)
      type(table_t), intent(inout) :: table
      character(len=*), intent(in) :: law
      real(wp), intent(in) :: cut
      real(wp), intent(out) :: depth
      type(body_list_t) :: list
      type(simulation_t) :: simulation
      type(error_t), allocatable :: error

      depth = huge(depth)
      call cut_floor(cut, list)
      call list%append(block_at(0.0_wp, 0.5_wp*width, width, width, 0.0_wp))
      call begin("&forces law = '"//trim(law)//"' restitution = 0.1 gravity = 0, -"//to_text(gravity)// &
                 ' / &boxes largest_ratio = 1e4 / &output energy_balance = .false. / &integrate duration = 0.1 /', &
                 list, simulation, error)
      if (.not. allocated(error)) call steps(simulation, int(simulation%n_steps), error)
      call table%note_error(error)
      if (allocated(error)) return
      associate (n => simulation%bodies%n)
         depth = 0.5_wp*width - simulation%bodies%position(2, n)
      end associate
   end subroutine rest_on

end module b24_cut_floor
