"""Run the tests of the Python package: run_pytest.py ROOT TESTS WRITE_SAMPLE PROGRAM [--needs=A,B] [OPTION...].

Without the packages that the tests need it ends with the code for skipped tests, and says how to install them. Takes
the Python of ROOT/.venv, which the launcher makes, or else the Python that runs this file.
"""

import os
import subprocess
import sys
from pathlib import Path

#: Exit code of tests that are skipped (tests/postproc/CMakeLists.txt)
SKIPPED = 77

#: Exit code of pytest when it collects no tests, as in a module that is skipped for want of a browser
NONE_COLLECTED = 5

NEEDED = "import h5py, matplotlib, numpy, pytest"


def main() -> int:
    root, tests, write_sample, program = (Path(word) for word in sys.argv[1:5])
    python = root / ".venv" / "bin" / "python"
    if not python.exists():
        python = Path(sys.executable)
    imported = subprocess.run([str(python), "-c", NEEDED], stderr=subprocess.PIPE, text=True, check=False)
    if imported.returncode != 0:
        print(imported.stderr.strip())
        print(f"{python} lacks one of h5py, matplotlib, numpy and pytest. Let the launcher make the environment:")
        print("    ./polydem test")
        return 1
    needs = [word.partition("=")[2].split(",") for word in sys.argv[5:] if word.startswith("--needs=")]
    options = [word for word in sys.argv[5:] if not word.startswith("--needs=")]
    for package in (name for names in needs for name in names):
        if subprocess.run([str(python), "-c", f"import {package}"], stderr=subprocess.DEVNULL, check=False).returncode:
            print(f"skipped: {python} lacks {package}. To run these tests: rm -r .venv; .ci/run")
            return SKIPPED
    environment = dict(os.environ)
    environment["PYTHONPATH"] = str(root / "postproc" / "src")
    environment["PYTHONDONTWRITEBYTECODE"] = "1"
    # Threads of few bodies wait for each other more than they work.
    environment.setdefault("OMP_NUM_THREADS", "1")
    environment["POLYDEM_WRITE_SAMPLE"] = str(write_sample)
    environment["POLYDEM_PROGRAM"] = str(program)
    environment["POLYDEM_SOURCE_DIR"] = str(root)
    command = [str(python), "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider",
               "-o", "tmp_path_retention_policy=failed", str(tests), *options]
    code = subprocess.run(command, env=environment, check=False).returncode
    return SKIPPED if code == NONE_COLLECTED else code


if __name__ == "__main__":
    sys.exit(main())
