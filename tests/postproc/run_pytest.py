"""Run the tests of the Python package: run_pytest.py ROOT TESTS WRITE_SAMPLE PROGRAM [OPTION...].

Takes the Python of ROOT/.venv, which the launcher makes, or else the Python that runs this file.
"""

import os
import subprocess
import sys
from pathlib import Path

NEEDED = "import h5py, matplotlib, numpy, pytest"


def main() -> int:
    root, tests, write_sample, program = (Path(word) for word in sys.argv[1:5])
    python = root / ".venv" / "bin" / "python"
    if not python.exists():
        python = Path(sys.executable)
    if subprocess.run([str(python), "-c", NEEDED], stderr=subprocess.DEVNULL, check=False).returncode != 0:
        print(f"{python} lacks one of h5py, matplotlib, numpy and pytest. Let the launcher make the environment:")
        print("    ./polydem test")
        return 1
    environment = dict(os.environ)
    environment["PYTHONPATH"] = str(root / "postproc" / "src")
    environment["PYTHONDONTWRITEBYTECODE"] = "1"
    environment["POLYDEM_WRITE_SAMPLE"] = str(write_sample)
    environment["POLYDEM_PROGRAM"] = str(program)
    environment["POLYDEM_SOURCE_DIR"] = str(root)
    command = [str(python), "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tests), *sys.argv[5:]]
    return subprocess.run(command, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
