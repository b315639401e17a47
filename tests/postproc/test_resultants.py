"""Forces and torques of bodies from the contacts of frames: those that moved the bodies, which a checkpoint has."""

import os
import subprocess

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose
from polydem_post import Trajectory
from polydem_post.analysis import body_stress, sample_stress

#: Grains that fall, meet at speed and come to lie in a box
BOX = """\
&wall name = 'box' outline = 'polyline' vertices = -0.05, 0.2, -0.05, 0, 0.05, 0, 0.05, 0.2 thickness = 0.02 /
&grains name = 'sample' region = 'box' low = -0.05, 0 high = 0.05, 0.12 number = 40 {shape} speed = 1 spin = 50 /
&forces gravity = 2, -9.81 stiffness = 1e5 {forces} /
&integrate duration = 0.15 /
"""
#: Grains in a cell that is sheared while it presses them together
CELL = """\
&cell periodic = 'xy' low = 0, 0 size = 0.06, 0.05 shear_rate = 5 {cell} /
&grains name = 'sample' region = 'box' low = 0, 0 high = 0.06, 0.05 number = 50 speed = 1 spin = 30
   shape = 'regular' corners = 5, 7 diameter = 5e-3, 7e-3 /
&forces gravity = 0, 0 stiffness = 1e5 {forces} /
&integrate duration = 0.05 /
"""
OUTPUT = "&output frame_interval = 0.05 contacts = .true. folder = '{folder}' series_interval = 0.05 /\n"
REGULAR = "shape = 'regular' corners = 3, 6 diameter = 8e-3, 12e-3"
CROSSES = "shape = 'cross' width = 12e-3 arm = 4e-3"

#: Each scene by name
SCENES = {
    "tilts damped": BOX.format(shape=REGULAR, forces=""),
    "area law": BOX.format(shape=REGULAR, forces="law = 'area'"),
    "rolling resistance": BOX.format(shape=REGULAR, forces="rolling_friction = 0.3 tilt_damping = 0"),
    "area law with rolling resistance": BOX.format(shape=REGULAR, forces="law = 'area' rolling_friction = 0.3"),
    "cohesion": BOX.format(shape=REGULAR, forces="cohesion = 800 rolling_friction = 0.2"),
    "pieces": BOX.format(shape=CROSSES, forces="cohesion = 300"),
    "exact friction": BOX.format(shape=REGULAR, forces="friction = 'exact'"),
    "without friction and damping": BOX.format(shape=REGULAR, forces="friction = 'none' damping = 'none'"),
    "sheared cell": CELL.format(cell="stress_controlled = 'y' stress = 0, 3e3", forces="rolling_friction = 0.2"),
    "sheared cell, area law": CELL.format(cell="stress_controlled = 'y' stress = 0, 3e3", forces="law = 'area'"),
    "cell": CELL.format(cell="stress_controlled = 'xy' stress = 3e3, 3e3", forces="cohesion = 200")
    .replace("shear_rate = 5", ""),
}


def run_of(text, folder):
    """The result of a run."""
    (folder / "scene.nml").write_text(text + OUTPUT.format(folder=folder / "result"), encoding="utf-8")
    subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", "--threads", "1", folder / "scene.nml"], check=True,
                   stdout=subprocess.DEVNULL)
    return Trajectory(folder / "result")


def within(point, outline):
    """Least distance of a point from the edges of a convex outline, negative outside."""
    edge = np.roll(outline, -1, axis=0) - outline
    arm = point - outline
    return np.min((edge[:, 0] * arm[:, 1] - edge[:, 1] * arm[:, 0]) / np.hypot(edge[:, 0], edge[:, 1]))


