"""The Python interface of a trajectory, on a finished run of the program: a heap of 60 grains with contacts."""

import copy
import inspect
import os
import re
import subprocess
import sys
from functools import cached_property

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from polydem_post import Contacts, Frame, NoFrame, ResultError, Trajectory, Walls
from polydem_post.base.columns import columns_of, field_names
from polydem_post.read.settings import Settings

PROGRAM = os.environ["POLYDEM_PROGRAM"]
HEAP = """&scene
   name = 'heap'
   bodies = 60
   {scene}
/
&forces
   friction_coefficient = 0.5
/
&integrate
   duration = {duration}
/
&output
   frame_interval = 0.05
   frames_per_segment = 4
   contacts = .true.
/
"""


def make_run(folder, scene="", duration=0.4):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "heap.nml").write_text(HEAP.format(scene=scene, duration=duration))
    subprocess.run([PROGRAM, "run", "heap.nml"], cwd=folder, check=True, capture_output=True)
    return folder / "results" / "heap"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return make_run(tmp_path_factory.mktemp("api"))


@pytest.fixture(scope="module")
def run(folder):
    return Trajectory(folder)


def test_a_trajectory_is_a_sequence(run):
    frames = list(run)
    assert len(frames) == len(run) == len(run.times) >= 9
    assert [frame.number for frame in frames] == list(range(len(run)))
    assert_array_equal([frame.time for frame in frames], run.times)
    for number in (0, 3, 4, -1, -len(run)):
        assert run[number].step == frames[number].step == run.frame(number).step
        assert_array_equal(run[number].position, frames[number].position)


def test_a_slice_is_a_trajectory(run):
    some = run[1:8:3]
    assert isinstance(some, Trajectory)
    assert [frame.number for frame in some] == [1, 4, 7]
    assert_array_equal(some.times, run.times[1:8:3])
    assert some[-1].step == run[7].step and len(some[1].contacts) == len(run[4].contacts)
    assert_array_equal(some.energy_balance["kinetic"], run.energy_balance["kinetic"][1:8:3])
    assert [frame.number for frame in run[::-1]] == list(range(len(run)))[::-1]
    late = run.times > 0.3
    assert [frame.number for frame in run[late]] == list(np.flatnonzero(late))
    assert [frame.number for frame in some[[0, -1]]] == [1, 7]
    assert len(run[99:]) == 0 and list(run[99:]) == []
    assert run[2:][1:].at(0.0 + run.times[3]).number == 3


def test_a_frame_that_is_not_there_is_an_index_error(run):
    for number in (len(run), -len(run) - 1):
        with pytest.raises(IndexError, match=f"there is no frame {number}, only {len(run)} frames"):
            run[number]
    with pytest.raises(NoFrame, match=f"there is no frame 99, only {len(run)} frames"):
        run[[0, 99]]


def test_at_takes_the_nearest_frame(run):
    assert run.at(run.times[3]).number == 3
    assert run.at(0.7 * run.times[3] + 0.3 * run.times[4]).number == 3
    assert run.at(0.3 * run.times[3] + 0.7 * run.times[4]).number == 4
    assert run.at(-0.01).number == 0
    with pytest.raises(NoFrame, match="there is no frame near 7 s, but from 0 to 0.4 s"):
        run.at(7.0)


def test_a_repr_says_what_there_is(run):
    assert repr(run) == (f"<Trajectory {run.folder}: {len(run)} frames, 0 to 0.4 s, {len(run[0])} bodies (60 free), "
                         "with contacts, finished>")
    assert repr(run[0]) == f"<Frame 0: t = 0 s, step 0, {len(run[0])} bodies (60 free)>"
    assert repr(run[-1].contacts).startswith(f"<Contacts: {len(run[-1].contacts)} pairs, greatest force ")


def test_settings_are_those_of_the_namelist(run):
    assert run.settings.forces.friction_coefficient == 0.5
    assert run.settings["scene"]["bodies"] == 60 and run.settings.scene.name == "heap"
    assert run.settings.output.contacts is True
    assert run.settings.forces.gravity == [0.0, -9.81]
    assert "friction_coefficient" in dir(run.settings.forces)
    with pytest.raises(AttributeError, match="&forces has no entry stifness; it has gravity, stiffness"):
        _ = run.settings.forces.stifness
    with pytest.raises(AttributeError, match="there is no group &force; there are &scene"):
        _ = run.settings.force


