!> The group /bodies of a segment: what of the bodies does not change.
!>
!> Identifiers ascend. If bodies enter or leave, those that a frame brings are appended; otherwise all are written
!> before the first frame. All procedures are collective.
module polydem_segment_bodies
   use polydem_bodies, only: bodies_t
   use polydem_communicator, only: communicator_t
   use polydem_errors, only: error_t
   use polydem_hdf5_file, only: hdf5_file_t, many_rows, part_t
   use polydem_kinds, only: bp, dp, ip, lp
   use polydem_ownership, only: order_bodies, order_vertices
   use polydem_row_distribution, only: component, row_distribution_t
   implicit none
   private
   public :: segment_bodies_t

   !> Number of vertices that one rank writes at once, so that it needs little memory
   integer(ip), parameter :: vertices_at_once = 100000_ip

   !> The bodies that a segment has so far
   type :: segment_bodies_t
      private
      !> Whether bodies enter or leave, so that the data sets grow
      logical, public :: change = .false.
      !> Greatest identifier
      integer(ip) :: last_id = -huge(1_ip)
      !> Number of vertices
      integer(ip) :: n_vertices = 0_ip
   contains
      procedure :: append
   end type segment_bodies_t

contains

   !> Append the bodies that a segment does not have yet: identifier, fixed flag, mass, inertia, shape and material.
   subroutine append(self, file, comm, bodies, error)
      class(segment_bodies_t), intent(inout) :: self
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      type(error_t), allocatable, intent(inout) :: error
      type(row_distribution_t) :: blocks
      type(part_t) :: part
      integer, allocatable :: growth
      integer(ip), allocatable :: slots(:)
      integer(lp), allocatable :: numbers(:, :), block(:, :)
      integer(lp) :: last(1)
      integer(ip) :: s

      ! Not allocated, it is an absent argument.
      if (self%change) growth = many_rows
      slots = pack([(s, s=1_ip, bodies%n)], bodies%id(:bodies%n) > self%last_id)
      call order_bodies(comm, bodies, blocks, slots)
      if (blocks%total == 0_lp) return
      part = part_t(blocks%first, blocks%total)
      call write_masses(file, comm, bodies, blocks, error, growth)
      allocate (numbers(4, bodies%n), source=0_lp)
      do s = 1_ip, bodies%n
         numbers(1, s) = int(bodies%id(s), lp)
         numbers(2, s) = merge(1_lp, 0_lp, bodies%fixed(s))
         numbers(3, s) = int(bodies%pieces%vertex_start(s + 1_ip) - bodies%pieces%vertex_start(s), lp)
         if (allocated(bodies%material)) numbers(4, s) = int(bodies%material(s), lp)
      end do
      call blocks%to_blocks(comm, numbers, block)
      deallocate (numbers)
      call file%write('/bodies/id', int(block(1, :), ip), error, '1', 'identifier of each body, ascending', part, &
                      rows=growth)
      call file%write('/bodies/fixed', int(block(2, :), bp), error, '1', &
                      '1: fixed or with prescribed motion, 0: free', part, rows=growth)
      if (allocated(bodies%material)) call file%write('/bodies/material', int(block(4, :), ip), error, '1', &
         'material: position among the groups &material of the namelist, 0: none of them', part, rows=growth)
      call append_vertices(self, file, comm, bodies, slots, int(block(3, :), ip), part, error, growth)
      last = -huge(1_lp)
      if (size(slots) > 0) last = int(maxval(bodies%id(slots)), lp)
      call comm%all_reduce_max(last)
      self%last_id = int(last(1), ip)
   end subroutine append

   !> Write masses and moments of inertia.
   subroutine write_masses(file, comm, bodies, blocks, error, growth)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Order of the bodies in the file
      type(row_distribution_t), intent(in) :: blocks
      type(error_t), allocatable, intent(inout) :: error
      !> `many_rows` if the data sets grow
      integer, intent(in), optional :: growth
      real(dp), allocatable :: masses(:, :), block(:, :)
      type(part_t) :: part
      integer(ip) :: s

      allocate (masses(2, bodies%n))
      do s = 1_ip, bodies%n
         masses(:, s) = [real(bodies%mass(s), dp), real(bodies%inertia(s), dp)]
      end do
      call blocks%to_blocks(comm, masses, block)
      part = part_t(blocks%first, blocks%total)
      call file%write('/bodies/mass', component(block, 1), error, 'kg/m', 'mass; 0: infinite', part, rows=growth)
      call file%write('/bodies/inertia', component(block, 2), error, 'kg m', &
                      'moment of inertia about the centre of mass; 0: infinite', part, rows=growth)
   end subroutine write_masses

   !> Append the vertices of bodies, and the number of vertices up to the end of each body.
   subroutine append_vertices(self, file, comm, bodies, slots, corners, part, error, growth)
      class(segment_bodies_t), intent(inout) :: self
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies of this rank, and number of vertices of each body in its block
      integer(ip), intent(in) :: slots(:), corners(:)
      !> Block of bodies of this rank
      type(part_t), intent(in) :: part
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: growth
      type(part_t) :: vertices
      integer(ip), allocatable :: start(:)
      integer(ip) :: k
      integer(lp) :: lead

      call write_vertices(file, comm, bodies, slots, vertices, error, growth)
      start = [self%n_vertices + int(vertices%first, ip), corners]
      do k = 2_ip, size(start, kind=ip)
         start(k) = start(k) + start(k - 1_ip)
      end do
      ! Before the first body of the segment there is a row of its own, which the first rank writes.
      lead = merge(1_lp, 0_lp, self%n_vertices == 0_ip)
      k = merge(1_ip, 2_ip, lead == 1_lp .and. comm%is_root())
      call file%write('/bodies/vertex_start', start(k:), error, '1', &
                      'body k owns the rows vertex_start[k] to vertex_start[k + 1] - 1 of vertex', &
                      part_t(part%first + lead*int(k - 1_ip, lp), part%total + lead), rows=growth)
      self%n_vertices = self%n_vertices + int(vertices%total, ip)
   end subroutine append_vertices

   !> Write the vertices of bodies.
   subroutine write_vertices(file, comm, bodies, slots, part, error, growth)
      type(hdf5_file_t), intent(inout) :: file
      class(communicator_t), intent(inout) :: comm
      type(bodies_t), intent(in) :: bodies
      !> Slots of the bodies of this rank
      integer(ip), intent(in) :: slots(:)
      !> Block of vertices of this rank
      type(part_t), intent(out) :: part
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: growth
      type(row_distribution_t) :: blocks
      type(part_t), allocatable :: some
      integer(lp), allocatable :: pieces(:, :)
      real(dp), allocatable :: vertices(:, :)
      integer(ip) :: first, k, n
      character(len=*), parameter :: about_piece = 'number of the piece of each vertex within its body, from 0', &
         about_vertex = 'vertices relative to the centre of mass at angle 0, anticlockwise'

      n = bodies%pieces%vertex_start(bodies%n + 1_ip) - 1_ip
      if (comm%size == 1_ip) then
         ! One rank has all rows in order, those of new bodies behind the others. It needs no memory for a plan.
         first = bodies%pieces%vertex_start(slots(1))
         part = part_t(0_lp, int(n - first + 1_ip, lp))
         do k = first, n, vertices_at_once
            associate (last => min(n, k + (vertices_at_once - 1_ip)))
               if (.not. present(growth)) some = part_t(int(k - first, lp), part%total)
               call file%write('/bodies/vertex', real(bodies%pieces%vertex(:, k:last), dp), error, 'm', about_vertex, &
                               some, rows=growth)
            end associate
         end do
         if (bodies%pieces%most > 1_ip) call file%write('/bodies/piece', bodies%pieces%number(first:n), error, '1', &
                                                        about_piece, part, rows=growth)
         return
      end if
      call order_vertices(comm, bodies, blocks, slots)
      part = part_t(blocks%first, blocks%total)
      call blocks%to_blocks(comm, real(bodies%pieces%vertex(:, :n), dp), vertices)
      call file%write('/bodies/vertex', vertices, error, 'm', about_vertex, part, rows=growth)
      if (bodies%pieces%most <= 1_ip) return
      call blocks%to_blocks(comm, reshape(int(bodies%pieces%number, lp), [1_ip, n]), pieces)
      call file%write('/bodies/piece', int(pieces(1, :), ip), error, '1', about_piece, part, rows=growth)
   end subroutine write_vertices

end module polydem_segment_bodies
