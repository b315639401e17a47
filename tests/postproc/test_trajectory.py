"""Reading finished results. What is in them is said in tests/io/sample.f90."""

import shutil

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from polydem_post import ResultError, Trajectory
from test_manifest import rows_of, write_manifest


def test_joins_the_segments(finished):
    run = Trajectory(finished)
    assert len(run) == 7
    assert_array_equal(run.steps, np.arange(1, 8))
    assert_array_equal(run.times, 0.5 * np.arange(1, 8))


def test_reads_one_segment(finished):
    run = Trajectory(finished / "trajectory_0002.h5")
    assert_array_equal(run.steps, [4, 5, 6])
    assert run.frame(0).step == 4


@pytest.mark.parametrize("number", range(7))
def test_reads_every_frame(finished, number):
    frame = Trajectory(finished).frame(number)
    step = number + 1
    assert (frame.step, frame.time) == (step, 0.5 * step)
    assert_array_equal(frame.id, [10, 20, 30])
    assert_array_equal(frame.fixed, [True, False, False])
    assert_array_equal(frame.position, [[0, 0], [-step, 3], [step, 0.5]])
    assert_array_equal(frame.angle, np.array([1, 2, 3]) * step / 8)
    assert_array_equal(frame.velocity, [[1, -step], [2, -step], [3, -step]])
    assert_array_equal(frame.angular_velocity, np.array([1, 2, 3]) + step / 4)


def test_turns_the_vertices_into_the_world(finished):
    frame = Trajectory(finished).frame(4)
    assert [len(outline) for outline in frame.vertices] == [4, 3, 4]
    angle = 2 * 5 / 8
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    triangle = np.array([[-1.0, -1.0], [2.0, -1.0], [-1.0, 2.0]])
    assert_allclose(frame.vertices[1], triangle @ turn.T + [-5.0, 3.0], atol=1e-14)


def test_counts_frames_from_the_end(finished):
    run = Trajectory(finished)
    assert run.frame(-1).step == 7
    assert run.frame(-7).step == 1
    for number in (7, -8):
        with pytest.raises(ResultError, match="there is no frame .*, only 7 frames"):
            run.frame(number)


@pytest.mark.parametrize("number", range(7))
def test_reads_the_contacts_of_every_frame(finished, number):
    contacts = Trajectory(finished).contacts(number)
    step = number + 1
    assert len(contacts) == step % 3
    count = np.arange(1, len(contacts) + 1)
    assert_array_equal(contacts.first, np.full_like(count, 10))
    assert_array_equal(contacts.second, np.full_like(count, 30))
    assert_array_equal(contacts.area, step + count)
    assert_array_equal(contacts.point, np.column_stack([np.full(len(count), 0.25), count]))
    assert_array_equal(contacts.normal, np.tile([-1.0, 0.0], (len(count), 1)))
    assert_array_equal(contacts.length, np.full(len(count), 0.125))
    assert_array_equal(contacts.couple, np.zeros(len(count)))
    assert_array_equal(contacts.force, np.column_stack([count, np.full(len(count), -step)]))


def test_reads_walls_and_energy_balance(finished):
    run = Trajectory(finished)
    walls = run.walls(5)
    assert_array_equal(walls.id, [10])
    assert_array_equal(walls.force, [[6.0, 12.0]])
    assert_array_equal(walls.torque, [-6.0])
    assert sorted(run.energy_balance) == ["kinetic", "momentum_x"]
    assert_array_equal(run.energy_balance["kinetic"], 0.5 * np.arange(1, 8))
    assert_array_equal(run.energy_balance["momentum_x"], -np.arange(1, 8))


def test_reads_profile_counters_and_hash(finished):
    run = Trajectory(finished)
    assert run.profile["stage"][:2] == ["boxes", "neighbours"]
    assert_array_equal(run.profile["calls"][:3], [4, 2, 0])
    assert_array_equal(run.profile["total"][:3], [1.0, 0.5, 0.0])
    assert run.profile["seconds"] == 2.0
    assert run.counters == {"pairs": 5000000000, "contacts": 12}
    assert run.state_hash == "0123456789abcdef"
    assert run.status == "finished"


def test_reads_provenance(finished):
    for run in (Trajectory(finished), Trajectory(finished / "trajectory_0001.h5")):
        assert run.provenance["program"] == "polydem"
        assert run.provenance["input_text"] == "&scene\n/ ! ½"
        assert run.provenance["seed"] == 7
        assert "-ffp-contract=off" in run.provenance["options"]


def test_every_number_has_unit_and_meaning(finished):
    missing = []

    def look(name, entry):
        is_number = isinstance(entry, h5py.Dataset) and not name.startswith("provenance")
        if is_number and not (entry.attrs.get("unit") and entry.attrs.get("meaning")):
            missing.append(name)

    for path in finished.glob("*.h5"):
        with h5py.File(path, "r") as file:
            file.visititems(look)
    assert missing == []


def test_real_numbers_are_double(finished):
    with h5py.File(finished / "trajectory_0001.h5", "r") as file:
        assert file["frames/position"].dtype == np.float64
        assert file["bodies/vertex"].dtype == np.float64


def test_names_what_is_missing(tmp_path, finished):
    with pytest.raises(ResultError, match="there is no such file or folder"):
        Trajectory(tmp_path / "nowhere")
    with pytest.raises(ResultError, match=r"holds no result \(.*h5\)$"):
        Trajectory(tmp_path)
    with pytest.raises(ResultError, match=f"holds no result .*; did you mean {finished}\\?$"):
        Trajectory(finished.parent)
    text = tmp_path / "trajectory_0001.h5"
    text.write_text("not HDF5")
    with pytest.raises(ResultError, match="trajectory_0001.h5: cannot be read"):
        Trajectory(tmp_path)
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["x"] = 1
    with pytest.raises(ResultError, match="is not a file of polydem"):
        Trajectory(tmp_path / "other.h5")


@pytest.mark.parametrize("listed", [True, False])
def test_refuses_a_segment_of_an_earlier_layout(tmp_path, finished, listed):
    folder = tmp_path / "result"
    shutil.copytree(finished, folder)
    with h5py.File(folder / "trajectory_0002.h5", "r+") as file:
        file.attrs["schema_version"] = 7
    if listed:
        write_manifest(folder, rows_of(folder))
    with pytest.raises(ResultError, match="trajectory_0002.h5: has file layout 7 .* run its scene again"):
        Trajectory(folder)


def test_names_what_a_run_did_not_write(tmp_path, finished):
    with h5py.File(finished / "trajectory_0001.h5", "r") as source:
        with h5py.File(tmp_path / "trajectory_0001.h5", "w") as file:
            for name in ("bodies", "frames", "provenance"):
                source.copy(name, file)
            file.attrs["schema_version"] = source.attrs["schema_version"]
    run = Trajectory(tmp_path)
    assert len(run) == 3
    assert run.energy_balance == {}
    assert len(run.walls(0).id) == 0
    with pytest.raises(ResultError, match="holds no contacts"):
        run.contacts(0)
    with pytest.raises(ResultError, match="profile.h5: there is no such file"):
        _ = run.state_hash
