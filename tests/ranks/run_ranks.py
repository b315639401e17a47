"""Run the tests of several processes: run_ranks.py ROOT PROGRAM [FILE ...] [OPTION ...].

ROOT is the repository, PROGRAM the one without MPI, POLYDEM_MPI_PROGRAM in the environment the one with it; without
that the tests are skipped (code 77). FILE is one of this folder, else all are run. Options are those of pytest, and
--full for all combinations, which writes equality.md.
"""

import os
import subprocess
import sys
from pathlib import Path

#: Exit code of a test that was skipped
SKIPPED = 77
NEEDED = "import h5py, numpy, pytest"


def main() -> int:
    root, program = (Path(word).resolve() for word in sys.argv[1:3])
    if not os.environ.get("POLYDEM_MPI_PROGRAM"):
        print("skipped: POLYDEM_MPI_PROGRAM does not name a program with MPI")
        return SKIPPED
    python = root / ".venv" / "bin" / "python"
    if not python.exists():
        python = Path(sys.executable)
    if subprocess.run([str(python), "-c", NEEDED], stderr=subprocess.DEVNULL, check=False).returncode != 0:
        print(f"{python} lacks one of h5py, numpy and pytest; ./polydem test makes an environment that has them")
        return 1
    environment = {name: value for name, value in os.environ.items() if not name.startswith("OMPI_COMM_WORLD")}
    environment["POLYDEM_MPI_PROGRAM"] = str(Path(environment["POLYDEM_MPI_PROGRAM"]).resolve())
    environment["POLYDEM_PROGRAM"] = str(program)
    for variable, owner in (("POLYDEM_LIBRARY", program), ("POLYDEM_MPI_LIBRARY", environment["POLYDEM_MPI_PROGRAM"])):
        libraries = Path(owner).parents[1].joinpath("library").glob("libpolydem*.so.0")
        environment[variable] = str(next(libraries, ""))
    environment["POLYDEM_SOURCE_DIR"] = str(root)
    environment["PYTHONPATH"] = str(root / "postproc" / "src")
    environment["PYTHONDONTWRITEBYTECODE"] = "1"
    tests = Path(__file__).resolve().parent
    files = [str(tests / word) for word in sys.argv[3:] if word.endswith(".py")]
    command = [str(python), "-m", "pytest", "-q", "-p", "no:cacheprovider", "-o", "tmp_path_retention_policy=failed",
               "--rootdir", str(tests), *(files or [str(tests)]),
               *(word for word in sys.argv[3:] if not word.endswith(".py"))]
    return subprocess.run(command, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
