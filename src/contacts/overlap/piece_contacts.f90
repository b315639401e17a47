!> Contacts between pieces as contacts between their bodies.
module polydem_piece_contacts
   use polydem_bodies, only: bodies_t
   use polydem_contact_block, only: contact_block_t, is_exchanged
   use polydem_kinds, only: ip, wp
   use polydem_pieces, only: pieces_t
   implicit none
   private
   public :: take_bodies, keep_pieces, refer_to_bodies

contains

   !> Move the pieces of the contacts of a block from the columns of bodies to their own, and set the bodies.
   pure subroutine take_bodies(pieces, block)
      type(pieces_t), intent(in) :: pieces
      !> Contacts; on entry `first` and `second` are pieces
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: c

      do c = 1_ip, block%n
         block%piece(c, 1) = block%first(c)
         block%piece(c, 2) = block%second(c)
         block%first(c) = pieces%body(block%piece(c, 1))
         block%second(c) = pieces%body(block%piece(c, 2))
      end do
   end subroutine take_bodies

   !> Keep the pieces of those contacts that exist.
   pure subroutine keep_pieces(exists, block)
      !> Whether each contact exists, (block%n) or longer
      logical, intent(in) :: exists(:)
      !> Contacts; only `piece` changes
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: b, c

      b = 0_ip
      do c = 1_ip, block%n
         if (.not. exists(c)) cycle
         b = b + 1_ip
         block%piece(b, :) = block%piece(c, :)
      end do
   end subroutine keep_pieces

   !> Refer arms and moments to the centres of the bodies, and give the bodies the roles that their own radii demand.
   pure subroutine refer_to_bodies(bodies, block)
      type(bodies_t), intent(in) :: bodies
      !> Contacts with arms and moments about the centres of pieces
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: c

      do c = 1_ip, block%n
         associate (n => block%normal(c, :), arm => bodies%pieces%arm(:, block%piece(c, 1)), &
                    other => bodies%pieces%arm(:, block%piece(c, 2)))
            block%moment(c, 1) = block%moment(c, 1) + (arm(1)*n(2) - arm(2)*n(1))
            block%moment(c, 2) = block%moment(c, 2) + (other(1)*n(2) - other(2)*n(1))
            block%arm_first(c, :) = block%arm_first(c, :) + arm
            block%arm_second(c, :) = block%arm_second(c, :) + other
         end associate
         associate (i => block%first(c), j => block%second(c))
            if (is_exchanged(bodies, min(i, j), max(i, j)) .neqv. i > j) call exchange(c, block)
         end associate
      end do
   end subroutine refer_to_bodies

   !> Exchange the roles of the bodies of a contact.
   pure subroutine exchange(c, block)
      !> Index in the block
      integer(ip), intent(in) :: c
      type(contact_block_t), intent(inout) :: block
      integer(ip) :: slot
      real(wp) :: arm(2)

      slot = block%first(c)
      block%first(c) = block%second(c)
      block%second(c) = slot
      block%piece(c, :) = block%piece(c, [2, 1])
      block%normal(c, :) = -block%normal(c, :)
      block%moment(c, :) = -block%moment(c, [2, 1])
      block%of_area(c, :3) = -block%of_area(c, :3)
      arm = block%arm_first(c, :)
      block%arm_first(c, :) = block%arm_second(c, :)
      block%arm_second(c, :) = arm
   end subroutine exchange

end module polydem_piece_contacts
