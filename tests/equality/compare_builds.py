"""State hashes of the same runs by programs that were compiled in different ways.

usage: compare_builds.py SOURCES FOLDER CMAKE PROGRAM
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

BUILDS = {
    "plain": ["-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_Fortran_FLAGS_RELEASE=-O0"],
    "native": ["-DCMAKE_BUILD_TYPE=Release", "-DPOLYDEM_NATIVE=ON"],
}
# Dense enough for sliding contacts, moving walls and cut walls, and short.
RUNS = {
    "drum.nml": ["scene.bodies=400", "scene.motion_start=0", "scene.motion_ramp=0.02", "integrate.dt=2.5e-5",
                 "integrate.duration=0.15"],
    "hopper.nml": ["scene.bodies=300", "integrate.dt=2.5e-5", "integrate.duration=0.1"],
    "gas.nml": ["scene.bodies=300", "integrate.dt=2.5e-5", "integrate.duration=0.1"],
}


def build(sources, folder, cmake, options):
    """Configure and build one program; return its path."""
    common = [cmake, "-S", str(sources), "-B", str(folder), "-G", "Ninja", "-DPOLYDEM_TESTS=OFF"]
    for command in (common + options, [cmake, "--build", str(folder)]):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            sys.exit(done.stdout + done.stderr)
    return folder / "src" / "app" / "polydem"


def state_hash(program, sources, scene, overrides, result, threads):
    """Run a scene and read the last line of its log."""
    # What an older revision left there has no manifest and would be in the way.
    shutil.rmtree(result, ignore_errors=True)
    command = [str(program), "run", str(sources / "inputs" / scene), "--threads", str(threads)]
    for override in [*overrides, f"output.folder={result}", "output.frame_interval=0"]:
        command += ["--set", override]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "OMP_WAIT_POLICY": "passive"},
                          check=False)
    last = done.stdout.strip().splitlines()[-1:]
    found = re.fullmatch(r"state hash: ([0-9a-f]{16})", last[0] if last else "")
    if done.returncode != 0 or not found:
        sys.exit(f"{' '.join(command)}\n{done.stdout}{done.stderr}")
    return found[1]


def main():
    sources, folder, cmake, program = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3], sys.argv[4]
    programs = {"this": program}
    for name, options in BUILDS.items():
        programs[name] = build(sources, folder / name, cmake, options)
    different = False
    for scene, overrides in RUNS.items():
        hashes = {name: state_hash(path, sources, scene, overrides, folder / "result", 1 + (name == "native"))
                  for name, path in programs.items()}
        print(scene, hashes)
        different = different or len(set(hashes.values())) != 1
    return int(different)


if __name__ == "__main__":
    sys.exit(main())
