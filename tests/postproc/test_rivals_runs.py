"""Small comparisons with the program itself; the other codes are missing, or stood for by a worker of free flight."""

import os
import stat
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from polydem_lab.rivals import study as rivals_study
from polydem_lab.rivals.codes import CODES, RIVALS, chipmunk, polydem, rapier, siconos, yade
from polydem_lab.rivals.environment import insist_on_crate, insist_on_package
from polydem_lab.rivals.measure import measure
from polydem_lab.rivals.points import read_comparison
from polydem_lab.rivals.problems import PROBLEMS, Threshold
from polydem_lab.rivals.report import write_rivals_report
from polydem_lab.rivals.runs import WORKERS, Missing, Places, RunError, Worker
from polydem_lab.rivals.samples import ORIGIN, read_samples
from polydem_lab.rivals.scene import VX, VY, Scene, X, Y, box, floor
from polydem_lab.rivals.study import Plan, Study
from polydem_post.base.result_file import ResultError
from polydem_post.command_line import main as command_line

PROGRAM = Path(os.environ["POLYDEM_PROGRAM"])

#: A worker that knows free flight only, and ends without an answer, or never, if the knobs say so
FLIGHT = """
import time
from worker import serve

def build(scene, dt, knobs):
    if knobs.get("fail"):
        raise ValueError("no such knob")
    if knobs.get("wait"):
        time.sleep(600)
    print("a library says something")
    time_of, steps = [0.0], range(20000)

    def step(count):
        time_of[0] += count * dt
        sum(steps)

    def states():
        t, (ax, ay) = time_of[0], scene["gravity"]
        return [(b["x"] + b["vx"] * t + ax * t * t / 2, b["y"] + b["vy"] * t + ay * t * t / 2, b["angle"],
                 b["vx"] + ax * t, b["vy"] + ay * t, b["spin"]) for b in scene["bodies"]]

    return step, states

serve(build)
"""


@pytest.fixture
def places(tmp_path):
    """Places with a Python that cannot install anything."""
    (tmp_path / "scratch").mkdir()
    found = Places(tmp_path / "environment", tmp_path / "scratch", PROGRAM)
    executable(found.python, "#!/bin/sh\necho 'no package index' >&2\nexit 1\n")
    return found


@pytest.fixture
def alone(monkeypatch, tmp_path):
    """A machine without the other codes: its cargo reaches no crates, and nothing of Debian is installed."""
    executable(tmp_path / "bin" / "cargo", "#!/bin/sh\necho 'error: no crates' >&2\nexit 101\n")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.setattr(siconos, "PYTHON", "/no/python3")


