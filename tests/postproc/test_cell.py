"""Results of runs in a periodic cell: paths, contacts across the border, pictures with copies."""

import base64
import os
import subprocess
import zlib
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from polydem_post import Frame, Trajectory
from polydem_post.analysis import coarse_grain, lucy, solid_fraction, stress_tensor
from polydem_post.base.result_file import ResultError
from polydem_post.export.meshes import contact_mesh
from polydem_post.pictures.drawing import CellOutline, Look, SettledLook, cell_lines, draw_bodies, overlays, settle
from polydem_post.pictures.movie import make_movie
from polydem_post.pictures.view_data import _Contacts, pack_run

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
    margin = 0.02 * 0.06  # in which the border of the cell can be seen
    assert look.limits == pytest.approx((0.01 - margin, 0.07 + margin, -margin, 0.05 + margin))
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
    assert np.ptp(run.series("unwrapped")[-1, :, 0]) > 0.09
    assert len({frame.shift for frame in run}) > 10
    assert len(run[-1].shifts) == 10
    for frame in run:
        contacts = frame.contacts
        for index, arm in ((contacts.first_index, contacts.first_arm), (contacts.second_index, contacts.second_arm)):
            assert np.all(np.hypot(*arm.T) <= frame.radius[index] + 1e-12)


SHEARED = """\
&cell periodic = 'xy' low = -0.05, -0.05 size = 0.1, 0.1 shear_rate = 4 {more} /
&grains name = 'upper' region = 'at' at = 0.02, 0.046 shape = 'regular' corners = 6, 6 diameter = 0.02, 0.02 /
&grains name = 'middle' region = 'at' at = -0.02, 0.0 shape = 'regular' corners = 6, 6 diameter = 0.02, 0.02 /
&forces gravity = 0, 0 stiffness = 1e6 /
&integrate duration = {duration} /
&output frame_interval = 2e-4 folder = '{folder}' /
"""


def sheared(folder, more="profile = .true.", duration=1e-3):
    """A grain that reaches over the upper border of a sheared cell, and one in its middle."""
    text = SHEARED.format(folder=folder / "result", more=more, duration=duration)
    (folder / "sheared.nml").write_text(text, encoding="utf-8")
    subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", folder / "sheared.nml"], check=True, stdout=subprocess.PIPE)
    return Trajectory(folder / "result")


def test_copies_across_a_sheared_border_have_the_velocity_of_their_copy(tmp_path):
    """Finds a copy below in the colour of 0.184 m/s, its original, and a scale that does not reach to its own."""
    run = sheared(tmp_path)
    for name, expected in (("velocity_x", 0.184 - 0.4), ("speed", 0.4 - 0.184), ("size", None)):
        look = settle(run, [-1], Look(colour=name))
        frame, axis = run[-1], Figure().add_subplot()
        _, grains = draw_bodies(axis, frame, look)
        own = look.quantity.values(frame)
        assert grains.artist.get_array().tolist() == own.tolist()
        below = [k for k, shift in enumerate(frame.shifts) if shift.tolist() == [-frame.shift, -0.1]]
        copy = grains.artists[1 + below[0]]
        assert copy.get_array()[0] == pytest.approx(own[0] if expected is None else expected, rel=1e-12)
        assert len(grains.shown) == 3  # both grains, and the copy that can be seen
        drawn = copy.get_transform().transform(frame.vertices[0]) - axis.transData.transform(frame.vertices[0])
        step = axis.transData.transform((-frame.shift, -0.1)) - axis.transData.transform((0.0, 0.0))
        assert drawn == pytest.approx(np.broadcast_to(step, drawn.shape), abs=1e-6)
    low, high = settle(run, [-1], Look(colour="velocity_x")).colour_range
    assert low == -high and low == pytest.approx(-0.216, rel=0.01)


CONTROLLED = "stress_controlled = 'y' stress = 0, 1e3 mass = 0.5 damping_ratio = 0.1"


@pytest.mark.parametrize("more", ["", "shear_ramp = 4e-3", CONTROLLED])
def test_the_velocity_of_the_copy_above_is_the_rate_of_its_displacement(tmp_path, more):
    run = sheared(tmp_path, more, 8e-3)
    frames = list(run)
    times, shift, jump = (np.array([getattr(frame, name) for frame in frames]) for name in ("time", "shift", "jump"))
    assert np.diff(shift) / np.diff(times) == pytest.approx(0.5 * (jump[1:] + jump[:-1]), abs=2e-3)
    assert jump[-1] == pytest.approx(4 * frames[-1].cell_size[1], rel=1e-12)
    assert ("stress_controlled" in more) == (frames[-1].cell_size[1] < 0.0999)
    assert all(np.array_equal(frame.copy_velocities, np.outer(np.rint(frame.shifts[:, 1] / frame.cell_size[1]),
                                                              (frame.jump, 0.0))) for frame in frames)


def lines_of(artist):
    """The lines of an artist, (points, 2) each, without what separates them."""
    points = np.column_stack(artist.get_data())
    return [tuple(map(tuple, part[~np.isnan(part[:, 0])])) for part in
            np.split(points, np.flatnonzero(np.isnan(points[:, 0])) + 1)][:-1]


