!> A source: free bodies that enter a rectangle during a run.
!>
!> The shapes of its bodies are one stream of random numbers, their places another one. The n-th body that enters has
!> the n-th shape, wherever and whenever it finds room: a shape that finds none waits, and so do those behind it. Small
!> grains are therefore not preferred. All ranks draw the same numbers.
module polydem_source
   use polydem_elementary, only: hypotenuse
   use polydem_grain_list, only: area_of_grain, grain_t, grains_t
   use polydem_grains, only: draw_grains, most_pieces_of
   use polydem_kinds, only: ip, lp, wp
   use polydem_parts, only: new_grains
   use polydem_random, only: new_random, random_t
   use polydem_serializer, only: serializer_t
   use polydem_settings, only: grains_settings_t, source_settings_t
   use polydem_sizes, only: size_at
   implicit none
   private
   public :: source_t, candidate_t, new_source

   !> Greatest number of bodies that enter at a time, and number of places that are tried for each of them
   integer(lp), parameter :: most_at_once = 500_lp
   integer, parameter :: n_tries = 20
   !> Number of bodies of which the mean mass is told
   integer, parameter :: n_sample = 1000

   !> A source
   type :: source_t
      !> Its group &source
      type(source_settings_t) :: settings
      !> Number of the stage in which bodies enter; 0: in all
      integer(ip) :: stage = 0_ip
      !> Number of the material
      integer(ip) :: material = 0_ip
      !> Density [kg/m3]
      real(wp) :: density = 0.0_wp
      !> Number of bodies that have entered, and of times at which one found no room
      integer(lp) :: entered = 0_lp, blocked = 0_lp
      !> Step since which bodies enter at the present rate, and number of those that had entered then
      integer(lp) :: since = 0_lp, before = 0_lp
      !> Mass that has entered [kg/m]
      real(wp) :: mass = 0.0_wp
      !> Its shapes as those of a group of grains of one size
      type(grains_settings_t) :: group
      !> Random numbers of shapes and of places
      type(random_t) :: shapes, places
   contains
      procedure :: most_pieces
      procedure :: mean_mass
      procedure :: draw_shape
      procedure :: draw_candidates
      procedure :: wanted
      procedure :: due
      procedure :: serialize
   end type source_t

   !> A body that may enter
   type :: candidate_t
      !> Corners relative to its place, (2, corner) [m]
      real(wp), allocatable :: corners(:, :)
      !> Number of the piece of each corner, from 0
      integer(ip), allocatable :: piece(:)
      !> Greatest distance of a corner from its place [m]
      real(wp) :: radius = 0.0_wp
      !> Places to try, (2, place) [m]
      real(wp) :: place(2, n_tries) = 0.0_wp
      !> Random numbers of the shapes after this one
      type(random_t) :: after
   end type candidate_t

