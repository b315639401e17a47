"""Results of runs in a periodic cell: paths, contacts across the border, pictures with copies."""

import os
import subprocess

import numpy as np
import pytest
from matplotlib.figure import Figure
from polydem_post import Trajectory
from polydem_post.analysis import coarse_grain, lucy, solid_fraction, stress_tensor
from polydem_post.base.result_file import ResultError
from polydem_post.pictures.drawing import Look, draw_bodies, overlays, settle
from polydem_post.pictures.movie import make_movie

SCENE = """\
&cell periodic = 'xy' low = 0.01, 0 size = 0.06, 0.05 /
&grains name = 'sample' region = 'box' low = 0, 0 high = 0.06, 0.05 number = 12 speed = 3 spin = 100 /
&forces gravity = 0, 0 stiffness = 2e5 /
&integrate dt = 2e-5 duration = 0.06 /
&output frame_interval = 1e-3 contacts = .true. folder = '{folder}' /
"""


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cell")
    (folder / "cell.nml").write_text(SCENE.format(folder=folder / "result"), encoding="utf-8")
    subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", folder / "cell.nml"], check=True, stdout=subprocess.PIPE)
    return Trajectory(folder / "result")


def test_paths_are_smooth_where_positions_jump(trajectory):
    position, path = trajectory.series("position"), trajectory.series("unwrapped")
    assert np.abs(np.diff(position, axis=0)).max() > 0.04
    assert np.abs(np.diff(path, axis=0)).max() < 0.02
    assert np.abs(path).max() > 0.1
    assert trajectory[0].cell_low.tolist() == [0.01, 0.0] and trajectory[0].cell_size.tolist() == [0.06, 0.05]


def test_the_origin_moves_the_cell(trajectory):
    world = trajectory.in_world()
    world._shift = np.array([5.0, 7.0])
    assert world[0].cell_low.tolist() == [5.01, 7.0] and trajectory[0].cell_low.tolist() == [0.01, 0.0]


def test_contacts_across_the_border_have_short_arms(trajectory):
    crossing = 0
    for frame in trajectory:
        contacts = frame.contacts
        for index, arm in ((contacts.first_index, contacts.first_arm), (contacts.second_index, contacts.second_arm)):
            assert np.all(np.hypot(*arm.T) <= frame.radius[index] + 1e-12)
        apart = frame.position[contacts.first_index] - frame.position[contacts.second_index]
        crossing += np.count_nonzero(np.abs(apart - contacts.branch).max(axis=1) > 0.01)
    assert crossing > 10


def test_pictures_show_the_cell_with_copies_at_its_border(trajectory):
    look = settle(trajectory, [3], Look(colour="speed", show=("forces", "contacts")))
    assert look.limits == pytest.approx((0.01, 0.07, 0.0, 0.05))
    axis = Figure().add_subplot()
    _, grains = draw_bodies(axis, trajectory[3], look)
    assert len(grains.artists) == 9
    assert len(overlays(axis, trajectory[3], look)) == 18
    grains.move(trajectory[4], look)
    for artist in grains.artists:
        assert np.array_equal(artist.get_array(), trajectory[4].speed)
        assert np.array_equal(artist.get_paths()[0].vertices[:-1], trajectory[4].vertices[0])


def test_a_film_of_a_cell(trajectory, tmp_path):
    make_movie(trajectory, [0, 1, 2], tmp_path / "cell.gif", Look(show=("forces",)), size=(200, 160))
    assert (tmp_path / "cell.gif").stat().st_size > 1000


def test_paths_and_arms_in_a_sheared_cell(tmp_path):
    text = SCENE.replace("periodic = 'xy'", "periodic = 'xy' shear_rate = -30 profile = .true.")
    (tmp_path / "shear.nml").write_text(text.format(folder=tmp_path / "result"), encoding="utf-8")
    subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", tmp_path / "shear.nml"], check=True, stdout=subprocess.PIPE)
    run = Trajectory(tmp_path / "result")
    assert np.abs(np.diff(run.series("unwrapped"), axis=0)).max() < 0.02
    assert np.ptp(run.series("unwrapped")[-1, :, 0]) > 0.1
    assert len({frame.shift for frame in run}) > 10
    assert len(run[-1].shifts) == 10
    for frame in run:
        contacts = frame.contacts
        for index, arm in ((contacts.first_index, contacts.first_arm), (contacts.second_index, contacts.second_arm)):
            assert np.all(np.hypot(*arm.T) <= frame.radius[index] + 1e-12)


