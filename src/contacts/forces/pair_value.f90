!> A parameter of contacts that may differ between pairs of materials.
module polydem_pair_value
   use polydem_contact_block, only: block_size
   use polydem_kinds, only: ip, wp
   implicit none
   private
   public :: pair_value_t, new_pair_value, weighted

   !> A parameter of contacts. Loops over contacts use the common factor `one`; only if pairs of materials differ, the
   !> result is then multiplied by their factors
   type :: pair_value_t
      !> Common factor
      real(wp) :: one = 0.0_wp
      !> Factor of each pair of materials, symmetric, (0:n, 0:n); not allocated if it is 1 for all
      real(wp), allocatable :: factor(:, :)
   contains
      procedure :: of
      procedure :: factor_of
      procedure :: scale
      procedure :: least
      procedure :: greatest
   end type pair_value_t

contains

   !> Make a parameter from the table of its values.
   pure type(pair_value_t) function new_pair_value(table, one) result(value)
      !> Values, symmetric, (0:n, 0:n)
      real(wp), intent(in) :: table(0:, 0:)
      !> Common factor if they differ, positive
      real(wp), intent(in) :: one

      value%one = table(0, 0)
      if (all(abs(table - value%one) <= 0.0_wp)) return
      value%one = one
      allocate (value%factor(0:ubound(table, 1), 0:ubound(table, 2)))
      value%factor(:, :) = table/one
   end function new_pair_value

   !> A parameter, its factors multiplied by a power of the factors of another one
   pure type(pair_value_t) function weighted(value, other, minus_halves) result(product)
      !> The parameter, and the other one
      type(pair_value_t), intent(in) :: value, other
      !> The power times -2, an odd number
      integer, intent(in) :: minus_halves

      product = value
      if (.not. allocated(other%factor)) return
      if (.not. allocated(product%factor)) then
         allocate (product%factor(0:ubound(other%factor, 1), 0:ubound(other%factor, 2)))
         product%factor = 1.0_wp
      end if
      product%factor = product%factor/(sqrt(other%factor)*other%factor**(minus_halves/2))
   end function weighted

   !> Factor of a pair of materials
   pure real(wp) function factor_of(self, materials)
      class(pair_value_t), intent(in) :: self
      !> Their numbers
      integer(ip), intent(in) :: materials(2)

      factor_of = 1.0_wp
      if (allocated(self%factor)) factor_of = self%factor(materials(1), materials(2))
   end function factor_of

   !> Value of a pair of materials
   pure real(wp) function of(self, materials)
      class(pair_value_t), intent(in) :: self
      !> Their numbers
      integer(ip), intent(in) :: materials(2)

      of = self%one
      if (allocated(self%factor)) of = self%one*self%factor(materials(1), materials(2))
   end function of

   !> Multiply a column by the factors of the contacts of a block.
   pure subroutine scale(self, n, materials, column)
      class(pair_value_t), intent(in) :: self
      !> Number of contacts
      integer(ip), intent(in) :: n
      !> Materials of both bodies of each contact; read only if pairs differ, (contact, body)
      integer(ip), intent(in) :: materials(block_size, 2)
      !> Value of each contact
      real(wp), intent(inout) :: column(block_size)
      integer(ip) :: c

      if (.not. allocated(self%factor)) return
      do c = 1_ip, n
         column(c) = column(c)*self%factor(materials(c, 1), materials(c, 2))
      end do
   end subroutine scale

   !> Least value of all pairs
   pure real(wp) function least(self)
      class(pair_value_t), intent(in) :: self

      least = self%one
      if (allocated(self%factor)) least = self%one*minval(self%factor)
   end function least

   !> Greatest value of all pairs
   pure real(wp) function greatest(self)
      class(pair_value_t), intent(in) :: self

      greatest = self%one
      if (allocated(self%factor)) greatest = self%one*maxval(self%factor)
   end function greatest

end module polydem_pair_value
