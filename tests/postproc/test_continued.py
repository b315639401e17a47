"""Results of runs that were killed and continued."""

import os
import subprocess
import time

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from polydem_post import Trajectory

PROGRAM = os.environ.get("POLYDEM_PROGRAM", "")

SCENE = """\
&scene name = 'gas' bodies = 40 solid_fraction = 0.8 overlap = .true. speed = 0.5 /
&forces stiffness = 1e6 /
&integrate dt = 1e-5 duration = 6e-3 /
&output frame_interval = 2e-5 frames_per_segment = 30 contacts = .true. /
&checkpoint steps = 50 /
"""


@pytest.fixture(scope="module")
def start(tmp_path_factory):
    """Start a run of the scene into a folder of the same temporary place."""
    if not PROGRAM:
        pytest.skip("POLYDEM_PROGRAM does not name the program")
    place = tmp_path_factory.mktemp("continued")
    (place / "scene.nml").write_text(SCENE)

    def start_run(folder, *options):
        command = [PROGRAM, "run", "scene.nml", "--set", f"output.folder={folder}", *options]
        return place / folder, subprocess.Popen(command, cwd=place, stdout=subprocess.DEVNULL)

    return start_run


def kill_twice(start, folder):
    """Kill a run after each of its first two checkpoints, and let it end; give where it is, and nothing if it came to
    its end before it was killed."""
    killed, process = start(folder)
    for wanted in ("checkpoint_1.h5", "checkpoint_2.h5"):
        while not (killed / wanted).exists() and process.poll() is None:
            time.sleep(0.001)
        process.kill()
        if process.wait() == 0:
            return None
        n = len(Trajectory(killed))
        assert 0 < n < 301
        _, process = start(folder, "--continue")
    assert process.wait() == 0
    return killed


def test_a_continued_run_reads_like_one_that_was_not_interrupted(start):
    whole, process = start("whole")
    assert process.wait() == 0
    # On a busy machine a run may end before it is killed.
    killed = next(filter(None, (kill_twice(start, f"killed_{k}") for k in range(20))))
    expected, run = Trajectory(whole), Trajectory(killed)
    assert run.state_hash == expected.state_hash
    assert run.status == expected.status == "finished"
    assert_array_equal(run.steps, np.arange(0, 601, 2))
    assert_array_equal(run.times, expected.times)
    for number in range(len(run)):
        mine, other = run.frame(number), expected.frame(number)
        for column in ("id", "position", "angle", "velocity", "angular_velocity"):
            assert_array_equal(getattr(mine, column), getattr(other, column))
        assert_array_equal(run.contacts(number).force, expected.contacts(number).force)
        assert_array_equal(run.walls(number).force, expected.walls(number).force)
    for name, values in expected.energy_balance.items():
        assert_array_equal(run.energy_balance[name], values)
    assert run.provenance["parent"].startswith(f"{killed.name}/checkpoint_")
    assert expected.provenance["parent"] == "none"
    for name in ("pairs", "pairs began", "pairs ended", "contacts"):
        assert run.counters[name] == expected.counters[name]
