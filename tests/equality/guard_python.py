"""Goes on with the Python of .venv, which the launcher makes, if this one lacks h5py or numpy: to be imported first."""

import importlib.util
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True

if importlib.util.find_spec("h5py") is None or importlib.util.find_spec("numpy") is None:
    python = ROOT / ".venv" / "bin" / "python"
    if not python.exists() or os.environ.get("POLYDEM_GUARD_PYTHON") == str(python):
        sys.exit(f"{sys.executable} lacks h5py or numpy: ./polydem test makes an environment that has them")
    os.environ["POLYDEM_GUARD_PYTHON"] = str(python)
    os.execv(python, [str(python), *sys.argv])
