!> The stages of a run: in which one it is, and since when.
module polydem_run_stages
   use polydem_errors, only: input_error, raise
   use polydem_kinds, only: ip, lp, wp
   use polydem_serializer, only: serializer_t
   implicit none
   private
   public :: run_stages_t, serialize_stages

   !> Greatest number of stages, that of the instances of a namelist group
   integer(lp), parameter :: most_stages = 9999_lp

   !> State of the stages of a run
   type :: run_stages_t
      !> Number of the present stage; 0: the run has no stages
      integer(ip) :: number = 0_ip
      !> Step at which each stage up to the present one has begun: the last step of the stage before
      integer(lp), allocatable :: first(:)
      !> Last step of the present stage; the greatest possible one as long as a condition decides
      integer(lp) :: last = 0_lp
      !> Whether the condition of the stage has decided which step is the last
      logical :: is_decided = .false.
      !> First of the latest checks that have all found that the condition holds; negative: the latest has not
      integer(lp) :: held_since = -1_lp
      !> Vector between two walls at the start of the stage, if a strain decides [m]
      real(wp) :: reference(2) = 0.0_wp
      !> Quantity on which the end of the stage depends, at the latest check; negative: there was none
      real(wp) :: value = -1.0_wp
      !> Factor of the friction coefficients in this stage
      real(wp) :: friction_scale = 1.0_wp
   end type run_stages_t

contains

   !> Serialize the stages, if there are any.
   subroutine serialize_stages(stages, serializer)
      type(run_stages_t), intent(inout) :: stages
      !> Serializer; its `error` holds a failure
      class(serializer_t), intent(inout) :: serializer
      integer(lp) :: state(4), n

      if (stages%number == 0_ip) return
      state = [int(stages%number, lp), stages%last, merge(1_lp, 0_lp, stages%is_decided), stages%held_since]
      call serializer%field('/run/run_stage', state, '1', 'number of the stage of the run, its last step, 1: '// &
                            'which is decided, first of the latest checks that have found that its condition holds')
      if (serializer%is_reading) then
         call serializer%count_rows('/run/run_stage_first', n)
         if (n /= state(1) .or. n < 1_lp .or. n > most_stages) call raise(serializer%error, input_error, &
            '/run/run_stage and /run/run_stage_first contradict each other')
         if (allocated(serializer%error)) return
         stages%first = spread(0_lp, 1, int(n))
         stages%number = int(n, ip)
         stages%last = state(2)
         stages%is_decided = state(3) == 1_lp
         stages%held_since = state(4)
      end if
      call serializer%field('/run/run_stage_first', stages%first, '1', 'step at which each stage has begun')
      call serializer%field('/run/run_stage_reference', stages%reference, 'm', &
                            'vector between two walls at the start of the stage')
      call serializer%field('/run/run_stage_value', stages%value, '1', 'quantity of the condition at the latest check')
   end subroutine serialize_stages

end module polydem_run_stages
