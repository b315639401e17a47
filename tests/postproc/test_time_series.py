"""The series of a run, in segments and as CSV; and frames after a gate has vanished."""

import csv
import os
import re
import subprocess

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from polydem_post import Trajectory
from polydem_post.analysis import (
    coordination_number,
    inertial_number,
    sample_fraction,
    sample_stress,
    shear_rate,
    unbalanced_force,
)

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


#: Grains in a box whose walls bound the sample, in part of it, in a channel, in a sheared cell; crosses in a box
SAMPLES = {
    "walls": ("sides = 'right', 'left' ends = 'floor', 'lid'", (-0.05, -0.05, 0.05, 0.05), "none"),
    "rectangle": ("low = -0.03, -0.04 high = 0.04, 0.03", (-0.03, -0.04, 0.04, 0.03), "none"),
    "channel": ("ends = 'floor', 'lid'", (-0.05, -0.05, 0.05, 0.05), "x"),
    "none": ("", (-0.05, -0.05, 0.05, 0.05), "xy"),
    "concave": ("low = -0.05, -0.05 high = 0.05, 0.05", (-0.05, -0.05, 0.05, 0.05), "none"),
}
WALLS = """\
&wall name = 'floor' outline = 'rectangle' low = -0.07, -0.07 high = 0.07, -0.05 /
&wall name = 'lid' outline = 'rectangle' low = -0.07, 0.05 high = 0.07, 0.06 /
&wall name = 'left' outline = 'rectangle' low = -0.07, -0.05 high = -0.05, 0.05 /
&wall name = 'right' outline = 'rectangle' low = 0.05, -0.05 high = 0.07, 0.05 /
"""
CHANNEL = """\
&cell periodic = 'x' low = -0.05, 0 size = 0.1, 0 /
&wall name = 'floor' outline = 'line' from = -0.08, -0.05 to = 0.08, -0.05 thickness = 0.01 /
&wall name = 'lid' outline = 'line' from = 0.08, 0.05 to = -0.08, 0.05 thickness = 0.01 /
"""
CELL = "&cell periodic = 'xy' low = -0.05, -0.05 size = 0.1, 0.1 shear_rate = 60 profile = .true. /\n"
GRAINS = """\
&grains name = 'g' region = 'box' low = -0.05, -0.05 high = 0.05, 0.05 number = 55 arrangement = 'spread' speed = 1 /
&forces gravity = 0, -20 stiffness = 4e5 /
&output frame_interval = 4e-3 series_interval = 4e-3 contacts = .true. /
"""


@pytest.mark.parametrize("kind", SAMPLES)
def test_the_sample_has_the_quantities_of_its_frames(kind, tmp_path):
    """Finds columns that mean something else than the functions of frames, and an area that is another."""
    entries, area, periodic = SAMPLES[kind]
    word = {"channel": "walls", "concave": "rectangle"}.get(kind, kind)
    scene = {"channel": CHANNEL, "none": CELL}.get(kind, WALLS) + GRAINS
    scene += f"&sample area = '{word}' {entries} /\n&integrate duration = 0.04 /\n"
    if kind == "none":
        scene = scene.replace("0, -20", "0, 0")
    if kind == "concave":
        scene = scene.replace(" arrangement =", " shape = 'cross' width = 0.011 arm = 0.004 arrangement =")
    (tmp_path / "scene.nml").write_text(scene, encoding="utf-8")
    subprocess.run([PROGRAM, "run", "scene.nml"], cwd=tmp_path, check=True, capture_output=True)
    run = Trajectory(tmp_path / "results" / "scene")
    series = run.time_series
    assert len(run) == len(series["time"]) == 11
    gravity, jump = ((0.0, 0.0), 60.0) if kind == "none" else ((0.0, -20.0), None)
    n_pressed, n_several = 0, 0
    for k, frame in enumerate(run):
        stress = sample_stress(frame, area)
        n_pressed += np.trace(stress) > 0.0
        n_several += not frame.contacts.is_first.all()
        expected = {
            "kinetic_energy": frame.kinetic_energy[frame.free].mean(),
            "unbalanced_force": unbalanced_force(frame, gravity),
            "coordination": coordination_number(frame), "solid_fraction": sample_fraction(frame, area),
            "sample_width": area[2] - area[0], "sample_height": area[3] - area[1],
            "stress_xx": stress[0, 0], "stress_xy": stress[0, 1], "stress_yx": stress[1, 0], "stress_yy": stress[1, 1],
            "shear_rate": shear_rate(frame, area, periodic, jump),
            "inertial_number": inertial_number(frame, area, periodic, jump)}
        for name, value in expected.items():
            scale = np.abs(stress).max() if name.startswith("stress") else 0.0
            np.testing.assert_allclose(series[name][k], value, rtol=1e-9, atol=1e-9 * scale, err_msg=name)
    assert n_pressed > 4
    assert n_several > 4 if kind == "concave" else n_several == 0