def test_a_cell_has_its_outline_at_the_time_of_the_frame_and_nothing_beyond(tmp_path):
    """Finds whole copies around a cell that has shrunk, and copies of a film that stay where they were at first."""
    run = sheared(tmp_path, CONTROLLED, 8e-3)
    numbers = [0, len(run) - 1]
    look = settle(run, numbers, Look(colour="velocity_x", show=("boxes",)))
    axis = Figure().add_subplot()
    walls, grains = draw_bodies(axis, run[0], look)
    outline = CellOutline(axis, run[0], look)
    assert len(lines_of(outline.artist)) == 4 and len(grains.artists) == 9
    for number in (-1, 0, -1):
        frame = run[number]
        for each in (walls, grains, outline):
            each.move(frame, look)
        low, high = frame.cell_low, frame.cell_low + frame.cell_size
        corners = {(x, y) for x in (low[0], high[0]) for y in (low[1], high[1])}
        lines = lines_of(outline.artist)
        assert {point for line in lines[:4] for point in line} == corners
        if number == -1:
            assert high[1] < 0.04995
            assert np.array([line[0] for line in lines[4:]]) == pytest.approx(
                np.array([(low[0] + frame.shift, high[1]), (high[0] - frame.shift, low[1])]))
        shown = [artist for artist in grains.artists if artist.get_visible()]
        assert len(shown) == 1 + len(frame.shifts) == (11 if number else 9)
        for shift, artist in zip([(0, 0), *frame.shifts], shown):
            drawn = artist.get_transform().transform(frame.vertices[0])
            assert drawn == pytest.approx(axis.transData.transform(frame.vertices[0] + shift), abs=1e-6)
        for artist in (*shown, *overlays(axis, frame, look)):
            path, transform = artist.get_clip_path().get_transformed_path_and_affine()
            border = axis.transData.inverted().transform(transform.transform(path.vertices))
            assert np.array([border.min(axis=0), border.max(axis=0)]) == pytest.approx(np.array([low, high]))


def test_the_outline_of_a_cell_that_repeats_along_x_are_two_lines(tmp_path):
    frame = Frame.from_polygons([np.array([(0, 0), (1, 0), (1, 1)])])
    look = SettledLook(limits=(0.0, 3.0, 0.0, 4.0))
    assert cell_lines(frame, look) == []
    lines = cell_lines(replace(frame, cell_low=np.array([0.0, 0.0]), cell_size=np.array([3.0, 0.0])), look)
    assert [line.tolist() for line in lines] == [[[0, -4], [0, 8]], [[3, -4], [3, 8]]]


def test_the_viewer_has_the_cell_and_arms_of_contacts_across_its_border(tmp_path):
    """Finds arms as long as the cell, which are cut: contacts over the border were far from both bodies."""
    text = SCENE.replace("periodic = 'xy'", "periodic = 'xy' shear_rate = -30 profile = .true.")
    (tmp_path / "shear.nml").write_text(text.format(folder=tmp_path / "result"), encoding="utf-8")
    subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", tmp_path / "shear.nml"], check=True, stdout=subprocess.PIPE)
    run = Trajectory(tmp_path / "result")
    packed = pack_run(run, list(range(len(run))))
    assert packed.facts["cells"] == [[0.01, 0.0, 0.06, 0.05, frame.shift] for frame in run]
    read = [np.frombuffer(zlib.decompress(base64.b64decode(packed.blocks[name])), np.int8)
            for name in ("arm_x", "arm_y")]
    arms = np.column_stack(read) * packed.facts["contacts"]["reach"] / 127
    true = [frame.contacts.first_arm[np.lexsort((frame.contacts.second_index, frame.contacts.first_index))]
            for frame in run]
    assert arms == pytest.approx(np.concatenate(true), abs=0.51 * packed.facts["contacts"]["reach"] / 127)
    table = _Contacts()
    for frame in run:  # the arm goes from the second body if the first is fixed
        table.add(replace(frame, fixed=np.isin(frame.id, frame.contacts.first[:1])))
    assert np.abs(table.arms.read()).max() <= run[0].radius.max() * 1.0001


def test_exported_contacts_across_the_border_are_short_lines(trajectory):
    crossing = 0
    for frame in trajectory:
        for fixed in (frame.fixed, np.arange(len(frame)) < 4):
            held = replace(frame, fixed=fixed)
            lines = contact_mesh(held).points[:, :2].reshape(-1, 2, 2)
            between = ~(fixed[held.contacts.first_index] & fixed[held.contacts.second_index])
            lengths = np.hypot(*(lines[:, 1] - lines[:, 0]).T)[between]
            assert np.all(lengths <= 2 * frame.radius.max())
            crossing += len(lengths)
    assert crossing > 50


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


def test_a_stress_controlled_cell_has_another_size_in_each_frame(tmp_path):
    """Finds frames with the size of the start: arms across the border would be as long as the cell."""
    scene = SCENE.replace("size = 0.06, 0.05", "size = 0.06, 0.05 stress_controlled = 'xy' stress = 2e3, 1e3"
                          " mass = 0.05 damping_ratio = 1")
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
