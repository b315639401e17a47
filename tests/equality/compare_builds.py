"""State hashes of the same runs by programs that were compiled in different ways.

usage: compare_builds.py SOURCES FOLDER CMAKE PROGRAM [--full]

The other program is that with run-time checks (-Og) which POLYDEM_DEBUG_PROGRAM names, as ./polydem test does. Without
it, and with --full, builds are made here: at -O0, which differs most from the -O3 of the preset release, and with
--full at -O2. They may give no warning.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

from small_runs import RUNS, state_hash

CHECKED = os.environ.get("POLYDEM_DEBUG_PROGRAM")
BUILDS = {"plain": "-O0", "less": "-O2"} if "--full" in sys.argv else {} if CHECKED else {"plain": "-O0"}


def build(sources, folder, cmake, level):
    """Configure and build one program; return its path."""
    common = [cmake, "-S", str(sources), "-B", str(folder), "-G", "Ninja", "-DPOLYDEM_TESTS=OFF"]
    options = ["-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_Fortran_FLAGS_RELEASE={level}"]
    for command in (common + options, [cmake, "--build", str(folder)]):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0 or re.search(r"^(.*: )?Warning: ", done.stdout, re.MULTILINE):
            # What is compiled gives no warning again.
            shutil.rmtree(folder)
            sys.exit(done.stdout + done.stderr)
    return folder / "src" / "app" / "polydem"


def main():
    sources, folder, cmake, program = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3], sys.argv[4]
    programs = {"this": program, **({"checked": CHECKED} if CHECKED else {})}
    for name, level in BUILDS.items():
        programs[name] = build(sources, folder / name, cmake, level)
    different = False
    for scene in RUNS:
        hashes = {name: state_hash(path, sources, scene, folder / "result", 1 + (name != "this"))
                  for name, path in programs.items()}
        print(scene, hashes)
        different = different or len(set(hashes.values())) != 1
    return int(different)


if __name__ == "__main__":
    sys.exit(main())
