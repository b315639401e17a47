"""Every scene of inputs in a program with run-time checks: it runs, continues and is shown without a fault.

usage: check_gallery.py INPUTS [PROGRAM [SCENE ...]]

Without PROGRAM that of the environment variable POLYDEM_DEBUG_PROGRAM is taken; without both the test is skipped (77).

Of each scene, and each of its stages, a millisecond is simulated, with contacts in the output and checkpoints. A scene
without stages then goes on for another one, and a run of its own begins from a frame of it.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

SKIPPED = 77
VARIABLE = "POLYDEM_DEBUG_PROGRAM"
#: Simulated time of a scene or a stage [s]
SHORT = "1e-3"
OPTIONS = ("output.contacts=.true.", "output.frame_interval=3e-4", "checkpoint.steps=20")
#: What is left at the end of a run is no fault: gfortran does not free all of it
NO_LEAKS = "detect_leaks=0"
#: What compiler and sanitizers say of a fault
FAULT = re.compile(r"Fortran runtime error|SIG[A-Z]+|Sanitizer|runtime error:|Error termination|terminated")
#: Groups that a run from a result would have to repeat
WITH_NAMES = re.compile(r"^\s*&(wall|grains|material|pair|source|sink|cell|load)\b", re.MULTILINE)
STAGE = re.compile(r"^\s*&stage\b(.*?)/\s*$", re.MULTILINE | re.DOTALL)


def times_of(text):
    """Overrides that make a scene short."""
    stages = [re.sub("!.*", "", body) for body in STAGE.findall(text)]
    if not stages:
        return [f"integrate.duration={SHORT}"]
    found = []
    for body in stages:
        name = re.search(r"name\s*=\s*'(\w+)'", body)[1]
        if re.search(r"until\s*=\s*'(?!duration)", body):
            found += [f"stage.{name}.longest={SHORT}", f"stage.{name}.at_limit=next", f"stage.{name}.check=10",
                      f"stage.{name}.hold=0"]
        else:
            found.append(f"stage.{name}.duration={SHORT}")
    return found


def call(program, *words, settings=()):
    """Call the program, which must end well; give what it says."""
    command = [program, *map(str, words), *(word for each in settings for word in ("--set", each))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200, check=False,
                          env={"ASAN_OPTIONS": NO_LEAKS, **os.environ, "OMP_NUM_THREADS": "2",
                               "OMP_WAIT_POLICY": "passive"})
    fault = FAULT.search(done.stderr)
    # Only the debug preset tells of temporary arrays, and each of them.
    said = re.sub(r"At line .*\nFortran runtime warning: An array temporary.*\n", "", done.stderr)
    assert done.returncode == 0 and not fault, (command, done.returncode, said[-3000:])
    return done.stdout


def play(program, path, folder):
    """Check, run, continue and show a scene."""
    text = path.read_text(encoding="utf-8")
    settings = (*OPTIONS, *times_of(text))
    call(program, "check", path, settings=settings)
    output = call(program, "run", path, settings=(*settings, f"output.folder={folder}"))
    assert "state hash: " in output, (path.name, output[-1000:])
    call(program, "info", "--check", folder)
    if settings[-1].startswith("integrate"):
        longer = (*settings[:-1], "integrate.duration=2e-3", f"output.folder={folder}")
        call(program, "run", path, "--continue", "--changed", settings=longer)
        if not WITH_NAMES.search(text):
            start = folder.with_suffix(".nml")
            start.write_text(f"&scene name = 'result' start_from = '{folder}:1' / &integrate duration = {SHORT} /\n",
                             encoding="utf-8")
            call(program, "run", start, settings=(*OPTIONS, f"output.folder={folder}_2"))


def main():
    inputs, program = Path(sys.argv[1]).resolve(), sys.argv[2] if sys.argv[2:] else os.environ.get(VARIABLE)
    if not program:
        print(f"skipped: {VARIABLE} does not name a program of the preset debug")
        return SKIPPED
    program = os.path.abspath(program)
    paths = [path for path in sorted(inputs.glob("*.nml")) if "&bench" not in path.read_text(encoding="utf-8")]
    assert len(paths) >= 26, paths
    paths = [path for path in paths if not sys.argv[3:] or path.stem in sys.argv[3:]]
    with tempfile.TemporaryDirectory() as work:
        for path in paths:
            play(program, path, Path(work) / path.stem)
            print(path.stem, flush=True)
    print(f"{len(paths)} scenes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
