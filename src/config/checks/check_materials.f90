!> Checks of the groups &material and &contact_pair.
module polydem_check_materials
   use polydem_errors, only: error_t, input_error, raise
   use polydem_group_instances, only: index_of_instance, instance_t, row_of
   use polydem_kinds, only: wp
   use polydem_pair_entries, only: n_pair_entries, pair_entries
   use polydem_settings, only: settings_t
   implicit none
   private
   public :: check_materials

   !> Lower limit of the restitution. Below it, the stable time step is proportional to the square root of the
   !> restitution, and so is a time step that resolves the impact
   real(wp), parameter :: least_restitution = 0.01_wp

contains

   !> Check that parameters are in use, and that no pair of materials is given twice.
   pure subroutine check_materials(settings, instances, error)
      !> Settings with all entries filled in
      type(settings_t), intent(in) :: settings
      !> All groups with their values, which contain the places for messages
      type(instance_t), intent(in) :: instances(:)
      !> First entry that is not in use, or a pair that is there twice
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, size(instances)
         if (instances(k)%group == 'material' .or. instances(k)%group == 'contact_pair') then
            call check_use(instances(k), instances(index_of_instance(instances, 'forces')), error)
            call check_restitution(instances(k), error)
         else if (instances(k)%group == 'forces') then
            call check_restitution(instances(k), error)
         end if
      end do
      do k = 1, size(settings%contact_pair)
         call check_pair(settings, k, instances(index_of_instance(instances, 'contact_pair', &
                                                                  settings%contact_pair(k)%name)), error)
      end do
   end subroutine check_materials

   !> Check that the force law uses the parameters that a group gives. An override of &forces may exclude them.
   pure subroutine check_use(group, forces, error)
      !> Group &material or &contact_pair
      type(instance_t), intent(in) :: group
      !> Group &forces
      type(instance_t), intent(in) :: forces
      type(error_t), allocatable, intent(inout) :: error
      integer :: k

      do k = 1, n_pair_entries
         ! The stiffness is in use, whether &forces gives it or its ratio to the pressure.
         if (pair_entries(k) == 'stiffness') cycle
         associate (value => group%values(row_of(group, trim(pair_entries(k)))))
            if (.not. value%is_given .or. forces%values(row_of(forces, trim(pair_entries(k))))%is_active) cycle
            if (any(forces%values%is_override) .and. .not. value%is_override) cycle
            call raise(error, input_error, value%place//': '''//trim(pair_entries(k))//''' in &'//trim(group%group)// &
               ' '//group%name//' is not used, because '//reason(trim(pair_entries(k)), forces))
         end associate
      end do
   end subroutine check_use

   !> Refuse a restitution that is given and too small.
   pure subroutine check_restitution(group, error)
      !> Group &forces, &material or &contact_pair
      type(instance_t), intent(in) :: group
      type(error_t), allocatable, intent(inout) :: error

      associate (value => group%values(row_of(group, 'restitution')))
         if (.not. (value%is_given .and. value%is_active)) return
         if (value%reals(1) < least_restitution) call raise(error, input_error, value%place// &
            ': ''restitution'' in &'//trim(group%group)//' must be at least 0.01, because a smaller value needs a '// &
            'very small time step; give ''damping_coefficient'' instead')
      end associate
   end subroutine check_restitution

   !> Why the force law does not use a parameter
   pure function reason(parameter_name, forces) result(text)
      character(len=*), intent(in) :: parameter_name
      type(instance_t), intent(in) :: forces
      character(len=:), allocatable :: text

      if (parameter_name == 'restitution' .and. forces%values(row_of(forces, 'damping'))%text == 'rate') then
         text = '&forces gives ''damping_coefficient''; give one of them everywhere'
      else if (parameter_name == 'damping_coefficient' .and. forces%values(row_of(forces, 'damping'))%text == 'rate') &
         then
         text = '&forces does not give it; give ''damping_coefficient'' there too, or ''restitution'' here'
      else if (parameter_name == 'restitution' .or. parameter_name == 'damping_coefficient') then
         text = '&forces has damping = '''//forces%values(row_of(forces, 'damping'))%text//''''
      else
         text = '&forces has friction = '''//forces%values(row_of(forces, 'friction'))%text//''''
      end if
   end function reason

   !> Check that a pair gives a parameter, and that no earlier group is of the same materials.
   pure subroutine check_pair(settings, k, group, error)
      type(settings_t), intent(in) :: settings
      !> Number of the pair
      integer, intent(in) :: k
      !> Its group
      type(instance_t), intent(in) :: group
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: place
      logical :: is_given
      integer :: j

      place = group%values(row_of(group, 'materials'))%place//': ''materials'' in &contact_pair '//group%name
      is_given = .false.
      do j = 1, n_pair_entries
         is_given = is_given .or. group%values(row_of(group, trim(pair_entries(j))))%is_given
      end do
      if (.not. is_given) call raise(error, input_error, place//': the pair gives no parameter; give one, for '// &
         'example friction_coefficient = 0.2, or leave out the group')
      associate (mine => settings%contact_pair(k)%materials)
         do j = 1, k - 1
            associate (other => settings%contact_pair(j)%materials)
               if (.not. ((mine(1)%text == other(1)%text .and. mine(2)%text == other(2)%text) .or. &
                          (mine(1)%text == other(2)%text .and. mine(2)%text == other(1)%text))) cycle
            end associate
            call raise(error, input_error, place//' are also those of '//settings%contact_pair(j)%name// &
                       '; join both groups')
         end do
      end associate
   end subroutine check_pair

end module polydem_check_materials
