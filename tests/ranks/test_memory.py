"""No rank needs memory for all bodies."""

import subprocess
import sys

from runs import ENVIRONMENT, MPIRUN, PARALLEL

#: A scene whose bodies take far more memory than the program and MPI
BED = """&scene name = 'bed' bodies = 100000 speed = 0.1 /
&integrate dt = 1e-5 duration = 2e-5 /
&output energy_balance = .false. /
"""
#: Runs a program and writes its peak memory to a file of this process
MEASURE = """import os, resource, subprocess, sys
subprocess.run(sys.argv[2:], check=True)
with open(f'{sys.argv[1]}/peak_{os.getpid()}', 'w', encoding='utf-8') as file:
    file.write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))
"""
#: Greatest share of the memory for bodies of one process that each of eight ranks may take
MOST = 0.35


def peaks(folder, ranks, bodies):
    """Peak memory of each rank in KiB"""
    results = folder / f"of_{ranks}_{bodies}"
    measured = folder / f"peaks_of_{ranks}_{bodies}"
    measured.mkdir()
    (folder / "bed.nml").write_text(BED.replace("100000", str(bodies)), encoding="utf-8")
    command = [*MPIRUN, "--oversubscribe", "-n", str(ranks), sys.executable, "-c", MEASURE, str(measured),
               PARALLEL, "run", str(folder / "bed.nml"), "--threads", "1", "--set", f"output.folder={results}"]
    subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True, check=True, timeout=600)
    return [int(path.read_text(encoding="utf-8")) for path in measured.iterdir()]


def test_each_of_eight_ranks_takes_a_small_share_of_the_memory_of_one(tmp_path):
    few, many = 1000, 100000
    alone = max(peaks(tmp_path, 1, many)) - max(peaks(tmp_path, 1, few))
    shared = peaks(tmp_path, 8, many)
    assert len(shared) == 8
    assert max(shared) - min(peaks(tmp_path, 8, few)) < MOST*alone, (alone, shared)
