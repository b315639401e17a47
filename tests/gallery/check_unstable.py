"""Every scene of inputs at ten times its stable step: it stops cleanly and says why.

usage: check_unstable.py PROGRAM INPUTS TEST_GALLERY

Cleanly: exit code 1; a message with step, body, position and what to do; the same at the end of the log; a profile;
a closed trajectory whose last frame is the step at which the run stopped. The third argument is the source of the
tests at the own steps, which must know every scene. A bed of round grains is stable at its own step.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

MESSAGE = re.compile(r"polydem: (step \d+: .*bod(?:y|ies) \d+.* at \([-+.0-9E]+, [-+.0-9E]+\) m.*"
                     r"(?:[Rr]educe (?:dt|safety_factor)|Increase speed).*)")
RUN_ERROR = 1
#: Overrides that leave a run to its other guards
BLIND = ("guards.step=off", "guards.overlap=stop")
#: Overrides for contacts of first order in the step, which are unstable from smaller steps on
FIRST_ORDER = ("forces.damping_from_touch=.false.", "forces.midstep_slip=.false.")
#: Overrides of single scenes: a cell as light as that of its own step is refused at this one before the run
OWN = {"pressed": ("cell.mass=100",)}


def scenes(inputs):
    """Namelists of runs; those of benches have no group &scene."""
    found = [path for path in sorted(inputs.glob("*.nml")) if "&scene" in path.read_text(encoding="utf-8")]
    assert len(found) >= 12, found
    return found


def stop(program, path, folder, *settings):
    """Run a scene that must stop; return what it says."""
    overrides = [f"output.folder={folder}", "integrate.dt=0", "integrate.safety_factor=10", *OWN.get(path.stem, ()),
                 *settings]
    command = [program, "run", str(path)] + [word for each in overrides for word in ("--set", each)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == RUN_ERROR, (path.name, done.returncode, done.stderr)
    match = MESSAGE.fullmatch(done.stderr.strip())
    assert match, (path.name, done.stderr)
    log = (folder / "log.txt").read_text(encoding="utf-8")
    assert f"stopped: {match[1]}\nstate hash: " in log, (path.name, log[-1000:])
    assert "NaN" not in log and "Infinity" not in log, (path.name, log[-1000:])
    names = {each.name for each in folder.iterdir()}
    assert {"profile.h5", "trajectory_0001.h5"} <= names and not any(name.endswith(".open") for name in names), names
    step = int(match[1].split()[1].rstrip(":"))
    dt = float(re.search(r"^step       dt = (\S+) s", log, re.MULTILINE)[1])
    segment = max(str(each) for each in folder.glob("trajectory_*.h5"))
    info = subprocess.run([program, "info", segment], capture_output=True, text=True, timeout=600, check=True).stdout
    last = float(re.search(r"frames .* s to (\S+) s", info)[1])
    assert abs(last - step * dt) <= 1e-5 * step * dt, (path.name, step, dt, info)
    return match[1]


def stay_stable(program, path, folder):
    """Round grains, whose contacts span many edges, at the automatic step: no guard speaks."""
    for settings in (("forces.friction=none",), ("forces.law=area",)):
        overrides = [f"output.folder={folder}", "scene.bodies=60", "scene.corners=64, 64",
                     "integrate.duration=0.1", *settings]
        command = [program, "run", str(path), "--force"] + [word for each in overrides for word in ("--set", each)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
        assert done.returncode == 0 and "\nwarning" not in done.stdout, (settings, done.stdout, done.stderr)


def main():
    program, inputs, known = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]).read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as work:
        stay_stable(program, inputs / "bed.nml", Path(work) / "round")
        for path in scenes(inputs):
            assert f"'{path.stem}'" in known, f"{path.name} is not played in {sys.argv[3]}"
            folder = Path(work) / path.stem
            print(path.stem, stop(program, path, folder))
            # With the look at the stable step switched off another guard must notice.
            print(path.stem, stop(program, path, folder / "first_order", *BLIND, *FIRST_ORDER))
            print(path.stem, stop(program, path, folder / "second_order", *BLIND))


if __name__ == "__main__":
    main()