def executable(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


def short(name, first, last, **changes):
    """A problem with few stiffnesses."""
    return replace(PROBLEMS[name], stiffness=(first, last), finer_steps=False, **changes)


def test_the_program_accepts_every_problem(places):
    code = polydem.find(places)
    assert code.version.startswith("polydem ")
    for problem in PROBLEMS.values():
        scene = problem.scene(0.9 if isinstance(problem, Threshold) else problem.seeds[0])
        for series in polydem.series(problem)[:1], polydem.series_of_law(problem, "area")[-1:]:
            code.run.check(scene, series[0].knobs[max(series[0].knobs)])
    with pytest.raises(ResultError, match=r"polydem refuses this: .*unheard_of"):
        code.run.check(PROBLEMS["slide"].scene(1), {"stiffness": 1e9, "law": "unheard_of"})


def test_defaults_of_the_program_are_not_named(places):
    scene = PROBLEMS["slide"].scene(1)
    text = polydem.namelist(scene, {"stiffness": 1e9}, places.scratch, places.scratch)
    for entry in ("law", "damping", "restitution", "safety_factor", "dt", "scheme"):
        assert f" {entry} =" not in text
    impact = polydem.namelist(PROBLEMS["headon_half"].scene(1), {"stiffness": 1e9}, places.scratch, places.scratch)
    assert "restitution = 0.5" in impact
    assert "friction = 'none'" in impact


def test_states_of_the_program_are_those_of_free_flight(places):
    turning = box(1.0, 2.0, x=1.0, y=3.0, angle=0.3, vx=2.0, vy=-1.0, spin=0.5)
    bodies = (turning, box(1.0, 1.0, x=-5.0, y=9.0), floor(4.0))
    scene = Scene(bodies, 0.2, 4, friction=0.3)
    found = polydem.find(places).run(scene, {"stiffness": 1e8}, 0.0, 60.0)
    assert found.states.shape == (5, 3, 6)
    assert found.states[0, 0] == pytest.approx([1.0, 3.0, 0.3, 2.0, -1.0, 0.5])
    fallen = 0.5 * 9.81 * 0.2**2
    assert found.states[-1, 0] == pytest.approx([1.4, 2.8 - fallen, 0.4, 2.0, -1.0 - 9.81 * 0.2, 0.5])
    assert found.states[-1, 1, Y] == pytest.approx(9.0 - fallen)
    assert found.steps >= 4
    assert found.seconds[0] > 0.0


def test_times_of_short_runs_are_measured_again_and_without_the_start(places):
    problem = PROBLEMS["headon_half"]
    found = measure(polydem.find(places).run, problem, {"stiffness": 1e8}, 1, 60.0)
    assert 1 <= len(found.seconds) <= polydem.REPETITIONS
    assert found.error < 0.05
    assert min(found.seconds) >= polydem.FASTEST * found.steps * 0.999


def test_a_program_that_stops_is_told(places):
    with pytest.raises(RunError, match="unheard_of"):
        polydem.find(places).run(PROBLEMS["slide"].scene(1), {"stiffness": 1e9, "law": "unheard_of"}, 0.0, 60.0)


def test_a_worker_answers_dies_and_answers_again(places):
    script = places.scratch / "flight.py"
    script.write_text(FLIGHT, encoding="utf-8")
    worker = Worker(["env", f"PYTHONPATH={WORKERS}", sys.executable, script], places.scratch, "flight")
    scene = Scene((box(1.0, 1.0, y=5.0, vx=1.0), floor(3.0)), 1.0, 4, (0.0, -2.0))
    found = worker(scene, {"dt": 0.01}, 1e-3, 60.0)
    assert found.steps == 100
    assert found.states[:, 0, X] == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    assert found.states[-1, 0, VX : VY + 1] == pytest.approx([1.0, -2.0])
    assert sum(found.seconds) >= 1e-3
    assert len(found.seconds) <= 20
    with pytest.raises(RunError, match="ended without an answer: ValueError: no such knob"):
        worker(scene, {"dt": 0.01, "fail": 1}, 0.0, 60.0)
    with pytest.raises(RunError, match="given up after 1 s"):
        worker(scene, {"dt": 0.01, "wait": 1}, 0.0, 1.0)
    assert worker(scene, {"dt": 0.5}, 0.0, 60.0).steps == 4
    worker.end()


def test_angles_of_workers_have_no_jumps(monkeypatch):
    monkeypatch.syspath_prepend(str(WORKERS))
    from worker import Turns, area_and_inertia

    turns, angles = Turns([3.0]), np.arange(3.0, 12.0, 0.5)
    wrapped = np.mod(angles + np.pi, 2.0 * np.pi) - np.pi
    assert [turns.follow([each])[0] for each in wrapped] == pytest.approx(angles)
    assert area_and_inertia(box(2.0, 1.0).vertices) == pytest.approx((2.0, 2.0 * 5.0 / 12.0))


def test_what_cannot_be_installed_is_missing_with_its_reason(places, alone, monkeypatch):
    for word, reason in (("box2d", "python failed: no package index"), ("chipmunk", "python failed: no package index"),
                         ("rapier", "cargo failed: error: no crates"), ("yade", "it needs the Debian package yade"),
                         ("siconos", "it needs the Debian packages siconos python3-siconos")):
        with pytest.raises(Missing, match=reason):
            CODES[word].find(places)
    monkeypatch.setenv("PATH", "")
    with pytest.raises(Missing, match="cargo cannot be called"):
        rapier.find(places)


def test_what_is_installed_is_not_installed_again(places, monkeypatch, tmp_path):
    log = tmp_path / "calls"
    version = chipmunk.PACKAGE.partition("==")[2]
    executable(places.python, f'#!/bin/sh\necho "$@" >> {log}\n[ "$2" != pip ] || exit 1\necho {version}\n')
    assert insist_on_package(places.python, chipmunk.PACKAGE, "pymunk") == f"pymunk {version}"
    assert "pip" not in log.read_text(encoding="utf-8")
    assert chipmunk.find(places).version == f"pymunk {version}"
    executable(places.python, f'#!/bin/sh\necho "$@" >> {log}\n[ "$2" != pip ] || {{ touch {log}2; exit 0; }}\n'
               f'[ -e {log}2 ] && echo {version}\n')
    assert insist_on_package(places.python, chipmunk.PACKAGE, "pymunk") == f"pymunk {version}"
    executable(tmp_path / "bin" / "cargo", "#!/bin/sh\nexit 0\n")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    program, told = insist_on_crate(places.environment, "rapier_worker", "rapier2d-f64")
    assert program == places.environment / "rapier" / "release" / "rapier_worker"
    assert told.startswith("rapier2d-f64 0.")


@pytest.fixture
def plan(monkeypatch):
    """A small plan, whose points are measured once in a row."""
    monkeypatch.setattr(polydem, "REPETITIONS", 1)
    monkeypatch.setattr(polydem, "STARTS", 1)
    return Plan([short("headon_half", 8, 9), short("topple", 8, 8)], ["area"], [], repeats=2)


@pytest.mark.usefixtures("alone")
def test_a_study_lists_what_is_missing_and_goes_on_without_it(places, plan, tmp_path):
    said = []
    study = Study(tmp_path / "study", plan, PROGRAM, places.environment, said.append)
    assert set(study.missing) == set(RIVALS)
    study.measure()
    assert sum(line.startswith("missing: ") for line in said) == len(RIVALS)
    assert "Rapier: missing, cargo failed" in (tmp_path / "study" / ORIGIN).read_text(encoding="utf-8")
    found = read_comparison(tmp_path / "study")
    assert found.columns == ["polydem", "polydem, area"]
    errors = {(point.problem, point.series, point.level): point.error for point in found.points}
    assert max(errors["headon_half", "polydem", level] for level in (8, 9)) < 0.05
    assert 0.0 < errors["topple", "polydem", 8] < 1.0
    assert {point.repeats for point in found.points} == {2}
    page = write_rivals_report(tmp_path / "study", figures=False)[-1].read_text(encoding="utf-8")
    assert "| Yade | everywhere | it needs the Debian package yade |" in page
    assert not (tmp_path / "study" / "runs").exists()


def without_all(plan):
    return replace(plan, without=RIVALS, laws=[], repeats=1)


def test_an_interrupted_study_goes_on_where_it_was(places, plan, tmp_path, monkeypatch):
    folder, plan = tmp_path / "study", without_all(plan)
    Study(folder, plan, PROGRAM, places.environment, lambda line: None).measure()
    path = folder / "points.csv"
    whole = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(whole[:-1]) + whole[-1][:20], encoding="utf-8")
    calls = []
    monkeypatch.setattr(rivals_study, "measure", lambda *words: calls.append(words) or measure(*words))
    Study(folder, plan, PROGRAM, places.environment, lambda line: None).measure()
    assert len(calls) == 1
    assert len(read_samples(folder)) == len(whole) - 1
    Study(folder, plan, PROGRAM, places.environment, lambda line: None).measure()
    assert len(calls) == 1


