"""Count the source files and procedures that a run executes, and those that every step executes.

usage: count_executed.py ROOT NAMELIST

Builds the program of ROOT without optimisation in a temporary folder, with the counters of gcov, and does the run on
one thread. Prints how many files of src have an executed procedure, how many procedures are executed, and how many of
the files have one that is executed as often as there are steps. Files that the build makes count, too. It takes some
minutes.
"""

import collections
import json
import os
import re
import subprocess
import sys
import tempfile


def call(command, **options):
    """Run a command to its end; return its output."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout[-3000:]}{done.stderr[-3000:]}")
    return done.stdout


def build(root, folder):
    """The program with counters."""
    call(["cmake", "-S", root, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Coverage", "-DPOLYDEM_TESTS=OFF",
          "-DCMAKE_Fortran_FLAGS=--coverage -O0", "-DCMAKE_C_FLAGS=--coverage -O0"])
    call(["cmake", "--build", folder, "--target", "polydem"])
    return os.path.join(folder, "src", "app", "polydem")


def count(folder, root):
    """Executions of each procedure that is executed at all, by (file, procedure)."""
    data = [os.path.join(place, name) for place, _, names in os.walk(folder) for name in names
            if name.endswith(".gcda")]
    found = collections.Counter()
    for start in range(0, len(data), 100):
        output = call(["gcov", "--json-format", "--stdout", *data[start:start + 100]], cwd=folder)
        for line in output.splitlines():
            for file in json.loads(line)["files"]:
                path = os.path.relpath(os.path.join(folder, file["file"]), root)
                for procedure in file["functions"]:
                    if procedure["execution_count"] > 0 and "/src/" in f"/{path}":
                        found[path, procedure["name"]] += procedure["execution_count"]
    return found


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__.split("\n\n")[1])
    root, namelist = (os.path.abspath(word) for word in sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        program = build(root, os.path.join(folder, "build"))
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        shown = call([program, "check", namelist], env=environment)
        steps = int(re.search(r"\nduration +(?:at most )?\S+ s, (\d+) steps", shown)[1])
        call(["find", folder, "-name", "*.gcda", "-delete"])
        call([program, "run", namelist, "--threads", "1", "--set", f"output.folder={folder}/result"],
             env=environment)
        found = count(os.path.join(folder, "build"), root)
    files = {file for file, _ in found}
    every = {file for (file, _), executions in found.items() if executions >= steps}
    print(f"{len(files)} files, {len(found)} procedures, {len(every)} files with one executed in each of {steps} steps")
    return 0


if __name__ == "__main__":
    sys.exit(main())
