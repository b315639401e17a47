"""Runs of the two programs, and what they leave."""

import os
import re
import signal
import subprocess
import time
from pathlib import Path

import h5py
from polydem_post import Trajectory
from polydem_post.base.columns import field_names

#: Programs without and with MPI
SERIAL = os.environ["POLYDEM_PROGRAM"]
PARALLEL = os.environ["POLYDEM_MPI_PROGRAM"]

#: How ranks are started: by an mpirun that ends with them
MPIRUN = (str(Path(__file__).parents[2] / "src" / "packaging" / "watch_ranks"), "mpirun")

#: All finders, from the table of entries
FINDERS = re.search(r"^\| &neighbours \| `finder` .*?\| (\w+(?:, \w+)+) \|",
                    (Path(__file__).parents[2] / "inputs" / "entries.md").read_text(encoding="utf-8"),
                    re.MULTILINE).group(1).split(", ")

#: Lines that the program writes about what is wrong, its Fortran library or a sanitizer. Libraries of MPI may say more.
OWN_LINE = re.compile(r"polydem: |.*(Fortran runtime|At line \d|Error termination|Note: The following floating-point|"
                      r"Program received signal|Sanitizer|runtime error:|libgomp: )")

#: How ranks are started where there may be fewer cores: they take turns, and nobody is bound
ENVIRONMENT = {
    **os.environ,
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OMP_WAIT_POLICY": "passive",
}
#: Lets ranks sleep while they wait; built with the tests of the program without MPI
PATIENCE = Path(SERIAL).resolve().parents[2] / "tests" / "ranks" / "libpatient_ranks.so"
if PATIENCE.exists():
    ENVIRONMENT["LD_PRELOAD"] = str(PATIENCE)
if os.getuid() == 0:
    ENVIRONMENT.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")


def start(namelist, folder, ranks=None, threads=1, options=()):
    """Start a run: of the program without MPI if no number of ranks is given."""
    command = [SERIAL] if ranks is None else [*MPIRUN, "-n", str(ranks), PARALLEL]
    command += ["run", str(namelist), "--threads", str(threads), "--set", f"output.folder={folder}", *options]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                            text=True, env=ENVIRONMENT)


def run(namelist, folder, ranks=None, threads=1, options=(), code=0):
    """Run to the end, which must have the given exit code; give standard output and standard error."""
    process = start(namelist, folder, ranks, threads, options)
    output, message = process.communicate(timeout=600)
    assert process.returncode == code, f"ended with {process.returncode}, not {code}:\n{message}\n{output[-2000:]}"
    return output, message


def contents(folder):
    """All that the segments of a result hold, but not where it comes from: type, shape and bytes by name."""
    found = {}

    def take(name, entry):
        if isinstance(entry, h5py.Dataset) and not name.startswith("provenance/"):
            value = entry[()]
            found[f"{path.name}:{name}"] = (entry.dtype.str, entry.shape, getattr(value, "tobytes", lambda: value)())

    for path in sorted(Path(folder).glob("trajectory_*.h5")):
        with h5py.File(path, "r") as file:
            file.visititems(take)
    assert found, f"{folder} holds no trajectory"
    return found


def frames(folder):
    """What the reader sees in a result, wherever its segments begin: bytes by frame and name."""
    result = Trajectory(folder)
    found = {}
    for number in range(len(result)):
        for part in (result.frame(number), result.contacts(number), result.walls(number)):
            for name in field_names(type(part)):
                value = getattr(part, name)
                found[f"frame {number}: {type(part).__name__}.{name}"] = getattr(value, "tobytes", lambda: value)()
    for name, values in result.energy_balance.items():
        found[f"energy balance: {name}"] = values.tobytes()
    for name, values in result.departures.items():
        found[f"departures: {name}"] = values.tobytes()
    for name, values in result.time_series.items():
        found[f"series: {name}"] = values.tobytes()
    assert found, f"{folder} holds no frame"
    return found


def state_hash(output):
    """The hash that a run prints at its end."""
    return re.search(r"^state hash: (\S+)", output, re.MULTILINE).group(1)


def count(output, name):
    """A count that a run prints at its end."""
    return int(re.search(rf"^{name} +(\d+) ", output, re.MULTILINE).group(1))


def complaints(text):
    """The lines of standard error that are ours, and not of the MPI library or of mpirun"""
    return [line for line in text.splitlines() if OWN_LINE.match(line)]


def differences(one, other):
    """Names of what differs between two results, as `contents` or `frames` gives them."""
    return [name for name in sorted(one.keys() | other.keys()) if one.get(name) != other.get(name)]


def newest(folder):
    """When the newest checkpoint was written; 0 if there is none."""
    return max((path.stat().st_mtime_ns for path in folder.glob("checkpoint_?.h5")), default=0)


def interrupt(folder, namelist, ranks, threads=1, options=()):
    """Begin or continue a run, and end it by a signal soon after its next checkpoint."""
    before = newest(folder)
    process = start(namelist, folder, ranks, threads, ("--continue", *options))
    end = time.monotonic() + 600
    while newest(folder) == before and process.poll() is None:
        assert time.monotonic() < end, "waited in vain for a checkpoint"
        time.sleep(0.002)
    process.send_signal(signal.SIGUSR1)
    output, message = process.communicate(timeout=600)
    assert process.returncode == 75, (process.returncode, message)
    return int(re.search(r"interrupted by SIGUSR1 at step (\d+) of", message).group(1)), output
