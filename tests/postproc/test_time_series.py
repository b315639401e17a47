"""The series of walls and loads, in segments and as CSV; and frames after a gate has vanished."""

import csv
import os
import subprocess

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from polydem_post import Trajectory

PROGRAM = os.environ["POLYDEM_PROGRAM"]

#: A plate presses grains that rest on a gate beside a floor
SCENE = """\
&wall name = 'floor' outline = 'rectangle' low = -0.1, -0.02 high = 0, 0 /
&wall name = 'gate' outline = 'rectangle' low = 0, -0.02 high = 0.1, 0 vanish_at = 0.02 /
&wall name = 'plate' outline = 'rectangle' low = -0.1, 0.08 high = 0.1, 0.1 /
&grains name = 'g' region = 'box' low = -0.08, 0 high = 0.08, 0.08 number = 30 /
&load name = 'press' wall = 'plate' direction = 'y' force = -200 mass = 1 damping_ratio = 0.01 /
&forces stiffness = 1e6 /
&integrate duration = 0.04 /
&output frame_interval = 0.004 frames_per_segment = 2 series_interval = 1e-3 csv = .true. contacts = .true. /
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The run of the scene."""
    folder = tmp_path_factory.mktemp("series")
    (folder / "press.nml").write_text(SCENE, encoding="utf-8")
    subprocess.run([PROGRAM, "run", "press.nml"], cwd=folder, check=True, capture_output=True)
    return Trajectory(folder / "results" / "press")


def test_rows_stand_at_multiples_of_the_interval(run):
    series = run.time_series
    assert len({len(column) for column in series.values()}) == 1
    assert np.all(np.abs(series["time"] - 1e-3 * np.arange(41)) < 1e-4)
    assert np.all(np.diff(series["step"]) > 0)
    assert series["press.load"][-1] == -200
    assert series["plate.force_y"].max() > 0
    assert_array_equal(series["press.contacts"], series["plate.force_y"])
    assert run.time_series_units["plate.torque"] == "N"
    first = series["plate.y"][0]
    np.testing.assert_allclose(series["plate.y"], first + series["press.displacement"], atol=1e-15)


def test_the_table_has_the_same_numbers(run):
    with (run.folder / "series.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    names = {name.partition(" [")[0]: name for name in rows[0]}
    assert set(names) == set(run.time_series)
    for name, column in run.time_series.items():
        assert_array_equal([float(row[names[name]]) for row in rows], column)
    subprocess.run([PROGRAM, "info", run.folder, "--check"], check=True, capture_output=True)


def test_frames_lose_the_gate(run):
    bodies = [len(frame) for frame in run]
    assert bodies == [33] * 6 + [32] * 5
    last = run[-1]
    assert 32 not in last.id and len(last.walls.id) == 2 and len(last.contacts) > 0
    assert_array_equal(last.id[last.driven], [33])
    assert last.position[last.free, 1].min() < -0.001
