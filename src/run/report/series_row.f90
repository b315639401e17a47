!> What a row of the series of a run contains: the one place where its columns come together.
module polydem_series_row
   use polydem_sample_columns, only: set_sample_columns
   use polydem_simulation, only: simulation_t
   use polydem_wall_record, only: set_wall_columns
   implicit none
   private
   public :: collect_row

contains

   !> Set all columns of the present row at the end of a step. Every call gives the same columns in the same order, and
   !> all ranks get the same values: they are exact sums, or the same on all ranks anyway. Collective.
   subroutine collect_row(self)
      !> The simulation with the table of contacts of this step; the row of `series` is set
      type(simulation_t), intent(inout) :: self

      call set_sample_columns(self, self%series%row)
      call set_wall_columns(self%walls, self%comm, self%dt, self%bodies, self%loop%walls, self%series%row)
      if (allocated(self%sources_and_sinks)) call self%sources_and_sinks%set_columns(self%series%row)
   end subroutine collect_row

end module polydem_series_row
