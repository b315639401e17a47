"""The examples of the manual run as they are, with fewer bodies."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from matplotlib.image import imread
from polydem_post import Trajectory

EXAMPLES = Path(os.environ["POLYDEM_SOURCE_DIR"]) / "postproc" / "examples"


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("*.py")))
def test_an_example_runs_and_draws_its_figure(name, tmp_path):
    environment = {**os.environ, "EXAMPLE_BODIES": "100", "EXAMPLE_RESULT": "result"}
    done = subprocess.run([sys.executable, "-W", "error", str(EXAMPLES / name)], cwd=tmp_path, env=environment,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    picture = imread(tmp_path / done.stdout.splitlines()[-1])
    assert min(picture.shape[:2]) > 800 and picture[..., :3].std() > 0.1
    run = Trajectory(tmp_path / "result")
    assert run.status == "finished" and repr(run).replace(str(run.folder), "result") in done.stdout