def test_groups_with_names_are_found_by_them():
    text = ("&scene\n   name = 'bed'\n/\n&motion\n   name = 'turn'\n   rate = 0.25\n/\n"
            "&motion\n   name = 'shake'\n   amplitude = 0.0, 0.001\n/")
    settings = Settings(text)
    assert settings.scene.name == "bed" and list(settings) == ["scene", "motion"]
    assert settings.motion.turn.rate == 0.25 and settings["motion"]["shake"]["amplitude"] == [0.0, 0.001]
    assert list(settings.motion) == ["turn", "shake"] and len(settings.motion) == 2
    assert repr(settings) == text and Settings(repr(settings)) == settings
    with pytest.raises(AttributeError, match="there is no &motion turnn; there are turn, shake"):
        _ = settings.motion.turnn


def test_settings_print_as_a_namelist_that_reads_the_same(run):
    assert run.settings == Settings(repr(run.settings))
    assert Settings("&a\n   b = 'it''s, so'\n   c = 1, 2\n/")["a"]["b"] == "it's, so"
    with pytest.raises(ResultError, match="line 2 of the stored input is not an entry"):
        Settings("&a\n   what\n/")


def test_masses_follow_from_density_and_polygon(run):
    frame = run[-1]
    free, fixed = frame.free, frame.fixed
    assert_allclose(frame.mass[free], 2500.0 * frame.area[free], rtol=1e-12)
    assert_allclose(frame.density[free], 2500.0, rtol=1e-12)
    expected = Frame.from_polygons([frame.vertices[k] for k in np.flatnonzero(free)], density=2500.0)
    assert_allclose(frame.inertia[free], expected.inertia, rtol=1e-9)
    assert np.isinf(frame.mass[fixed]).all() and np.isinf(frame.inertia[fixed]).all()
    assert set(frame.material) == {0}


def test_shapes_of_a_rectangle():
    frame = Frame.from_polygons([[(1, 1), (5, 1), (5, 3), (1, 3)]], density=3.0)
    assert_allclose(frame.position, [[3, 2]])
    assert_allclose([frame.area[0], frame.mass[0], frame.inertia[0]], [8.0, 24.0, 24.0 * (16 + 4) / 12])
    assert_allclose([frame.radius[0], frame.thickness[0], frame.diameter[0]], [5**0.5, 2.0, 20**0.5])
    assert_allclose(frame.equivalent_diameter, [(32 / np.pi) ** 0.5])
    assert_allclose(frame.bounds, [[1, 1, 5, 3]])
    assert frame.corners[0] == 4


