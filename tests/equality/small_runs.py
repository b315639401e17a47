"""Six short runs, and the hash of the state at their end."""

import os
import re
import shutil
import subprocess
import sys

#: Dense enough for sliding contacts, moving walls and cut walls, and short.
RUNS = {
    "drum.nml": ["scene.bodies=400", "motion.turn.start=0", "motion.turn.ramp=0.02", "integrate.dt=2.5e-5",
                 "integrate.duration=0.15"],
    "hopper.nml": ["scene.bodies=300", "integrate.dt=1.25e-5", "integrate.duration=0.1"],
    "gas.nml": ["scene.bodies=300", "integrate.dt=1.25e-5", "integrate.duration=0.1"],
    "heap.nml": ["scene.bodies=200", "integrate.dt=1.25e-5", "integrate.duration=0.1"],
    "stack.nml": ["integrate.dt=1.25e-5", "integrate.duration=0.1"],
    "incline.nml": ["integrate.dt=1.25e-5", "integrate.duration=0.1"],
}


def state_hash(program, sources, scene, result, threads=1, environment=None):
    """Run a scene and read the last line of its log."""
    # What an older revision left there has no manifest and would be in the way.
    shutil.rmtree(result, ignore_errors=True)
    command = [str(program), "run", str(sources / "inputs" / scene), "--threads", str(threads)]
    for override in [*RUNS[scene], f"output.folder={result}", "output.frame_interval=0"]:
        command += ["--set", override]
    done = subprocess.run(command, capture_output=True, text=True, check=False,
                          env={**os.environ, "OMP_WAIT_POLICY": "passive", **(environment or {})})
    last = done.stdout.strip().splitlines()[-1:]
    found = re.fullmatch(r"state hash: ([0-9a-f]{16})", last[0] if last else "")
    if done.returncode != 0 or not found:
        sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return found[1]