contains

   !> Start a source.
   subroutine new_source(settings, seed, source)
      type(source_settings_t), intent(in) :: settings
      !> Seed of its random numbers
      integer(ip), intent(in) :: seed
      type(source_t), intent(out) :: source

      source%settings = settings
      source%group = as_group(settings)
      source%shapes = new_random(seed)
      source%places = new_random(ieor(seed, 65536_ip))
   end subroutine new_source

   !> Draw the shape of a body: the one place where sources make shapes.
   subroutine draw_shape(self, random, candidate)
      class(source_t), intent(in) :: self
      !> Random numbers of shapes
      type(random_t), intent(inout) :: random
      !> Its corners and radius are set
      type(candidate_t), intent(inout) :: candidate
      type(grains_t) :: grains

      call draw_grains(self%group, random, 1_ip, grains)
      candidate%corners = grains%polygon(1_ip)
      candidate%piece = grains%pieces_of(1_ip)
      associate (s => self%settings)
         if (s%sizes /= 'octaves') then
            candidate%corners = candidate%corners*size_at(s, random%uniform())
         else if (s%size_ratio > 1.0_wp) then
            candidate%corners = candidate%corners/sqrt(1.0_wp - random%uniform()*(1.0_wp - s%size_ratio**(-2)))
         end if
      end associate
      candidate%radius = maxval(hypotenuse(candidate%corners(1, :), candidate%corners(2, :)))
   end subroutine draw_shape

   !> The shapes of a source as those of a group of grains of one size
   function as_group(settings) result(group)
      type(source_settings_t), intent(in) :: settings
      type(grains_settings_t) :: group, blank

      blank = new_grains(settings%name)
      group = blank
      group%shape_settings_t = settings%shape_settings_t
      group%sizes = blank%sizes
      group%size_ratio = blank%size_ratio
   end function as_group

   !> Greatest number of pieces of a body
   integer(ip) function most_pieces(self)
      class(source_t), intent(in) :: self

      most_pieces = most_pieces_of(self%group)
   end function most_pieces

   !> Mean mass of the first bodies [kg/m]
   function mean_mass(self) result(mean)
      class(source_t), intent(in) :: self
      real(wp) :: mean
      type(candidate_t) :: candidate
      type(grain_t) :: grain
      type(random_t) :: stream
      integer :: k

      mean = 0.0_wp
      stream = new_random(1_ip)
      do k = 1, n_sample
         call self%draw_shape(stream, candidate)
         grain%corners = candidate%corners
         grain%piece = candidate%piece
         mean = mean + self%density*area_of_grain(grain)/real(n_sample, wp)
      end do
   end function mean_mass

   !> Draw the next bodies with places that have them within the rectangle. The random numbers of shapes stay as they
   !> are.
   subroutine draw_candidates(self, n, candidates)
      class(source_t), intent(inout) :: self
      !> Their number
      integer(lp), intent(in) :: n
      !> The bodies
      type(candidate_t), allocatable, intent(out) :: candidates(:)
      type(random_t) :: stream
      real(wp) :: low(2), high(2)
      integer :: j, k

      allocate (candidates(n))
      stream = self%shapes
      do k = 1, size(candidates)
         call self%draw_shape(stream, candidates(k))
         candidates(k)%after = stream
         low = self%settings%low + candidates(k)%radius
         high = max(low, self%settings%high - candidates(k)%radius)
         do j = 1, n_tries
            candidates(k)%place(1, j) = self%places%between(low(1), high(1))
            candidates(k)%place(2, j) = self%places%between(low(2), high(2))
         end do
      end do
   end subroutine draw_candidates

   !> Number of bodies that should enter
   pure integer(lp) function wanted(self, n_free, step, first, dt)
      class(source_t), intent(in) :: self
      !> Number of free bodies of the run
      integer(lp), intent(in) :: n_free
      !> Number of completed steps, and that at which the stage of the source began
      integer(lp), intent(in) :: step, first
      !> Time step [s]
      real(wp), intent(in) :: dt

      if (self%settings%count > 0_ip) then
         wanted = int(self%settings%count, lp) - n_free
      else
         wanted = self%due(step, first, dt) - self%entered
      end if
      wanted = max(0_lp, min(wanted, most_at_once))
   end function wanted

   !> Number of bodies that should have entered by the rate. A rate that was changed holds from then on.
   pure integer(lp) function due(self, step, first, dt)
      class(source_t), intent(in) :: self
      !> Number of completed steps, and that at which the stage of the source began
      integer(lp), intent(in) :: step, first
      !> Time step [s]
      real(wp), intent(in) :: dt

      due = self%before + int(min(self%settings%rate*(real(step - max(first, self%since), wp)*dt), 1.0e15_wp), lp)
   end function due

   !> Serialize what changes.
   subroutine serialize(self, step, serializer)
      class(source_t), intent(inout) :: self
      !> Number of completed steps
      integer(lp), intent(in) :: step
      class(serializer_t), intent(inout) :: serializer
      real(wp) :: rate
      integer(lp) :: counts(4), shapes(6), places(6)

      counts = [self%entered, self%blocked, self%since, self%before]
      rate = self%settings%rate
      shapes = self%shapes%state()
      places = self%places%state()
      associate (name => '/run/source_'//self%settings%name)
         call serializer%field(name//'_counts', counts, '1', 'bodies that have entered, times without room, '// &
                               'step since which they enter at this rate, bodies that had entered then')
         call serializer%field(name//'_rate', rate, '1/s', 'rate at which bodies enter')
         call serializer%field(name//'_mass', self%mass, 'kg/m', 'mass that has entered')
         call serializer%field(name//'_shapes', shapes, '1', 'state of the random numbers of shapes')
         call serializer%field(name//'_places', places, '1', 'state of the random numbers of places')
      end associate
      if (.not. serializer%is_reading .or. allocated(serializer%error)) return
      self%entered = counts(1)
      self%blocked = counts(2)
      self%since = counts(3)
      self%before = counts(4)
      if (abs(rate - self%settings%rate) > 0.0_wp) then
         self%since = step
         self%before = self%entered
      end if
      call self%shapes%set_state(shapes)
      call self%places%set_state(places)
   end subroutine serialize

end module polydem_source
