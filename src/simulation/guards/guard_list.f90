!> The guards of a run.
module polydem_guard_list
   use polydem_displacement_guard, only: displacement_guard_t
   use polydem_energy_guard, only: energy_guard_t
   use polydem_overlap_guard, only: overlap_guard_t
   use polydem_settings, only: settings_t
   use polydem_simulation, only: guard_item_t, guard_t
   use polydem_step_guard, only: step_guard_t
   use polydem_tunnelling_guard, only: tunnelling_guard_t
   implicit none
   private
   public :: choose_guards

contains

   !> List all guards as the settings say, also those that are off.
   subroutine choose_guards(settings, list)
      type(settings_t), intent(in) :: settings
      !> The guards in the order of their checks
      type(guard_item_t), allocatable, intent(out) :: list(:)

      allocate (list(0))
      call add('displacement', displacement_guard_t())
      call add('overlap', overlap_guard_t())
      call add('tunnelling', tunnelling_guard_t())
      call add('step', step_guard_t())
      call add('energy', energy_guard_t())

   contains

      !> Append the guard of an entry of &guards.
      subroutine add(name, guard)
         character(len=*), intent(in) :: name
         class(guard_t), intent(in) :: guard
         type(guard_item_t), allocatable :: longer(:)
         integer :: k

         allocate (longer(size(list) + 1))
         do k = 1, size(list)
            call move_alloc(list(k)%guard, longer(k)%guard)
         end do
         allocate (longer(size(longer))%guard, source=guard)
         associate (new => longer(size(longer))%guard)
            new%name = name
            call new%configure(settings)
            new%is_on = new%choice /= 'off'
         end associate
         call move_alloc(longer, list)
      end subroutine add

   end subroutine choose_guards

end module polydem_guard_list