def test_diameters_are_those_of_the_program(run):
    words = next(line for line in (run.folder / "log.txt").read_text().splitlines() if line.startswith("sizes"))
    found = [float(word) for word in re.findall(r"\d\.\d+E[+-]\d+", words)]
    diameter = run[-1].diameter[run[-1].free]
    # The program takes the lower one of two medians.
    expected = [diameter.min(), diameter.max(), np.sort(diameter)[(len(diameter) + 1) // 2 - 1]]
    assert_allclose(found, expected, rtol=0.005)  # the log has three digits
    assert (diameter > 1.02 * run[-1].equivalent_diameter[run[-1].free]).all()


def test_kinetic_energies_sum_to_the_balance(run):
    for number in (1, -1):
        assert_allclose(run[number].kinetic_energy.sum(), run.energy_balance["kinetic"][number], rtol=1e-12)


def test_contacts_have_indices_and_parts(run):
    frame = run[-1]
    contacts = frame.contacts
    assert len(contacts) > 10
    assert_array_equal(frame.id[contacts.first_index], contacts.first)
    assert_array_equal(frame.index_of(contacts.second), contacts.second_index)
    assert_allclose(contacts.normal_vector + contacts.tangential_vector, contacts.force,
                    atol=1e-12 * contacts.force_magnitude.max())
    assert_allclose(np.sum(contacts.normal**2, axis=1), 1.0)
    # Repulsion, within the Coulomb limit; the normal is the direction in which the first body faces the second.
    assert (contacts.normal_force >= 0.0).all()
    assert (np.abs(contacts.tangential_force) <= 0.5 * contacts.normal_force * (1 + 1e-9) + 1e-12).all()
    both = ~contacts.with_fixed
    assert (np.sum(contacts.normal * contacts.branch, axis=1)[both] < 0.0).all()
    assert_allclose(contacts.first_arm - contacts.second_arm, -contacts.branch, atol=1e-15)
    assert (contacts.depth < 0.1 * frame.thickness[frame.free].min()).all()
    assert_allclose(contacts.area_gradient, contacts.length[:, None] * contacts.normal)
    assert_array_equal(run.contacts(-1).force, contacts.force)


def test_forces_of_bodies_are_the_sums_over_contacts(run):
    frame = run[-1]
    k = int(np.argmax(frame.coordination * frame.free))
    own = np.zeros(2)
    for first, second, force in zip(frame.contacts.first_index, frame.contacts.second_index, frame.contacts.force):
        own += force * (first == k) - force * (second == k)
    assert frame.coordination[k] >= 3
    assert_allclose(frame.force[k], own, rtol=1e-9, atol=1e-9)
    # What the stored walls feel is what the contacts with them say.
    total = np.zeros((len(frame), 2))
    np.add.at(total, frame.contacts.first_index, frame.contacts.force)
    np.subtract.at(total, frame.contacts.second_index, frame.contacts.force)
    assert_allclose(frame.walls.force, total[frame.index_of(frame.walls.id)], rtol=1e-9, atol=1e-9)
    assert_array_equal(frame.force[frame.fixed], frame.walls.force)


def test_flags_say_which_walls_move(run, tmp_path):
    assert not run[0].driven.any() and (run[0].static == run[0].fixed).all()
    motion = "/\n&motion name = '{}' kind = 'translation' velocity = 0.0, 0.01 bodies = {}"
    moved = make_run(tmp_path, motion.format("a", 61), 0.05)
    frame = Trajectory(moved)[-1]
    assert list(frame.id[frame.driven]) == [61]
    assert_array_equal(frame.static, frame.fixed & (frame.id != 61))
    assert frame.speed[frame.driven] == pytest.approx(0.01)
    two = make_run(tmp_path / "two", motion.format("a", 63) + motion.format("b", "61, 63"), 0.05)
    frame = Trajectory(two)[-1]
    assert list(frame.id[frame.driven]) == [61, 63]
    assert list(frame.speed[frame.driven]) == pytest.approx([0.01, 0.02])
    every = make_run(tmp_path / "every", motion.format("a", 61).replace("bodies", "start = 9 bodies")
                     + "/\n&motion name = 'b' kind = 'translation' velocity = 0.0, 0.0", 0.05)
    assert_array_equal(Trajectory(every)[-1].driven, Trajectory(every)[-1].fixed)


def test_an_earlier_result_does_not_say_which_walls_move(run):
    earlier = copy.copy(run)
    earlier.settings = Settings("&scene\n   name = 'heap'\n   motion = 'none'\n/")
    assert not earlier[0].driven.any()
    earlier.settings = Settings("&scene\n   name = 'heap'\n   motion = 'translation'\n/")
    with pytest.raises(ResultError, match="is of an earlier revision: `motion` in its &scene is a group &motion today"):
        _ = earlier[0].driven


#: Three grains, and walls of three, two and one bodies; a motion follows
PARTS = """
&grains name = 'sample' region = 'box' low = 0.2, 0.2 high = 0.3, 0.3 number = 3 /
&wall name = 'hill' outline = 'polyline' vertices = 0, 0, 0.1, 0, 0.2, 0.1, 0.5, 0.1 thickness = 0.01 /
&wall name = 'cup' outline = 'polyline' closed = .true. vertices = 1, 0, 2, 0, 1, 1 thickness = 0.01 /
&wall name = 'plate' outline = 'rectangle' low = 0, -1 high = 1, -0.9 /
&integrate duration = 1e-3 /
&output folder = 'result' /
&motion name = 'a' kind = 'translation' velocity = 0, 0.01 wall = '{}' /
"""


@pytest.mark.parametrize("wall, identifiers", [("hill", [4, 5, 6]), ("cup", [7, 8, 9]), ("plate", [10])])
def test_flags_say_which_wall_of_parts_moves(wall, identifiers, tmp_path):
    (tmp_path / "parts.nml").write_text(PARTS.format(wall))
    subprocess.run([PROGRAM, "run", "parts.nml"], cwd=tmp_path, check=True, capture_output=True)
    frame = Trajectory(tmp_path / "result")[-1]
    assert list(frame.id[frame.driven]) == identifiers
    assert (frame.speed[frame.driven] > 0).all() and not (frame.speed[frame.static] > 0).any()


def test_series_stacks_a_column(run):
    positions = run.series("position")
    assert positions.shape == (len(run), len(run[0]), 2)
    assert_array_equal(positions[4], run[4].position)
    assert_array_equal(run.series("angle", [3, 5]), run.series("angle")[:, [3, 5]])
    with pytest.raises(ResultError, match="vertex is not one value per body"):
        run.series("vertex")


def test_tables_of_pandas(run):
    pytest.importorskip("pandas")
    frame = run[-1]
    table = frame.to_pandas()
    assert_array_equal(table.index, frame.id)
    assert_array_equal(table["position_y"], frame.position[:, 1])
    assert_array_equal(frame.contacts.to_pandas()["normal_force"], frame.contacts.normal_force)
    whole = run[:6:2].to_pandas()
    assert whole.shape[0] == 3 * len(frame)
    assert_array_equal(whole.loc[run.times[2]]["angle"], run[2].angle)


def test_data_sets_of_xarray(run):
    pytest.importorskip("xarray")
    data = run.to_xarray()
    assert dict(data.sizes) == {"time": len(run), "id": len(run[0]), "axis": 2}
    assert_array_equal(data.position.sel(axis="y").isel(time=4), run[4].position[:, 1])
    assert data.velocity.attrs["units"] == "m/s"
    assert data.mass.dims == ("id",)
    assert_array_equal(data.kinetic, run.energy_balance["kinetic"])


@pytest.mark.parametrize("call", ["to_pandas", "to_xarray"])
def test_no_frames_make_no_table(run, call):
    pytest.importorskip(call.removeprefix("to_"))
    with pytest.raises(ResultError, match="there are no frames"):
        getattr(run[:0], call)()


@pytest.mark.parametrize("package, call", [("pandas", "run[0].to_pandas()"), ("xarray", "run.to_xarray()"),
                                           ("pandas", "run.to_pandas()"), ("pandas", "run[0].contacts.to_pandas()")])
def test_a_missing_package_is_named(run, monkeypatch, package, call):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ResultError, match=rf"the package {package}: install it with \S+ -m pip install {package}, or"):
        eval(call, {"run": run})


@pytest.mark.parametrize("kind", [Frame, Contacts, Walls])
def test_help_shows_every_field_with_its_unit(kind):
    columns = columns_of(kind)
    assert set(field_names(kind)) <= set(columns)
    text = inspect.getdoc(kind)
    for name, column in columns.items():
        assert column.unit and column.meaning, name
        assert name in text or f"[{column.unit}]" in inspect.getdoc(inspect.getattr_static(kind, name))


@pytest.mark.parametrize("kind", [Trajectory, Frame, Contacts, Walls, Settings])
def test_help_explains_every_member(kind):
    for name, entry in vars(kind).items():
        public = not name.startswith("_") or name in ("__len__", "__getitem__", "__iter__")
        if public and (callable(entry) or isinstance(entry, (property, cached_property, classmethod))):
            text = inspect.getdoc(entry)
            assert text, f"{kind.__name__}.{name} has no help"
            getter = getattr(entry, "fget", None) or getattr(entry, "func", None)
            kept = str(getter.__annotations__.get("return", "")) if getter else ""
            if kept.endswith("Array") or kept.startswith("npt.NDArray"):
                assert re.search(r"\[[^]]+\]", text) and re.search(r"\((n|nv|m|w|frames)[,)]| \(n \+ 1\)", text), (
                    f"{kind.__name__}.{name}: unit or shape is missing: {text}")
    for column in columns_of(kind).values():
        if kind in (Contacts, Walls) or (kind is Frame and column.name not in ("step", "time", "number")):
            assert re.search(r"\((n|nv|m|w)( \+ 1)?(, \d)?\)|vectors|list of", column.meaning), column


def test_reprs_are_one_line(run):
    for entry in (run, run[-1], run[-1].contacts, run[-1].walls, run[:0]):
        text = repr(entry)
        assert re.match(f"<{type(entry).__name__}[ :]", text)
        assert len(text.splitlines()) == 1
    assert "greatest force" in repr(run[-1].walls) and len(run[-1].walls) == run[-1].fixed.sum()


def test_frames_made_of_polygons_take_contacts():
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    frame = Frame.from_polygons([square, square + np.array([1, 0])])
    frame = frame.with_contacts([1], [2], [[-3.0, 2.0]], [[1.0, 0.5]])
    contacts = frame.contacts
    assert_allclose([contacts.normal_force[0], contacts.tangential_force[0]], [3.0, 2.0])
    assert_allclose(frame.force, [[-3, 2], [3, -2]])
    assert_array_equal(frame.coordination, [1, 1])
    with pytest.raises(ResultError, match="made without contacts"):
        _ = Frame.from_polygons([square]).contacts
    with pytest.raises(ResultError, match="unknown bodies are named"):
        frame.with_contacts([1], [3], [[0, 0]], [[0, 0]])
