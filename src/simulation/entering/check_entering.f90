!> Checks of sources at the start of a run: bodies must be able to enter. And a sample of the bodies that will enter,
!> for what a run chooses from its bodies at the start.
module polydem_check_entering
   use polydem_bodies, only: bodies_t
   use polydem_body_list, only: body_list_t, new_bodies
   use polydem_errors, only: error_t, input_error, raise
   use polydem_kinds, only: lp, wp
   use polydem_random, only: random_t
   use polydem_room, only: meets_fixed, put_candidates
   use polydem_simulation, only: simulation_t
   use polydem_source, only: candidate_t, source_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_entering, draw_sample

   !> Number of bodies of a source in a sample, and number of those whose places are tried
   integer, parameter :: n_sample = 200
   integer(lp), parameter :: n_tried = 10_lp

contains

   !> Draw the first bodies of all sources, as they will enter.
   subroutine draw_sample(self, sample, error)
      !> The simulation with its sources
      type(simulation_t), intent(in) :: self
      !> The bodies, all at one place
      type(bodies_t), intent(out) :: sample
      !> Names the source, and what is wrong with a body
      type(error_t), allocatable, intent(inout) :: error
      type(body_list_t) :: list
      type(candidate_t) :: candidate
      type(random_t) :: stream
      integer :: j, k

      list%has_materials = size(self%settings%material) > 0
      if (allocated(self%sources_and_sinks)) then
         do k = 1, size(self%sources_and_sinks%sources)
            associate (source => self%sources_and_sinks%sources(k))
               stream = source%shapes
               do j = 1, n_sample
                  call source%draw_shape(stream, candidate)
                  call list%append(candidate%corners, density=source%density, material=source%material, &
                                   piece=candidate%piece)
               end do
               list%most_pieces = max(list%most_pieces, source%most_pieces())
            end associate
         end do
      end if
      call new_bodies(list, sample, error)
      if (.not. allocated(error)) return
      associate (source => self%sources_and_sinks%sources((error%place - 1_lp)/n_sample + 1_lp)%settings)
         error%message = place_of(self%settings, 'source.'//source%name, 'name')//': the bodies of &source '// &
            source%name//': '//error%message
      end associate
   end subroutine draw_sample

   !> Check that there is room for the first bodies of each source.
   subroutine check_entering(self, error)
      !> The simulation with its bodies at time 0
      type(simulation_t), intent(in) :: self
      !> Names the source and what is wrong
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      if (.not. allocated(self%sources_and_sinks)) return
      do k = 1, size(self%sources_and_sinks%sources)
         if (.not. allocated(error)) call check_source(self, self%sources_and_sinks%sources(k), error)
      end do
   end subroutine check_entering

   !> Check a source.
   subroutine check_source(self, source, error)
      type(simulation_t), intent(in) :: self
      type(source_t), intent(in) :: source
      type(error_t), allocatable, intent(inout) :: error
      type(source_t) :: copy
      type(candidate_t), allocatable :: candidates(:)
      real(wp) :: widest
      integer :: j, k
      logical :: has_room

      copy = source
      call copy%draw_candidates(n_tried, candidates)
      call put_candidates(self%bodies, candidates)
      widest = 2.0_wp*maxval(candidates%radius)
      associate (name => source%settings%name, low => source%settings%low, high => source%settings%high)
         if (any(high - low < widest)) then
            call raise(error, input_error, place_of(self%settings, 'source.'//name, 'high')// &
                       ': ''high'' in &source '//name//' leaves no room: its bodies are up to '// &
                       to_text(widest, 3)//' m long; make the rectangle at least as wide and as high')
            return
         end if
         if (self%walls%any_driven() .or. self%walls%has_gates()) return
         has_room = .false.
         do k = 1, size(candidates)
            do j = 1, size(candidates(k)%place, 2)
               has_room = has_room .or. .not. meets_fixed(self%bodies, candidates(k)%place(:, j), candidates(k)%radius)
            end do
         end do
         if (.not. has_room) call raise(error, input_error, place_of(self%settings, 'source.'//name, 'low')// &
            ': the rectangle of &source '//name//' lies on fixed bodies, so that nothing can ever enter; move it '// &
            'to a free place')
      end associate
   end subroutine check_source

end module polydem_check_entering
