"""The verb accuracy with the program itself: a block that slides as theory says, materials, given steps, errors."""

import csv
import math
import os
import subprocess
from pathlib import Path

import pytest
from polydem_post import Trajectory
from polydem_post.accuracy.estimate import FITTED
from polydem_post.accuracy.report import lines_of
from polydem_post.accuracy.study import Request, study_accuracy
from polydem_post.base.result_file import ResultError
from polydem_post.command_line.main import main

PROGRAM = Path(os.environ["POLYDEM_PROGRAM"])

#: A block slides down an incline of 30 degrees for so long [s]
DURATION, FRICTION = 0.03, 0.3
BLOCK = f"""&scene name = 'incline' width = 0.02 height = 0.01 slope = 30 /
&forces law = 'conservative' friction_coefficient = {FRICTION} /
&integrate duration = {DURATION} /
"""

#: A block of one material slides on a floor of another
MATERIALS = """&scene wall_material = 'steel' /
&material name = 'glass' stiffness = 1e7 /
&material name = 'steel' stiffness = 5e7 /
&material name = 'wood' /
&contact_pair name = 'pair' materials = 'glass', 'steel' stiffness = 2e7 /
&forces law = 'conservative' gravity = 5, -8 friction_coefficient = 0.3 /
&grains name = 'one' region = 'at' at = 0, 0.005 shape = 'rectangle' width = 0.02 height = 0.01 material = 'glass' /
&wall name = 'floor' outline = 'line' from = -0.1, 0 to = 0.1, 0 thickness = 0.01 /
&integrate duration = 0.02 /
"""

#: A tilted block has just left a floor with soft contacts, and is still in touch with stiffer ones turned the other way
IMPACT = """&grains name = 'one' region = 'at' at = 0, 0.00685 shape = 'rectangle' width = 0.01 height = 0.01
   angle = 30, 30 velocity = 0, -0.2 /
&wall name = 'floor' outline = 'line' from = -0.1, 0 to = 0.1, 0 thickness = 0.01 /
&forces law = 'conservative' stiffness = 2e7 /
&integrate duration = 4e-3 /
"""

#: Grains that collide until nothing remains of their first order
CROWD = """&scene name = 'gas' bodies = 20 solid_fraction = 0.3 speed = 3 /
&forces law = 'conservative' gravity = 0, 0 restitution = 1 friction = 'none' /
&integrate duration = 0.12 /
"""


def request(folder, text, *quantities, name="scene", **options):
    path = folder / f"{name}.nml"
    path.write_text(text, encoding="utf-8")
    return Request(path, PROGRAM, quantities=quantities, output=folder / "windows", **options)


def study(folder, text, *quantities, **options):
    return study_accuracy(request(folder, text, *quantities, **options), lambda line: None)


def call(*words):
    """Exit code of the verb."""
    return main(["accuracy", "--program", str(PROGRAM), "--cores", "1", *map(str, words)])


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    """The study of a sliding block, and its folder."""
    folder = tmp_path_factory.mktemp("block")
    return study(folder, BLOCK), folder


def test_the_way_of_a_sliding_block_is_extrapolated_to_that_of_rigid_bodies(block):
    outcome, _ = block
    tilt = math.radians(30.0)
    way = 0.5 * 9.81 * (math.sin(tilt) - FRICTION * math.cos(tilt)) * DURATION**2
    found = outcome.estimates["body.1.x"]
    plain, limit = (value * outcome.scales["body.1.x"] for value in (found.values[1.0], found.limit))
    exact = way * math.cos(tilt)
    assert found.state == FITTED and found.order == pytest.approx(0.5, abs=0.02)
    assert abs(plain / exact - 1.0) > 1e-2
    assert abs(limit / exact - 1.0) < 2e-4
    assert found.integration.error(1.0) < 1e-4
    assert outcome.horizon is None


