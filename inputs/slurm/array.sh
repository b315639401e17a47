#!/usr/bin/env bash
#SBATCH --job-name=polydem-sweep
#SBATCH --array=1-12
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=4
#SBATCH --time=24:00:00
#SBATCH --signal=B:USR1@300
#SBATCH --requeue
#SBATCH --open-mode=append
#
# A sweep as an array of jobs, one row of its table each, from the folder of polydem:
#
#     ./polydem sweep make table.csv inputs/drum.nml --output results/sweep
#     sbatch --array=1-12 inputs/slurm/array.sh results/sweep      # as many as the table has rows
#     ./polydem sweep collect results/sweep
#
# Five minutes before the limit the queue sends USR1; the run then writes a checkpoint, and its job goes back into the
# queue and on from there. Rows that are finished are not run again, whatever is submitted.

threads=${SLURM_CPUS_PER_TASK:-1}

trap 'heard=yes; kill -USR1 "$!" 2>/dev/null' USR1 TERM
./polydem sweep run "$@" --rows "$SLURM_ARRAY_TASK_ID" --cores "$threads" --threads "$threads" &
run=$!
while :; do
  heard=
  wait "$run"
  code=$?
  # A signal ends the wait, but not the run.
  [ -n "$heard" ] || break
done

# Not SLURM_JOB_ID, which for one of the jobs means the whole array.
[ "$code" -ne 75 ] || scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
exit "$code"