@pytest.mark.parametrize("name", SCENES)
def test_contacts_give_forces_and_torques_of_all_bodies(name, tmp_path):
    run = run_of(SCENES[name], tmp_path)
    frame = run[-1]
    contacts = frame.contacts
    with h5py.File(max((tmp_path / "result").glob("checkpoint_?.h5"), key=os.path.getmtime)) as file:
        force, torque = file["bodies/force"][:], file["bodies/torque"][:]
        assert file["run/step"][0] == frame.step
    gravity = np.asarray(run.settings.forces["gravity"])
    force[frame.free] -= frame.mass[frame.free][:, None] * gravity
    assert len(contacts) > 5
    scale = contacts.force_magnitude.max()
    assert_allclose(frame.force, force, atol=1e-12 * scale)
    assert_allclose(frame.torque, torque, atol=1e-13 * scale)
    # What the walls feel is what their contacts say, too.
    on_fixed = np.zeros(len(frame))
    cross = [arm[:, 0] * contacts.force[:, 1] - arm[:, 1] * contacts.force[:, 0] + contacts.couple
             for arm in (contacts.first_arm, contacts.second_arm)]
    np.add.at(on_fixed, contacts.first_index, cross[0])
    np.subtract.at(on_fixed, contacts.second_index, cross[1])
    assert_allclose(on_fixed[frame.fixed], frame.walls.torque, atol=1e-12 * scale)


@pytest.mark.parametrize("name", ["tilts damped", "cohesion", "sheared cell", "area law with rolling resistance"])
def test_points_lie_within_both_bodies(name, tmp_path):
    frame = run_of(SCENES[name], tmp_path)[-1]
    contacts = frame.contacts
    for index, arm in ((contacts.first_index, contacts.first_arm), (contacts.second_index, contacts.second_arm)):
        for k, point in zip(index, arm):
            assert within(point, frame.vertices[k] - frame.position[k]) > -1e-12


def test_a_block_at_rest_on_a_slope_stands_on_the_point_below_its_centre(tmp_path):
    """The moment of the normal force about the centre is that of friction: the point is h/2 tan(slope) off."""
    slope = 0.3
    run = run_of(f"""\
&wall name = 'floor' outline = 'rectangle' low = -0.5, -0.1 high = 0.5, 0 /
&grains name = 'block' region = 'at' at = 0, 0.05 shape = 'rectangle' width = 0.12 height = 0.1 /
&forces gravity = {9.81 * np.sin(slope)}, {-9.81 * np.cos(slope)} stiffness = 1e7 friction_coefficient = 0.6 /
&integrate duration = 2 /
&sample area = 'rectangle' low = -0.1, 0 high = 0.1, 0.1 /
""", tmp_path)
    frame = run[-1]
    weight = 0.12 * 0.1 * 2500 * 9.81
    assert frame.speed.max() < 1e-6
    assert frame.contacts.point[0, 0] - frame.position[frame.free][0, 0] == pytest.approx(
        0.05 * np.tan(slope), rel=1e-3)
    assert abs(frame.contacts.couple[0]) < 1e-6 * weight
    stress = sample_stress(frame, (-0.1, 0.0, 0.1, 0.1))
    assert stress[0, 1] == pytest.approx(stress[1, 0], rel=1e-3)
    assert abs(stress[0, 1]) > 0.1 * abs(stress[1, 1])
    body = body_stress(frame)[frame.free][0]
    assert body[0, 1] == pytest.approx(body[1, 0], rel=1e-3)
    series = run.time_series
    assert [series[f"stress_{axes}"][-1] for axes in ("xx", "xy", "yx", "yy")] == pytest.approx(
        [*stress.ravel()], rel=1e-9, abs=1e-9 * weight)


def test_stress_of_grains_at_rest_is_symmetric(tmp_path):
    run = run_of(BOX.format(shape=REGULAR, forces="local_damping = 0.5").replace("0.15", "2"), tmp_path)
    frame = run[-1]
    assert frame.speed.max() < 1e-4
    stress = sample_stress(frame, (-0.05, 0.0, 0.05, 0.2))
    assert abs(stress[0, 1] - stress[1, 0]) < 1e-3 * stress[1, 1]