def test_lines_of_the_log_have_the_quantities_of_a_row_at_their_step(tmp_path):
    """Finds lines from the contacts of another step, of other columns, or in a run without a series."""
    scene = WALLS + GRAINS + "&sample area = 'rectangle' low = -0.03, -0.04 high = 0.04, 0.03 /\n"
    (tmp_path / "scene.nml").write_text(scene + "&integrate duration = 0.02 /\n", encoding="utf-8")

    def run_of(*entries):
        words = [word for entry in ("log_interval=1e-3", *entries) for word in ("--set", f"output.{entry}")]
        done = subprocess.run([PROGRAM, "run", "scene.nml", "--force", *words], cwd=tmp_path, check=True,
                              capture_output=True, text=True)
        return done.stdout

    names = ("unbalanced_force", "coordination", "solid_fraction", "stress_xx", "stress_xy", "stress_yy",
             "inertial_number")
    number = r"(-|[-+.E\d]+)"
    line = re.compile(rf"^ +(\d+) .*%\n +unbalanced {number}, coordination {number}\n +solid fraction {number}, "
                      rf"stress xx {number}, xy {number}, yy {number} N/m2, inertial number {number}$", re.MULTILINE)
    rare = run_of("series_interval=5e-3")
    found = {int(step): values for step, *values in line.findall(rare)}
    assert "unbalanced" not in run_of("series_interval=0")
    often = run_of("series_interval=1e-3")
    assert found == {int(step): values for step, *values in line.findall(often)} and len(found) == 21
    series = Trajectory(tmp_path / "results" / "scene").time_series
    for k, step in enumerate(series["step"]):
        for name, value in zip(names, found[int(step)]):
            expected = series[name][k]
            assert value == ("-" if np.isnan(expected) else f"{expected:.2E}"), (step, name)
    assert max(float(values[1]) for values in found.values()) > 0.5


def test_a_stress_ends_a_stage(tmp_path):
    """Finds a condition that takes another component, or never holds."""
    stages = ("&sample area = 'walls' sides = 'left', 'right' ends = 'floor', 'lid' /\n"
              "&motion name = 'press' wall = 'lid' kind = 'translation' velocity = 0, -1 stage = 'press' /\n"
              "&stage name = 'press' until = 'stress' component = 'yy' above = 4e3 longest = 0.1 check = 5 /\n"
              "&stage name = 'wait' duration = 1e-3 /\n")
    scene = WALLS.replace("low = -0.07, 0.05", "low = -0.049, 0.05").replace("0.07, 0.06", "0.049, 0.06") + GRAINS
    (tmp_path / "scene.nml").write_text(scene + stages, encoding="utf-8")
    run_of = [PROGRAM, "run", "scene.nml", "--set", "output.series_interval=1e-5"]
    done = subprocess.run(run_of, cwd=tmp_path, check=True, capture_output=True, text=True)
    series = Trajectory(tmp_path / "results" / "scene").time_series
    above = series["time"][series["stress_yy"] > 4e3]
    assert 0.0 < above[0] < series["time"][-1] - 9e-4
    assert "stress is" in done.stdout


@pytest.mark.parametrize(("entries", "message"), [
    ("area = 'walls' sides = 'left', 'right'", "'ends' in &sample must name two walls"),
    ("area = 'walls' sides = 'left', 'left' ends = 'floor', 'lid'", "'sides' in &sample names the same wall twice"),
    ("area = 'rectangle' low = 0, 0 high = 1, 0", "'high' in &sample must exceed"),
    ("", "'until' in &stage press = 'stress' needs the area"),
])
def test_an_area_has_sides_along_both_axes(entries, message, tmp_path):
    stage = "&stage name = 'press' until = 'stress' component = 'yy' above = 4e3 longest = 0.1 /\n"
    (tmp_path / "scene.nml").write_text(WALLS + GRAINS + stage + f"&sample {entries} /\n", encoding="utf-8")
    done = subprocess.run([PROGRAM, "check", "scene.nml"], cwd=tmp_path, check=False, capture_output=True, text=True)
    assert done.returncode != 0 and message in done.stdout + done.stderr
