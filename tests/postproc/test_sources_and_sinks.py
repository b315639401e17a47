"""Results of runs in which bodies enter and leave: frames, departures, masses, pictures, exports, a start from them."""

import os
import re
import shutil
import subprocess
from fractions import Fraction

import h5py
import numpy as np
import pytest
from polydem_post import Trajectory
from polydem_post.export.exporting import export_result
from polydem_post.pictures.drawing import Look
from polydem_post.pictures.movie import make_movie
from polydem_post.pictures.plot import plot_frames, save
from polydem_post.pictures.view import write_view

SCENE = """\
&wall name = 'left' outline = 'line' from = -0.05, 0.2 to = -0.02, 0 thickness = 0.01 /
&wall name = 'right' outline = 'line' from = 0.02, 0 to = 0.05, 0.2 thickness = 0.01 /
&source name = 'feed' low = -0.03, 0.1 high = 0.03, 0.2 count = 40 velocity = 0, -1 interval = 50 /
&sink name = 'bin' low = -0.1, -0.1 high = 0.1, -0.02 interval = 100 /
&forces gravity = 0, -40 stiffness = 2e5 /
&integrate dt = 5e-5 duration = 0.3 /
&output frame_interval = 3e-3 contacts = .true. frames_per_segment = 30 series_interval = 0.01 folder = '{folder}' /
"""


def run(namelist, *options, code=0):
    done = subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", namelist, *options], check=False, capture_output=True,
                          text=True)
    assert done.returncode == code, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sources_and_sinks")
    (folder / "scene.nml").write_text(SCENE.format(folder=folder / "result"), encoding="utf-8")
    run(folder / "scene.nml")
    return folder / "result"


def test_every_frame_has_its_own_bodies(result):
    trajectory = Trajectory(result)
    numbers = [len(frame) for frame in trajectory]
    assert numbers[0] == 2 and max(numbers) == 42
    assert len(trajectory._files.segments) == 4
    last = trajectory[-1]
    assert last.id[2] > 60 and np.all(last.fixed[:2]) and not last.fixed[2:].any()
    assert max(len(frame.contacts.first) for frame in trajectory) > 10 and last.walls.id.tolist() == [1, 2]
    assert np.array_equal(last.driven, np.zeros(len(last), dtype=bool))
    path = {}
    for frame in trajectory:
        for key, place, mass in zip(frame.id, frame.position, frame.mass):
            if key in path:
                assert np.hypot(*(place - path[key][0])) < 0.02 and mass == path[key][1]
            path[key] = (place, mass)


def test_mass_in_is_mass_out_and_mass_there_exactly(result):
    trajectory = Trajectory(result)
    masses = {}
    for frame in trajectory:
        masses.update(zip(frame.id[frame.free].tolist(), map(Fraction, frame.mass[frame.free].tolist())))
    departures = trajectory.departures
    assert len(departures["id"]) > 20 and np.all(np.diff(departures["step"]) >= 0)
    assert len(set(departures["id"])) == len(departures["id"])
    left = {key: Fraction(mass) for key, mass in zip(departures["id"].tolist(), departures["mass"].tolist())}
    last = trajectory[-1]
    there = {key: masses[key] for key in last.id[last.free].tolist()}
    entered = {**masses, **left}
    assert sorted(entered) == list(range(3, 3 + len(entered)))
    assert not set(there) & set(left)
    assert sum(entered.values()) == sum(left.values()) + sum(there.values())
    series = trajectory.time_series
    assert series["feed.entered"][-1] == len(entered) and series["bin.departed"][-1] == len(left)
    assert series["bin.mass"][-1] == pytest.approx(float(sum(left.values())), rel=1e-14)
    assert np.all((departures["y"] >= -0.1) & (departures["y"] < -0.02)) and np.all(departures["velocity_y"] < 0.0)


def test_the_balance_has_what_enters_and_leaves(result):
    balance = Trajectory(result).energy_balance
    assert np.all(np.diff(balance["entered_energy"]) >= 0.0) and balance["entered_energy"][-1] > 0.0
    assert abs(balance["energy_residual"][-1]) < 1e-2 * balance["entered_energy"][-1]


def test_pictures_exports_and_the_viewer_show_the_bodies_of_each_frame(result, tmp_path):
    trajectory = Trajectory(result)
    make_movie(trajectory, [0, 30, 60, 90], tmp_path / "flow.gif", Look(show=("forces",)), size=(200, 160))
    save(plot_frames(trajectory, [0, 50, 100], Look(colour="speed")), tmp_path / "flow.png")
    write_view(trajectory, [0, 30, 60, 90], tmp_path / "flow.html")
    assert all((tmp_path / name).stat().st_size > 1000 for name in ("flow.gif", "flow.png", "flow.html"))
    table = trajectory[40:50].to_pandas()
    assert len(table) == sum(len(frame) for frame in trajectory[40:50])