def test_the_entries_keep_the_tolerance_when_they_are_run(block, tmp_path):
    outcome, folder = block
    chosen = outcome.recommended
    assert 1.0 < chosen.window.stiffness < 30.0
    assert set(chosen.entries) == {"forces.stiffness", "integrate.safety_factor"}
    words = [word for entry, value in chosen.entries.items() for word in ("--set", f"{entry}={value}")]
    subprocess.run([PROGRAM, "run", folder / "scene.nml", "--set", f"output.folder={tmp_path / 'run'}", *words],
                   check=True, capture_output=True)
    run = Trajectory(tmp_path / "run")
    way = math.hypot(*(run[-1].position[0] - run[0].position[0]))
    tilt = math.radians(30.0)
    exact = 0.5 * 9.81 * (math.sin(tilt) - FRICTION * math.cos(tilt)) * DURATION**2
    assert abs(way / exact - 1.0) < 1e-2


def test_the_same_command_runs_nothing_again(block):
    outcome, folder = block
    before = sorted(folder.rglob("attempts.csv"))
    stamps = [path.stat().st_mtime_ns for path in before]
    again = study(folder, BLOCK)
    assert sorted(folder.rglob("attempts.csv")) == before
    assert [path.stat().st_mtime_ns for path in before] == stamps
    assert again.recommended.entries == outcome.recommended.entries
    with pytest.raises(ResultError, match="holds windows of another scene"):
        study(folder, BLOCK.replace("width = 0.02", "width = 0.03"))


def test_every_stiffness_is_scaled(tmp_path):
    outcome = study(tmp_path, MATERIALS, "body.1.x")
    names = {"forces.stiffness", "material.glass.stiffness", "material.steel.stiffness", "contact_pair.pair.stiffness"}
    chosen = outcome.recommended
    factor = chosen.window.stiffness
    assert factor > 1.0 and set(chosen.entries) == {*names, "integrate.safety_factor"}
    assert float(chosen.entries["material.steel.stiffness"]) == pytest.approx(5e7 * factor)
    assert float(chosen.entries["contact_pair.pair.stiffness"]) == pytest.approx(2e7 * factor)
    stiff = {run.name: run for run in outcome.study.runs.values()}["E16_dt1"]
    settings = Trajectory(stiff.result).settings
    assert settings.material.glass.stiffness == 1.6e8 and settings.contact_pair.pair.stiffness == 3.2e8
    assert "stiffness" not in settings.material.wood
    assert any("every stiffness is scaled by the same factor" in line for line in lines_of(outcome))


def test_a_window_that_ends_within_an_impact_is_refused(tmp_path, capsys):
    path = tmp_path / "impact.nml"
    path.write_text(IMPACT, encoding="utf-8")
    assert call(path, "--output", tmp_path / "out", "--quantity", "body.1.vy", "--tolerance", "0.1") == 1
    said = capsys.readouterr().out
    assert "body.1.vy: refused: the differences" in said and "change sign" in said
    assert "entries    none keep the tolerance 0.1: no quantity has an estimate" in said


def test_a_given_step_is_scaled_with_the_stable_one(tmp_path, capsys):
    path = tmp_path / "given.nml"
    path.write_text(BLOCK.replace("duration =", "dt = 1e-5 duration ="), encoding="utf-8")
    assert call(path, "--output", tmp_path / "out", "--quantity", "body.1.x", "--tolerance", "0.03") == 0
    said = capsys.readouterr().out
    assert "dt is given: windows of other stiffness have it scaled" in said
    assert "integrate.dt=" in said and "safety_factor" not in said
    steps = {name: Trajectory(tmp_path / "out" / folder / "runs" / name / "result").steps[-1]
             for folder, name in (("scene", "E1_dt1"), ("needed", "E4_dt1"), ("needed", "E16_dt1"),
                                  ("needed", "E1_dt0.5"))}
    assert 3000 <= steps["E1_dt1"] <= 3300 and steps["E1_dt0.5"] == 2 * steps["E1_dt1"]
    assert steps["E4_dt1"] == pytest.approx(2 * steps["E1_dt1"], rel=0.05)
    assert steps["E16_dt1"] == pytest.approx(4 * steps["E1_dt1"], rel=0.05)