def windows_of(frame):
    """The cell, its left half and its right half."""
    (x, y), (width, height) = frame.cell_low, frame.cell_size
    return ((x, y, x + width, y + height), (x, y, x + width / 2, y + height),
            (x + width / 2, y, x + width, y + height))


def test_the_stress_of_the_cell_is_that_of_its_contacts(trajectory):
    tried = 0
    for frame in trajectory:
        whole, left, right = windows_of(frame)
        area = frame.cell_size.prod()
        stress = stress_tensor(frame, whole)
        contacts = frame.contacts
        expected = np.einsum("ci,cj->ij", contacts.force, contacts.branch) / area
        assert stress.contact == pytest.approx(expected, rel=1e-9, abs=1e-9)
        halves = [stress_tensor(frame, window) for window in (left, right)]
        assert 0.5 * (halves[0].contact + halves[1].contact) == pytest.approx(expected, rel=1e-9, abs=1e-9)
        relative = frame.velocity - frame.mass @ frame.velocity / frame.mass.sum()
        kinetic = np.einsum("b,bi,bj->ij", frame.mass, relative, relative) / area
        assert stress.kinetic == pytest.approx(kinetic, rel=1e-9)
        tried += len(contacts.force)
    assert tried > 50


def test_a_window_does_not_notice_where_the_border_is(trajectory):
    frame = trajectory[30]
    (x, y), (width, height) = frame.cell_low, frame.cell_size
    inside = stress_tensor(frame, (x + 0.2 * width, y, x + width, y + height))
    over = stress_tensor(frame, (x + 0.2 * width - width, y, x, y + height))
    assert inside.contact == pytest.approx(over.contact, abs=1e-9)
    with pytest.raises(ResultError, match="further out of the periodic cell"):
        stress_tensor(frame, (x, y, x + 2.5 * width, y + height))


def test_the_solid_fraction_of_the_cell_is_that_of_its_grains(trajectory):
    for frame in (trajectory[0], trajectory[30]):
        whole, left, right = windows_of(frame)
        expected = frame.area.sum() / frame.cell_size.prod()
        assert solid_fraction(frame, whole) == pytest.approx(expected, rel=1e-12)
        assert solid_fraction(frame, left) + solid_fraction(frame, right) == pytest.approx(2 * expected, rel=1e-12)


def test_fields_cover_the_cell_and_know_its_copies(trajectory):
    frame = trajectory[30]
    fields = coarse_grain(frame, lucy(0.01), 0.001)
    assert fields.density.shape == (50, 60)
    assert fields.density.sum() * fields.cell == pytest.approx(frame.mass.sum(), rel=1e-9)
    expected = np.einsum("ci,cj->ij", frame.contacts.force, frame.contacts.branch)
    assert fields.contact_stress.sum(axis=(0, 1)) * fields.cell == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_a_cell_that_obeys_a_stress_has_another_size_in_each_frame(tmp_path):
    """Finds frames with the size of the start: arms across the border would be as long as the cell."""
    scene = SCENE.replace("size = 0.06, 0.05", "size = 0.06, 0.05 obeys = 'xy' stress = 2e3, 1e3 mass = 0.05"
                          " damping_ratio = 1")
    scene = scene.replace("contacts =", "series_interval = 1e-3 contacts =").format(folder=tmp_path / "result")
    (tmp_path / "pressed.nml").write_text(scene, encoding="utf-8")
    subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", tmp_path / "pressed.nml"], check=True, stdout=subprocess.PIPE)
    run = Trajectory(tmp_path / "result")
    sizes = np.array([frame.cell_size for frame in run])
    series = run.time_series
    assert series["sample_width"] == pytest.approx(sizes[:, 0], rel=1e-12)
    assert series["sample_height"] == pytest.approx(sizes[:, 1], rel=1e-12)
    assert sizes[0].tolist() == [0.06, 0.05] and np.all(sizes[-1] < [0.059, 0.049])
    for frame in run:
        assert frame.cell_low + 0.5 * frame.cell_size == pytest.approx([0.04, 0.025])
        contacts = frame.contacts
        for index, arm in ((contacts.first_index, contacts.first_arm), (contacts.second_index, contacts.second_arm)):
            assert np.all(np.hypot(*arm.T) <= frame.radius[index] + 1e-12)