def test_info_and_a_start_from_a_frame(result, tmp_path):
    info = subprocess.run([os.environ["POLYDEM_PROGRAM"], "info", result], check=True, capture_output=True, text=True)
    assert "frames          30 of 2 to 42 bodies" in info.stdout
    frame = Trajectory(result)[60]
    (tmp_path / "next.nml").write_text(
        f"&scene name = 'result' start_from = '{result}:60' /\n&forces gravity = 0, -40 stiffness = 2e5 /\n"
        f"&integrate dt = 5e-5 duration = 1e-3 /\n&output folder = '{tmp_path / 'next'}' /\n", encoding="utf-8")
    run(tmp_path / "next.nml")
    start = Trajectory(tmp_path / "next")[0]
    assert np.array_equal(start.id, frame.id)
    assert np.allclose(start.position, frame.position, rtol=0.0, atol=1e-12)
    assert np.array_equal(start.velocity, frame.velocity)


def test_pairs_of_convex_bodies_keep_their_history_when_concave_ones_follow(tmp_path):
    """Finds pairs taken for others: they name a piece by the greatest number of pieces of a body of the run."""
    walls = SCENE.split("&source")[0]
    rest = "&forces gravity = 0, -40 stiffness = 1e6 /\n&output frame_interval = 0.05 /\n"
    source = ("&source name = 'feed' low = -0.03, 0.15 high = 0.03, 0.2 count = 35 interval = 50 {} shape = 'cross' "
              "width = 0.012 arm = 4e-3 angle = 0, 360 /\n")
    floor = "&wall name = 'floor' outline = 'line' from = -0.05, 0 to = 0.05, 0 thickness = 0.01 /\n"
    settle, pour = "&stage name = 'settle' duration = 0.1 /\n", "&stage name = 'pour' duration = 0.05 /\n"
    grains = "&grains name = 'bed' region = 'box' low = -0.02, 0 high = 0.02, 0.12 number = 30 /\n"
    start = "&scene name = 'result' start_from = '{}' /\n" + rest
    step = "&integrate dt = 2e-5 {} /\n"
    for name, text in {"first": walls + floor + grains + rest + settle + step.format(""),
                       "whole": walls + floor + grains + rest + settle + pour + source.format("stage = 'pour'")
                       + step.format(""),
                       "next": start.format(tmp_path / "first") + source.format("") + step.format("duration = 0.05"),
                       "bare": start.format(f"{tmp_path / 'first'}:2") + source.format("")
                       + step.format("duration = 0.05")}.items():
        (tmp_path / f"{name}.nml").write_text(text, encoding="utf-8")
        run(tmp_path / f"{name}.nml", "--set", f"output.folder={tmp_path / name}")
    whole, following, bare = (Trajectory(tmp_path / name)[-1] for name in ("whole", "next", "bare"))
    assert np.array_equal(whole.id, following.id) and len(whole) == 38
    # Convex bodies in a run with concave ones differ by rounding from those in a run without.
    assert np.allclose(whole.position, following.position, rtol=0.0, atol=1e-11)
    assert np.abs(whole.position - bare.position).max() > 1e-8
    outline = whole.vertices[-1]
    assert len(outline) == 12 and np.allclose(whole.mass[-1], 2500 * 4e-3 * (2 * 0.012 - 4e-3))


def test_a_run_that_is_continued_has_each_departure_once(result, tmp_path):
    text = SCENE.format(folder=tmp_path / "result")
    (tmp_path / "scene.nml").write_text(text.replace("duration = 0.3", "duration = 0.2"), encoding="utf-8")
    run(tmp_path / "scene.nml")
    (tmp_path / "scene.nml").write_text(text, encoding="utf-8")
    run(tmp_path / "scene.nml", "--continue", "--set", "integrate.duration=0.3")
    one, other = Trajectory(result), Trajectory(tmp_path / "result")
    assert one.state_hash == other.state_hash
    for name, values in one.departures.items():
        assert np.array_equal(values, other.departures[name]), name


