"""The types of the packages are right: mypy finds nothing, with the choices of postproc/pyproject.toml."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(os.environ["POLYDEM_SOURCE_DIR"])


def check(*options, folder=ROOT / "postproc"):
    command = [sys.executable, "-m", "mypy", "--cache-dir", os.environ.get("TMPDIR", "/tmp") + "/polydem_mypy"]
    return subprocess.run([*command, *options], cwd=folder, capture_output=True, text=True, check=False)


@pytest.fixture(autouse=True)
def _is_there():
    pytest.importorskip("mypy", reason="mypy is not installed: pip install 'postproc[test]'")


def test_the_packages_have_no_wrong_types():
    found = check()
    assert found.returncode == 0, found.stdout + found.stderr


def test_a_user_sees_the_types(tmp_path):
    (tmp_path / "user.py").write_text(
        "from polydem_post import Frame, Trajectory\n"
        "run = Trajectory('results/drum')\n"
        "reveal_type(run[0])\nreveal_type(run[1:])\nreveal_type(run[0].contacts)\n"
        "for frame in run:\n    reveal_type(frame)\n"
        "x: int = run[0].time\n", encoding="utf-8")
    found = check("--config-file", str(ROOT / "postproc" / "pyproject.toml"), str(tmp_path / "user.py"))
    for kind in ("frames.Frame", "trajectory.Trajectory", "contacts.Contacts"):
        assert f'Revealed type is "polydem_post.read.{kind}"' in found.stdout
    assert 'expression has type "float", variable has type "int"' in found.stdout