def test_what_would_take_too_long_is_left_out(places, plan, tmp_path, monkeypatch):
    monkeypatch.setattr(rivals_study, "LIMIT", 1e-9)
    plan = replace(without_all(plan), problems=[short("headon_half", 8, 10)])
    Study(tmp_path / "study", plan, PROGRAM, places.environment, lambda line: None).measure()
    assert [sample.level for sample in read_samples(tmp_path / "study")] == [8]


def test_a_failed_point_is_kept_and_not_tried_again(places, plan, tmp_path, monkeypatch):
    def stop(*_):
        raise RunError("a guard stopped it")

    monkeypatch.setattr(rivals_study, "measure", stop)
    plan = replace(without_all(plan), problems=[short("headon_half", 8, 9)], repeats=3)
    study = Study(tmp_path / "study", plan, PROGRAM, places.environment, lambda line: None)
    study.measure()
    kept = read_samples(tmp_path / "study")
    assert [(sample.level, sample.status, sample.message) for sample in kept] == [
        (level, "failed", "a guard stopped it") for level in (8, 9)]
    with pytest.raises(ResultError, match="there are no points"):
        read_comparison(tmp_path / "study")


def test_a_short_study_has_fewer_levels_and_seeds():
    plan = Plan([PROBLEMS["gas"]], [], [], quick=True)
    assert plan.seeds(PROBLEMS["gas"]) == (1,)
    for series in polydem.series(PROBLEMS["gas"]):
        assert plan.levels(series) == sorted(series.knobs)[::2]
    assert len(replace(plan, quick=False).seeds(PROBLEMS["gas"])) == 5
    assert plan.series("yade", PROBLEMS["gas"]) == []
    assert not PROBLEMS["hopper"].quick
    assert not PROBLEMS["dense"].quick


@pytest.mark.parametrize("words, said", [
    (["marbles"], "there is no problem marbles; there are slide, creep"),
    (["--without", "havok"], "there is no other code havok; there are box2d"),
    (["slide"], "--program double=PATH is missing"),
    (["slide", "--law", "unheard_of"], "unheard_of"),
    (["--report-only"], "there is no such file"),
])
def test_bad_options_end_with_a_sentence(tmp_path, capfd, words, said):
    program = ["--program", f"double={PROGRAM}"] if "--law" in words else []
    places = ["--output", str(tmp_path / "study"), "--environment", str(tmp_path / "environment")]
    without = [] if "--without" in words else ["--without", ",".join(RIVALS)]
    assert command_line.main(["rivals", *words, *without, *places, *program]) == command_line.INPUT_ERROR
    assert said in capfd.readouterr().err


def test_the_verb_measures_writes_and_publishes(tmp_path, capfd):
    words = ["rivals", "corner_slip", "--quick", "--repeats", "1", "--without", ",".join(RIVALS), "--output",
             str(tmp_path / "study"), "--environment", str(tmp_path / "environment"), "--program", f"double={PROGRAM}"]
    assert command_line.main([*words, "--publish", str(tmp_path / "page")]) == 0
    said = capfd.readouterr().out.splitlines()
    assert said[-1] == str(tmp_path / "page" / "tables.md")
    assert (tmp_path / "page" / "rivals_profile.png").exists()
    assert (tmp_path / "study" / "report" / "figures" / "rivals_corner_slip.png").exists()
    samples = read_samples(tmp_path / "study")
    assert [(sample.series, sample.level) for sample in samples] == [("polydem", 7), ("polydem", 9), ("polydem", 11)]
    assert samples[2].error < samples[1].error < samples[0].error
    assert yade.NAME in (tmp_path / "study" / ORIGIN).read_text(encoding="utf-8")