def test_a_changed_rate_holds_from_then_on(tmp_path):
    """Finds a source that makes up for the time before, or stops until the new rate has caught up."""
    text = (SCENE.format(folder=tmp_path / "result").replace("count = 40", "rate = 100")
            .replace("duration = 0.3", "duration = 0.4"))
    (tmp_path / "scene.nml").write_text(text, encoding="utf-8")
    told = run(tmp_path / "scene.nml", "--set", "integrate.duration=0.2")
    assert re.search(r"^source     feed: bodies of (\S+) kg/m on average, 1.00E\+02 per second", told, re.MULTILINE)
    assert "have entered from &source" not in told
    for rate, most in ((40, 28), (200, 60)):
        shutil.copytree(tmp_path / "result", tmp_path / f"at_{rate}")
        told = run(tmp_path / "scene.nml", "--continue", "--changed", "--set", f"source.feed.rate={rate}",
                   "--set", f"output.folder={tmp_path / f'at_{rate}'}")
        entered = Trajectory(tmp_path / f"at_{rate}").time_series["feed.entered"]
        assert entered[-1] - 20 == pytest.approx(rate * 0.2, abs=2) and entered[-1] <= most + 1


def test_a_source_without_room_is_told_at_the_end(tmp_path):
    text = SCENE.format(folder=tmp_path / "result").replace("count = 40", "rate = 1e5").replace("= 0.3", "= 0.02")
    (tmp_path / "scene.nml").write_text(text, encoding="utf-8")
    told = run(tmp_path / "scene.nml")
    assert re.search(r"warning: \d+ bodies have entered from &source feed, of 2000 that its rate asks for: they found "
                     r"no room \d+ times", told)
    told = run(tmp_path / "scene.nml", "--force", "--set", "source.feed.interval=5000")
    assert ("warning: 0 bodies have entered from &source feed, of 2000 that its rate asks for. They enter every 5000 "
            "steps") in told


def test_an_incomplete_frame_is_left_out(result, tmp_path):
    path = next(iter(sorted(result.glob("trajectory_*.h5"))))
    copy = tmp_path / f"{path.name}.open"
    copy.write_bytes(path.read_bytes())
    with h5py.File(copy, "r+") as file:
        file["frames/angle"].resize(file["frames/start"][12] + 1, axis=0)
    assert len(Trajectory(copy, check=False)) == 12


@pytest.mark.parametrize("form, end", [("csv", "csv"), ("vtkhdf", "vtkhdf"), ("vtp", "pvd"), ("xdmf", "xdmf")])
def test_exports_have_the_bodies_of_each_frame(result, tmp_path, form, end):
    trajectory = Trajectory(result)[::20]
    files = export_result(trajectory, form, tmp_path / f"flow.{end}")
    assert all(path.exists() for path in files)
    if form == "csv":
        rows = len((tmp_path / "flow.csv").read_text(encoding="utf-8").splitlines()) - 1
        assert rows == sum(len(frame) for frame in trajectory)


@pytest.mark.parametrize("last, count, code", [
    (715_827_880, 40, 2), (715_827_881, 40, 2), (2_147_483_646, 40, 2), (715_827_840, 40, 0), (1000, 0, 0),
    (715_827_870, 0, 1)])
def test_identifiers_of_pieces_fit_their_bits(last, count, code, tmp_path):
    """A source of crosses of three pieces beside squares with great identifiers: 3 (id + 1) must be less than 2^31."""
    with h5py.File(tmp_path / "bodies.h5", "w") as file:
        file["vertex"] = [(x + 0.01 * i, y + 0.01 * j) for x, y in ((-0.03, 0.05), (0.0, 0.05), (0.03, 0.05))
                          for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
        file["vertex_start"] = [0, 4, 8, 12]
        file["fixed"] = [1, 0, 0]
        file["id"] = [1, 2, last]
    rate = f"count = {count}" if count else "rate = 3000"
    (tmp_path / "scene.nml").write_text(
        f"&scene\n  bodies_file = '{tmp_path}/bodies.h5' /\n"
        f"&source name = 'feed' low = -0.03, 0.1 high = 0.03, 0.2 {rate}\n"
        "  interval = 50 shape = 'cross' width = 5e-3 arm = 2e-3 /\n&integrate dt = 5e-5 duration = 0.01 /\n",
        encoding="utf-8")
    done = subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", tmp_path / "scene.nml", "--set",
                           f"output.folder={tmp_path}/result"], check=False, capture_output=True, text=True)
    assert done.returncode == code, done
    if code == 2:
        assert re.search(rf"scene.nml:2: body {last}: with up to 3 pieces of a body and \d+ more bodies, identifiers "
                         r"must be at most \d+; number the bodies anew, from 1", done.stderr), done.stderr
    if code == 1:
        assert re.search(r"step \d+: there are no identifiers for \d+ more bodies behind \d+: 715827881 is the "
                         r"greatest, with up to 3 pieces of a body", done.stderr), done.stderr
    if code == 0:
        assert max(Trajectory(tmp_path / "result")[-1].id) > last
