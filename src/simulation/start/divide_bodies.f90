!> Brings the bodies of a simulation to their ranks at the start.
module polydem_divide_bodies
   use polydem_bodies, only: bodies_t, greatest_identifier
   use polydem_box_maker, only: update_boxes
   use polydem_check_entering, only: check_entering
   use polydem_domain, only: new_domain
   use polydem_enter_cell, only: check_constraint
   use polydem_errors, only: error_t, input_error, raise
   use polydem_global_reductions, only: find_median
   use polydem_kinds, only: ip, wp
   use polydem_local_data, only: rebuild_local_data
   use polydem_redistribution, only: redistribute
   use polydem_simulation, only: simulation_t
   use polydem_source_locations, only: place_of
   use polydem_strings, only: to_text
   implicit none
   private
   public :: check_identifiers, divide_bodies, bound_bodies

contains

   !> Allow for the pieces of bodies that will enter, and check that those of all bodies have identifiers, also once
   !> sources have made as many bodies as they count.
   subroutine check_identifiers(self, sample, error)
      type(simulation_t), intent(inout) :: self
      !> Bodies that will enter
      type(bodies_t), intent(in) :: sample
      !> Names the file of the bodies
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: origin
      integer(ip) :: coming, k

      call self%bodies%pieces%allow(sample%pieces%most)
      coming = 0_ip
      associate (settings => self%settings, last => self%bodies%last_id, most => self%bodies%pieces%most)
         do k = 1_ip, size(settings%source, kind=ip)
            coming = max(coming, settings%source(k)%count - self%bodies%n_all)
         end do
         if (most == 1_ip .and. coming == 0_ip) return
         if (last <= greatest_identifier(most) - coming) return
         origin = settings%file
         if (settings%scene%bodies_file /= '') origin = place_of(settings, 'scene', 'bodies_file')
         if (settings%scene%name == 'result') origin = place_of(settings, 'scene', 'start_from')
         call raise(error, input_error, origin//': body '//to_text(last)//': with up to '//to_text(most)// &
                    ' pieces of a body and '//to_text(coming)//' more bodies, identifiers must be at most '// &
                    to_text(greatest_identifier(most) - coming)//'; number the bodies anew, from 1')
      end associate
   end subroutine check_identifiers

   !> Divide the bodies among the ranks, and build what depends on those of a rank. Collective.
   subroutine divide_bodies(self, sample, error)
      type(simulation_t), intent(inout) :: self
      !> Bodies that will enter
      type(bodies_t), intent(in) :: sample
      !> Allocated if boxes or a velocity constraint are impossible
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: median_diameter

      call find_median(self%comm, self%bodies%diameter(self%bodies%free), median_diameter)
      if (median_diameter >= huge(1.0_wp)) call find_median(self%comm, sample%diameter, median_diameter)
      call new_domain(self%domain, self%settings%decomposition, median_diameter, self%comm, self%bodies%cell)
      call rebuild_local_data(self, error, median_diameter)
      if (.not. allocated(error)) call check_constraint(self, error)
      call self%comm%all_reduce_error(error)
   end subroutine divide_bodies

   !> Move the walls to time 0, bound all bodies, and bring them to their ranks. Collective.
   subroutine bound_bodies(self, error)
      type(simulation_t), intent(inout) :: self
      !> Names a source or a sink that is impossible
      type(error_t), allocatable, intent(inout) :: error

      call self%walls%move(0.0_wp, self%bodies)
      call update_boxes(self%search%maker, self%bodies, self%moving, self%search%boxes)
      if (.not. allocated(error)) call check_entering(self, error)
      call redistribute(self, .false., error)
      call self%comm%all_reduce_error(error)
   end subroutine bound_bodies

end module polydem_divide_bodies
