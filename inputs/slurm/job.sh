#!/usr/bin/env bash
#SBATCH --job-name=polydem
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=8
#SBATCH --time=24:00:00
#SBATCH --signal=B:USR1@300
#SBATCH --requeue
#SBATCH --open-mode=append
#
# One run that survives the limit of the queue, from the folder of polydem:
#
#     ./polydem --version                                   # once, where there is a compiler: builds
#     sbatch inputs/slurm/job.sh inputs/drum.nml            # further words are options of the run
#
# Five minutes before the limit the queue sends USR1; the run then writes a checkpoint and ends with code 75, and the
# job goes back into the queue and on from there.

threads=${SLURM_CPUS_PER_TASK:-1}
export OMP_NUM_THREADS=$threads OMP_PLACES=cores OMP_PROC_BIND=close

trap 'heard=yes; kill -USR1 "$!" 2>/dev/null' USR1 TERM
# Started in the background, since bash hears a signal at once only while it waits. TERM is not passed on as such:
# a launcher of parallel programs would kill them a second later.
./polydem run "$@" --threads "$threads" --continue &
run=$!
while :; do
  heard=
  wait "$run"
  code=$?
  # A signal ends the wait, but not the run.
  [ -n "$heard" ] || break
done

[ "$code" -ne 75 ] || scontrol requeue "$SLURM_JOB_ID"
exit "$code"