def test_a_crowd_of_collisions_is_noise_beyond_a_horizon(tmp_path, capsys):
    path = tmp_path / "crowd.nml"
    path.write_text(CROWD, encoding="utf-8")
    assert call(path, "--output", tmp_path / "out", "--quantity", "body.1.x", "--quantity", "body.2.y") == 1
    said = capsys.readouterr().out
    assert "below the noise: windows that differ in last bits, or by 3 % of the stiffness, differ by" in said
    assert "when last bits" in said and "in all of the window" not in said
    assert "entries    none keep the tolerance 0.01: no quantity has an estimate" in said
    rows = list(csv.DictReader((tmp_path / "out" / "accuracy.csv").open(encoding="utf-8")))
    assert [row["state"] for row in rows] == ["below the noise"] * 2 and not any(row["extrapolated"] for row in rows)


def test_a_study_starts_from_a_frame_of_a_result(block, tmp_path):
    outcome, _ = block
    result = outcome.study.runs[next(iter(outcome.study.runs))].result
    text = BLOCK.replace(str(DURATION), "0.01")
    started = study(tmp_path, text, "body.1.x", start=f"{result}:-1")
    first = Trajectory(result)[-1]
    for window, run in started.study.runs.items():
        begun = Trajectory(run.result)[0]
        assert begun.velocity[0] == pytest.approx(first.velocity[0], rel=1e-12)
        assert begun.position[0] == pytest.approx(first.position[0], abs=2e-6), window
    assert started.estimates["body.1.x"].is_usable
    with pytest.raises(ResultError, match="is not a result|no such|no frames|holds no"):
        study(tmp_path, text, "body.1.x", start=str(tmp_path))


@pytest.mark.parametrize("words, message", [
    (["--tolerance", "0"], "'0' is not a number above 0"),
    (["--tolerance", "2"], "--tolerance takes a number below 1"),
    (["--duration", "-1"], "is not a number above 0"),
    (["--quantity", "body.7.x"], "there is no such body"),
    (["--quantity", "body.1.mass"], "there is no such quantity"),
    (["--quantity", "flow:1,2,3"], "a line has four numbers"),
    (["--quantity", "flow:1,2,1,2"], "the line has no length"),
    (["--quantity", "body.1.x=zero"], "is not a number above 0"),
    (["--set", "forces.stifness=1"], "stifness"),
    (["--tolerence", "1"], "did you mean --tolerance?")])
def test_bad_options_are_named(tmp_path, capsys, words, message):
    path = tmp_path / "block.nml"
    path.write_text(BLOCK.replace(str(DURATION), "1e-3"), encoding="utf-8")
    try:
        code = call(path, "--output", tmp_path / "out", *words)
    except SystemExit as ended:
        code = ended.code
    assert code == 2 and message in capsys.readouterr().err


def test_scenes_without_windows_are_refused(tmp_path):
    with pytest.raises(ResultError, match="there is no such file"):
        study_accuracy(Request(tmp_path / "none.nml", PROGRAM))
    text = BLOCK.replace(f"&integrate duration = {DURATION} /\n", "")
    stages = text + "&stage name = 'settle' until = 'kinetic' below = 1e-3 longest = 1 /\n"
    with pytest.raises(ResultError, match="ends upon a condition"):
        study(tmp_path, stages)
    stages = text + "&stage name = 'slide' duration = 0.01 /\n"
    with pytest.raises(ResultError, match="have durations of their own"):
        study(tmp_path, stages, duration=0.01)
    with pytest.raises(ResultError, match="E1_dt1 failed: step .* overlap by"):
        study(tmp_path, IMPACT + "&guards overlap = 'stop' overlap_limit = 1e-4 /\n", "body.1.y")
