#!/usr/bin/env bash
#SBATCH --job-name=polydem
#SBATCH --ntasks=4
#SBATCH --cpus-per-task=8
#SBATCH --time=24:00:00
#SBATCH --signal=B:USR1@300
#SBATCH --requeue
#SBATCH --open-mode=append
#
# One run of several processes by MPI, perhaps on several nodes, from the folder of polydem, which all nodes must see:
#
#     POLYDEM_PRESET=mpi ./polydem --version                # once, where there is a compiler: builds
#     sbatch inputs/slurm/ranks.sh inputs/drum_12651.nml    # further words are options of the run
#
# Each process gets the cores of a task. It may go on with another number of them: the results have the same bits.

threads=${SLURM_CPUS_PER_TASK:-1}
export OMP_PLACES=cores OMP_PROC_BIND=close

trap 'heard=yes; kill -USR1 "$!" 2>/dev/null' USR1 TERM
# Started in the background, since bash hears a signal at once only while it waits. TERM is not passed on as such:
# mpirun would kill the run a second later.
mpirun -n "$SLURM_NTASKS" --map-by "slot:PE=$threads" -x OMP_PLACES -x OMP_PROC_BIND \
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
