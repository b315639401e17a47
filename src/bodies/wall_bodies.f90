!> Names of walls, and the fixed bodies that belong to them.
module polydem_wall_bodies
   use polydem_kinds, only: ip
   implicit none
   private
   public :: wall_bodies_t

   !> Identifiers of the bodies of a wall
   type :: wall_bodies_t
      !> Name of the wall
      character(len=:), allocatable :: name
      !> Identifiers
      integer(ip), allocatable :: id(:)
   end type wall_bodies_t

end module polydem_wall_bodies
