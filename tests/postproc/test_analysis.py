"""Measures of granular matter on configurations with known answers."""

import dataclasses
import inspect
import warnings

import numpy as np
import polydem_post.analysis as analysis
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from polydem_lab.bench.statistics import _student
from polydem_post import Frame, ResultError, Trajectory
from polydem_post.analysis import (
    ShortSeries,
    anisotropy,
    block_average,
    body_stress,
    coarse_grain,
    coordination_number,
    fabric_tensor,
    flow_rate,
    force_distribution,
    free_surface,
    gaussian,
    lacey_index,
    lucy,
    mass_beyond,
    mean_squared_displacement,
    profile,
    rattlers,
    rectangle,
    solid_fraction,
    stress_tensor,
    surface_angle,
)
from polydem_post.analysis.windows import area_inside
from polydem_post.base.columns import columns_of, field_names
from polydem_post.base.polygons import area_of, clip

SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


def student(blocks):
    """Half the width of an interval of 95 %, in errors from so many blocks."""
    return np.array([-_student(0.025, int(number) - 1) for number in np.ravel(blocks)]).reshape(np.shape(blocks))


def squares(centres, **options):
    """Unit squares."""
    return Frame.from_polygons([SQUARE + np.array(centre) for centre in centres], **options)


def turned(points, angle):
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.asarray(points) @ np.array([[cosine, sine], [-sine, cosine]])


def star(directions, forces):
    """A body in the middle with contacts in some directions, and the forces on it [N/m]."""
    directions = np.asarray(directions)
    frame = squares([(0, 0), *(3.0 * directions)])
    n = len(directions)
    return frame.with_contacts(np.ones(n, int), np.arange(2, n + 2), forces, 1.5 * directions)


# --- solid fraction ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 4])
def test_solid_fraction_of_clipped_squares(angle):
    # A square of area 1 in a corner of the window: a quarter is inside; another is wholly inside.
    frame = Frame.from_polygons([turned(SQUARE, angle), turned(SQUARE + np.array([2.0, 2.0]), angle)])
    window = turned(rectangle(0.0, 0.0, 4.0, 5.0), angle)
    assert solid_fraction(frame, window) == pytest.approx(1.25 / 20.0, rel=1e-12)


def test_solid_fraction_of_a_tiling_is_one():
    frame = squares([(x, y) for x in range(6) for y in range(6)])
    assert solid_fraction(frame, (0.3, 0.1, 4.7, 5.2)) == pytest.approx(1.0, rel=1e-12)
    triangle = np.array([(0.2, 0.1), (5.1, 0.7), (2.2, 4.9)])
    assert solid_fraction(frame, triangle) == pytest.approx(1.0, rel=1e-12)


def test_solid_fraction_counts_overlaps_twice_or_once():
    frame = squares([(0, 0), (0.5, 0)], fixed=[True, False])
    window = (-1, -1, 1.5, 1)
    assert solid_fraction(frame, window) == pytest.approx(2.0 / 5.0)
    assert solid_fraction(frame, window, fixed=False) == pytest.approx(1.0 / 5.0)
    pytest.importorskip("shapely")
    assert solid_fraction(frame, window, union=True) == pytest.approx(1.5 / 5.0)


@pytest.mark.parametrize("window, message", [
    ((1, 0, 0, 1), "least x, least y"), ([(0, 0), (2, 0), (1, 0.5), (1, 2)], "not convex"),
    ([(0, 0), (1, 1)], "different vertices")])
def test_bad_windows_are_errors(window, message):
    with pytest.raises(ResultError, match=message):
        solid_fraction(squares([(0, 0)]), window)


# --- network -------------------------------------------------------------------------------------------------------


def test_coordination_of_a_square_lattice():
    # A lattice of 4 x 4: 24 contacts, each with two free bodies.
    centres = [(x, y) for y in range(4) for x in range(4)]
    pairs = [(k + 1, k + 2) for k in range(16) if k % 4 < 3] + [(k + 1, k + 5) for k in range(12)]
    first, second = np.array(pairs).T
    frame = squares(centres).with_contacts(first, second, np.zeros((24, 2)), np.zeros((24, 2)))
    assert coordination_number(frame) == pytest.approx(2 * 24 / 16)
    assert not rattlers(frame).any()
    # Of three contacts per body at least only the inner bodies and those on the sides have enough, so all go in turn.
    assert rattlers(frame, 3).sum() == 16
    assert np.isnan(coordination_number(frame, with_rattlers=False, least=3))


def test_coordination_counts_contacts_with_fixed_bodies_once():
    # A triangle of bodies on a floor, a chain of two that hangs on it, and one alone.
    frame = squares([(0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (5, 0), (0, -1)], fixed=[False] * 6 + [True])
    frame = frame.with_contacts([1, 2, 1, 3, 4, 1], [2, 3, 3, 4, 5, 7], np.zeros((6, 2)), np.zeros((6, 2)))
    assert coordination_number(frame) == pytest.approx((2 * 5 + 1) / 6)
    assert_array_equal(np.flatnonzero(rattlers(frame)), [3, 4, 5])
    assert coordination_number(frame, with_rattlers=False) == pytest.approx((2 * 3 + 1) / 3)


def test_coordination_counts_two_bodies_once_however_they_are_cut():
    """Finds contacts of pieces that count as bodies, also with the bodies exchanged, and bodies that they support."""
    frame = squares([(0, 0), (1, 0), (0, -1)], fixed=[False, False, True])
    frame = frame.with_contacts([1, 1, 2, 1, 1], [2, 3, 1, 3, 2], np.zeros((5, 2)), np.zeros((5, 2)))
    assert_array_equal(frame.contacts.is_first, [True, True, False, False, False])
    assert_array_equal(frame.coordination, [2, 1, 1])
    assert coordination_number(frame) == pytest.approx(3 / 2)
    assert_array_equal(rattlers(frame), [True, True, False])


def test_distribution_of_forces_is_normalised():
    angles = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    size = -np.log((np.arange(400) + 0.5) / 400)  # quantiles of an exponential distribution with mean 1
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    frame = star(directions, -7.0 * size[:, None] * directions)
    found = force_distribution(frame, bins=np.linspace(0, 8, 17))
    assert found.mean == pytest.approx(7.0 * size.mean()) and found.count == 400
    assert np.sum(found.density * np.diff(found.edges)) == pytest.approx(1.0)
    expected = (np.exp(-found.edges[:-1] * found.mean / 7.0) - np.exp(-found.edges[1:] * found.mean / 7.0))
    assert_allclose(found.density * np.diff(found.edges), expected, atol=1.5 / 400)
    assert found.centres[0] == 0.25
    with pytest.raises(ResultError, match="has a tangential force"):
        force_distribution(star([[1, 0]], [[-1.0, 0.0]]), "tangential")


def test_fabric_of_four_contacts():
    frame = star([(1, 0), (-1, 0), (1, 0), (0, 1)], [[-1, 0], [1, 0], [-1, 0], [0, -1]])
    assert_allclose(fabric_tensor(frame), [[0.75, 0], [0, 0.25]], atol=1e-15)
    assert_allclose(fabric_tensor(frame, [0, 3]), [[0.5, 0], [0, 0.5]], atol=1e-15)
    found = anisotropy(frame)
    assert_allclose([found.contacts, found.normal, found.tangential, found.angle], [1.0, 0.0, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("a_n, a_t, phase", [(0.0, 0.0, 0.0), (0.6, 0.0, 0.4), (0.5, 0.3, -0.7), (0.0, 0.4, 1.2)])
def test_anisotropies_of_forces_given_by_their_fourier_series(a_n, a_t, phase):
    # Equally spaced directions (a_c = 0) with f_n = 1 + a_n cos 2(theta - phase), f_t = -a_t sin 2(theta - phase).
    angles = 2 * np.pi * np.arange(64) / 64
    normal = np.column_stack([np.cos(angles), np.sin(angles)])
    tangent = np.column_stack([-np.sin(angles), np.cos(angles)])
    pushed = (1 + a_n * np.cos(2 * (angles - phase)))[:, None] * normal
    pushed -= (a_t * np.sin(2 * (angles - phase)))[:, None] * tangent
    found = anisotropy(star(normal, -10.0 * pushed))
    assert_allclose([found.contacts, found.normal, found.tangential], [0.0, a_n, a_t], atol=1e-12)


def test_the_anisotropy_of_contacts_given_by_its_fourier_series():
    angle = np.linspace(0, 2 * np.pi, 40001)
    share = (angle + 0.5 * 0.6 * np.sin(2 * (angle - 0.3)) + 0.3 * np.sin(0.6)) / (2 * np.pi)
    angles = np.interp((np.arange(500) + 0.5) / 500, share, angle)
    normal = np.column_stack([np.cos(angles), np.sin(angles)])
    found = anisotropy(star(normal, -normal))
    assert found.contacts == pytest.approx(0.6, abs=1e-3)
    assert found.angle == pytest.approx(0.3, abs=1e-3)
    assert (found.normal, found.tangential) == pytest.approx((0.0, 0.0), abs=1e-12)


# --- stress --------------------------------------------------------------------------------------------------------


def chain(force=6.0, n=8):
    """Unit squares side by side under a force along x."""
    k = np.arange(n - 1)
    return squares([(x, 0) for x in range(n)]).with_contacts(
        k + 1, k + 2, np.tile([-force, 0.0], (n - 1, 1)), np.column_stack([k + 0.5, 0 * k]))


@pytest.mark.parametrize("window", [(0.0, -0.5, 7.0, 0.5), (1.3, -0.5, 5.9, 0.5), (2.2, -0.5, 2.7, 0.5)])
def test_stress_of_a_chain_is_force_over_height(window):
    stress = stress_tensor(chain(), window)
    assert_allclose(stress.contact, [[6.0, 0], [0, 0]], atol=1e-12)
    assert_allclose(stress.kinetic, 0.0)
    assert (stress.pressure, stress.deviator, stress.angle) == pytest.approx((3.0, 3.0, 0.0))


def test_stress_is_a_tensor():
    frame = star([(1, 0), (0, 1), (-1, 0), (0, -1)], [[-5, 1], [1, -2], [5, -1], [-1, 2]])
    turn = 0.4
    rotation = turned(np.eye(2), turn).T
    window = rectangle(-3, -3, 3, 3)
    other = Frame.from_polygons([turned(outline, turn) for outline in frame.vertices]).with_contacts(
        frame.contacts.first, frame.contacts.second, turned(frame.contacts.force, turn),
        turned(frame.contacts.point, turn))
    straight, rotated = stress_tensor(frame, window), stress_tensor(other, turned(window, turn))
    assert_allclose(rotated.total, rotation @ straight.total @ rotation.T, atol=1e-12)
    assert rotated.angle == pytest.approx(straight.angle + turn)


def test_kinetic_stress_of_opposite_velocities():
    velocity = [(3.0, 0.0), (-1.0, 0.0), (1.0, 2.0), (1.0, -2.0)]
    frame = squares([(0, 0), (2, 0), (0, 2), (2, 2)], velocity=velocity, density=10.0).with_contacts([], [], [], [])
    stress = stress_tensor(frame, (-1, -1, 4, 4))
    assert_allclose(stress.kinetic, [[10 * 8 / 25, 0], [0, 10 * 8 / 25]])
    assert_allclose(stress.contact, 0.0)


def test_stress_of_a_column_at_rest_is_the_weight_above(heap_column):
    frame, width, weight = heap_column
    # From the middle of block 3 to that of block 8 the interfaces carry 7, 6, 5, 4, 3 blocks (of ten, from below).
    middle = [frame.position[k, 1] for k in (2, 7)]
    x = frame.position[2, 0]
    stress = stress_tensor(frame, (x - 0.5 * width, middle[0], x + 0.5 * width, middle[1]))
    mean = np.average([7, 6, 5, 4, 3], weights=np.diff(frame.position[2:8, 1]))
    assert stress.contact[1, 1] == pytest.approx(weight * mean / width, rel=1e-9)
    assert abs(stress.contact[0, 0]) < 1e-6 * stress.contact[1, 1]
    own = body_stress(frame)[4]  # the fifth block carries five blocks, and rests with six on the fourth
    below, above = 0.5 * np.diff(frame.position[3:6, 1])
    assert own[1, 1] * frame.area[4] == pytest.approx(weight * (6 * below + 5 * above), rel=1e-9)


@pytest.fixture(scope="module")
def heap_column(tmp_path_factory):
    """Ten blocks on each other at rest: frame, width of a block and its weight."""
    import os
    import subprocess

    folder = tmp_path_factory.mktemp("stack")
    (folder / "stack.nml").write_text("&scene\n name = 'stack'\n bodies = 10\n width = 0.01\n height = 0.01\n/\n"
                                      "&integrate\n duration = 0.01\n/\n&output\n contacts = .true.\n/\n")
    subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", "stack.nml"], cwd=folder, check=True, capture_output=True)
    run = Trajectory(folder / "results" / "stack")
    return run[-1], 0.01, run[-1].mass[0] * -run.settings.forces.gravity[1]


def test_stress_inside_a_pressed_body():
    # Pressed by 4 N/m along x and 2 N/m along y: the mean stress is force over the length of a side.
    frame = star([(1, 0), (-1, 0), (0, 1), (0, -1)], [[-4, 0], [4, 0], [0, -2], [0, 2]])
    frame = squares([(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)]).with_contacts(
        [1, 1, 1, 1], [2, 3, 4, 5], frame.contacts.force, [[0.5, 0], [-0.5, 0], [0, 0.5], [0, -0.5]])
    assert_allclose(body_stress(frame)[0], [[4, 0], [0, 2]], atol=1e-12)


# --- fields --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kernel", [lucy(1.3), gaussian(0.6)], ids=lambda kernel: kernel.name)
def test_kernels_have_the_integral_one(kernel):
    r = (np.arange(200000) + 0.5) * kernel.range / 200000
    assert np.sum(kernel.value(r) * 2 * np.pi * r) * kernel.range / 200000 == pytest.approx(1.0, rel=1e-8)
    assert kernel.value(np.array([1.0001 * kernel.range])) == 0.0


@pytest.mark.parametrize("kernel", [lucy(1.3), gaussian(0.4)], ids=lambda kernel: kernel.name)
def test_coarse_graining_conserves_mass_momentum_and_stress(kernel):
    random = np.random.default_rng(5)
    frame = squares(random.uniform(0, 9, (12, 2)), velocity=random.normal(0, 1, (12, 2)))
    force = random.normal(0, 1, (6, 2))
    frame = frame.with_contacts(np.arange(1, 7), np.arange(7, 13), force, np.zeros((6, 2)))
    fields = coarse_grain(frame, kernel, 0.21)
    assert fields.density.sum() * fields.cell == pytest.approx(frame.mass.sum(), rel=1e-12)
    assert_allclose(fields.momentum.sum(axis=(0, 1)) * fields.cell, frame.mass @ frame.velocity, rtol=1e-10)
    whole = np.einsum("ci,cj->ij", force, frame.contacts.branch)
    assert_allclose(fields.contact_stress.sum(axis=(0, 1)) * fields.cell, whole, rtol=1e-10)
    # Kinetic energy is divided between the mean flow and the fluctuations.
    mean = np.nansum(0.5 * fields.density * np.sum(fields.velocity**2, axis=2)) * fields.cell
    inner = 0.5 * np.trace(fields.kinetic_stress, axis1=2, axis2=3).sum() * fields.cell
    assert mean + inner == pytest.approx(0.5 * frame.mass @ np.sum(frame.velocity**2, axis=1), rel=1e-10)
    assert inner > 0.0


def test_the_field_of_one_body_is_the_kernel():
    frame = squares([(0.03, -0.02)], velocity=[(2.0, 1.0)], density=3.0).with_contacts([], [], [], [])
    kernel = lucy(2.0)
    fields = coarse_grain(frame, kernel, 0.05)
    away = np.hypot(fields.x[None, :] - 0.03, fields.y[:, None] + 0.02)
    assert_allclose(fields.density, 3.0 * kernel.value(away), atol=2e-3 * 3.0 * kernel.value(np.zeros(1))[0])
    inside = fields.density > 1e-6
    assert_allclose(fields.velocity[inside], np.broadcast_to([2.0, 1.0], fields.velocity[inside].shape))
    assert_allclose(fields.kinetic_stress, 0.0, atol=1e-12)


def test_the_fields_of_a_tiling_are_uniform():
    centres = [(x, y) for x in range(16) for y in range(16)]
    velocity = [(0.5 * y, 0.0) for x, y in centres]
    frame = squares(centres, density=7.0, velocity=velocity).with_contacts([], [], [], [])
    fields = coarse_grain(frame, lucy(4.0), 0.25, window=(6, 6, 10, 10))
    assert fields.density.shape == (16, 16)
    assert_allclose(fields.density, 7.0, rtol=2e-3)
    assert_allclose(fields.velocity[..., 0], np.broadcast_to(0.5 * fields.y[:, None], (16, 16)), rtol=5e-3)


def test_the_contact_field_of_a_chain_is_its_force_per_height():
    # In the middle of a long chain the stress integrated across it is the force, whatever the kernel.
    for kernel in (lucy(1.1), gaussian(0.5)):
        fields = coarse_grain(chain(n=12), kernel, 0.1)
        column = np.argmin(np.abs(fields.x - 5.5))
        assert fields.contact_stress[:, column, 0, 0].sum() * 0.1 == pytest.approx(6.0, rel=1e-2)
        assert_allclose(fields.contact_stress[..., 1, :], 0.0, atol=1e-12)


def test_fields_without_contacts():
    frame = squares([(0, 0)])
    assert np.isnan(coarse_grain(frame, lucy(1.0), 0.2, contacts=False).contact_stress).all()
    with pytest.raises(ResultError, match="made without contacts"):
        coarse_grain(frame, lucy(1.0), 0.2)
    with pytest.raises(ResultError, match="at most the range of the kernel"):
        coarse_grain(frame, lucy(1.0), 2.0, contacts=False)


# --- surface, profiles, flow, mixing, motion -----------------------------------------------------------------------


@pytest.mark.parametrize("degrees", [-32.0, 0.0, 24.5])
def test_the_angle_of_a_tilted_surface(degrees):
    slope = np.tan(np.radians(degrees))
    slabs = [np.array([(x, -9), (x + 1, -9), (x + 1, slope * (x + 1)), (x, slope * x)]) for x in range(-5, 5)]
    wall = np.array([(-9, -9), (-7, -9), (-7, 30), (-9, 30)])
    high_wall = np.array([(-1, 20), (1, 20), (1, 21), (-1, 21)])
    frame = Frame.from_polygons([*slabs, wall, high_wall], fixed=[False] * 10 + [True, True])
    surface = free_surface(frame, -4.5, 4.2, 37)
    assert surface.angle == pytest.approx(degrees, abs=1e-9)
    assert surface.deviation < 1e-12
    assert_allclose(surface.points[:, 1], slope * surface.points[:, 0], atol=1e-12)


def test_the_surface_of_steps_is_their_mean_slope():
    frame = squares([(x, 0.5 * x) for x in range(41)])
    surface = free_surface(frame, -0.5, 40.5, 41 * 7)
    assert np.tan(np.radians(surface.angle)) == pytest.approx(0.5, rel=1e-3)
    with pytest.raises(ResultError, match="no free bodies between"):
        free_surface(frame, 60, 70)


def test_the_profile_of_a_shear_flow():
    strips = [np.array([(0, 0.1 * k), (3, 0.1 * k), (3, 0.1 * k + 0.1), (0, 0.1 * k + 0.1)]) for k in range(40)]
    heights = 0.1 * np.arange(40) + 0.05
    frame = Frame.from_polygons(strips, velocity=np.column_stack([2.0 * heights, 0 * heights]), density=5.0)
    found = profile(frame, "velocity", [0.0, 1.0, 1.55, 4.0])
    # The middle strip of the second edge is halved: exact means follow from areas.
    expected = [2.0 * heights[:10].mean(), (2 * (heights[10:15].sum() + 0.5 * heights[15])) / 5.5,
                (2 * (heights[16:].sum() + 0.5 * heights[15])) / 24.5]
    assert_allclose(found.mean[:, 0], expected, rtol=1e-12)
    assert_allclose(found.weight, 3.0 * np.array([1.0, 0.55, 2.45]), rtol=1e-12)
    assert_allclose(found.centres, [0.5, 1.275, 2.775])
    mass = profile(frame, heights, [0.0, 2.0, 4.0], weight="mass", between=(1.0, 2.0))
    assert_allclose(mass.weight, [10.0, 10.0], rtol=1e-12)
    along = profile(frame, "velocity", [-1.0, 0.0, 1.5], axis="x")
    assert np.isnan(along.mean[0]).all() and along.weight[0] == 0.0
    assert along.mean[1, 0] == pytest.approx(4.0)


def test_a_profile_across_a_slope_is_that_of_the_turned_scene():
    heights = np.arange(6.0)
    flat = squares([(x, y) for y in heights for x in range(4)], velocity=np.repeat(heights, 4)[:, None] * (1.0, 0.0))
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    sloped = Frame.from_polygons([outline @ turn.T for outline in flat.vertices], velocity=flat.velocity @ turn.T)
    edges = [-0.2, 1.3, 3.0, 5.5]
    level = profile(flat, "velocity", edges, between=(0.2, 2.9))
    found = profile(sloped, "velocity", edges, axis=turn @ (0.0, 3.0), between=(0.2, 2.9))
    assert_allclose(found.weight, level.weight, rtol=1e-12)
    assert_allclose(found.mean @ turn, level.mean, atol=1e-12)
    for wrong in ("z", (0, 0), (1, 2, 3)):
        with pytest.raises(ResultError, match="axis x or y, or a vector"):
            profile(flat, "velocity", edges, axis=wrong)


def test_a_profile_over_frames_weighs_every_part_alike():
    slow, fast = (squares([(0, 0.5 * k)], velocity=[(1.0 + k, 0.0)]) for k in range(2))
    found = profile([slow, fast], "velocity", [-0.5, 0.0, 2.0])
    # Of the first square half is in either slab, of the second all in the upper one.
    assert_allclose(found.mean[:, 0], [1.0, (0.5 * 1.0 + 1.0 * 2.0) / 1.5])
    assert_allclose(found.weight, [0.25, 0.75])
    with pytest.raises(ResultError, match="at least one frame"):
        profile([], "velocity", [0.0, 1.0])


def test_parts_in_slabs_are_those_of_clipping():
    random = np.random.default_rng(3)
    outlines = []
    for centre in random.uniform(-3, 3, (60, 2)):
        angles = np.sort(random.uniform(0, 2 * np.pi, random.integers(3, 9)))
        outlines.append(centre + random.uniform(0.2, 1.0) * np.column_stack([np.cos(angles), 0.6 * np.sin(angles)]))
    held = random.random(60) < 0.1
    frame = Frame.from_polygons(outlines, fixed=held)
    edges, cut = np.array([-2.0, -1.3, -1.25, 0.4, 2.7]), (-1.1, 2.3)
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    for between in (None, cut):
        found = profile(frame, "velocity", edges, axis=(0.6, 0.8), between=between)
        low, high = between or (-20.0, 20.0)
        for weight, below, above in zip(found.weight, edges, edges[1:]):
            window = rectangle(below, -high, above, -low) @ turn.T  # the other axis is (0.8, -0.6)
            assert weight == pytest.approx(area_inside(frame, window)[~held].sum(), rel=1e-12, abs=1e-14)


def test_fluctuations_are_those_about_a_linear_profile():
    # Rows of squares with the velocity 3 y along x: slabs of one, two or three rows have no fluctuation, but the
    # deviation from the mean of a slab of two rows would be 1.5.
    heights = np.repeat(np.arange(12.0), 5)
    places = np.column_stack([np.tile(np.arange(5.0), 12), heights])
    shear = np.column_stack([3.0 * heights, 0.0 * heights])
    for rows in (1, 2, 3):
        found = profile(squares(places, velocity=shear), "velocity", np.arange(-0.5, 12.0, rows))
        assert_allclose(found.fluctuation, 0.0, atol=1e-12)
        assert np.isnan(found.error).all()
    # With random parts of known size added, these come out, in components and as a temperature.
    random = np.random.default_rng(11)
    noise = (0.7, 0.2) * random.normal(size=(200, 60, 2))
    frames = [squares(places, velocity=shear + each, time=float(k)) for k, each in enumerate(noise)]
    found = profile(frames, "velocity", np.arange(-0.5, 12.0, 2))
    assert_allclose(found.fluctuation[:, 0], 0.7, rtol=0.06)  # 2000 values: 1.6 % is the standard error
    assert_allclose(found.fluctuation[:, 1], 0.2, rtol=0.06)
    temperature = 0.5 * np.sum(found.fluctuation**2, axis=1)
    assert temperature.mean() == pytest.approx(0.5 * (0.7**2 + 0.2**2), rel=0.02)
    # The frames are independent: the errors are those of as many values.
    assert_allclose(found.error, np.broadcast_to(np.array([0.7, 0.2]) / np.sqrt(2000), (6, 2)), rtol=0.6)
    assert found.error[:, 0].mean() == pytest.approx(0.7 / np.sqrt(2000), rel=0.15)


def test_errors_of_a_tilted_profile_hold_the_truth():
    # Rows of a bed that is tilted by 25 degrees slide with velocities along the slope that fluctuate about k/2, each
    # row with its own correlated noise: about 95 of 100 intervals of Student's t hold the truth.
    degrees, rows, noise = 25.0, 40, 0.3
    turn = turned(np.eye(2), np.radians(degrees))
    downhill = -turn[0]
    values = ar1(np.random.default_rng(4), 0.8, (3, rows, 300)).transpose(0, 2, 1)
    series = 0.5 * np.arange(rows) + noise * values
    outlines = [turned(SQUARE + np.array([0.0, y]), np.radians(degrees)) for y in range(rows)]
    held = 0
    for run in series:
        frames = [Frame.from_polygons(outlines, velocity=each[:, None] * downhill, time=0.1 * k)
                  for k, each in enumerate(run)]
        found = profile(frames, lambda frame: frame.velocity @ downhill, np.arange(-0.5, rows), angle=degrees,
                        between=(-1.0, 1.0))
        assert_allclose(found.mean, run.mean(axis=0), rtol=1e-9)
        assert_allclose(found.weight, 1.0, rtol=1e-9)
        held += np.sum(np.abs(found.mean - 0.5 * np.arange(rows)) <= student(found.blocks) * found.error)
        # The mean of 300 values with a correlation time of 4.5 has the error noise sqrt(2*4.5/300).
        assert np.sqrt(np.mean(found.error**2)) == pytest.approx(noise * np.sqrt(9.0 / 300), rel=0.25)
        vectors = profile(frames[:60], "velocity", np.arange(-0.5, rows), axis=turn[1])
        assert_allclose(vectors.mean @ downhill, run[:60].mean(axis=0), rtol=1e-9)
    assert 0.89 <= held / (3 * rows) <= 0.99
    with pytest.raises(ResultError, match="an axis or an angle"):
        profile(frames[0], "velocity", [0.0, 1.0], axis="x", angle=3.0)


def ar1(random, memory, shape):
    """Series of mean 0 and variance 1 with the autocorrelation memory**k: n values along the last axis."""
    noise = random.normal(size=shape)
    values = np.empty(shape)
    values[..., 0] = noise[..., 0]
    for k in range(1, shape[-1]):
        values[..., k] = memory * values[..., k - 1] + np.sqrt(1.0 - memory**2) * noise[..., k]
    return values


@pytest.mark.parametrize("memory", [0.0, 0.6, 0.9])
def test_errors_from_blocks_hold_the_truth(memory):
    n, cases = 1000, 400
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShortSeries)
        found = [block_average(series) for series in ar1(np.random.default_rng(7), memory, (cases, n))]
    assert np.mean([abs(each.mean) <= student(each.blocks) * each.error for each in found]) == pytest.approx(
        0.95, abs=0.03)
    time = 0.5 * (1.0 + memory) / (1.0 - memory)
    assert np.median([each.correlation_time for each in found]) == pytest.approx(time, rel=0.08)
    exact = np.sqrt(2.0 * time / n)
    assert np.sqrt(np.mean([each.error**2 for each in found])) == pytest.approx(exact, rel=0.08)
    # As if the values were independent: far too small an error.
    if memory > 0.5:
        assert np.mean([abs(each.mean) <= 1.96 / np.sqrt(n) for each in found]) < 0.75
    assert {each.count for each in found} == {n} and max(each.blocks for each in found) <= 40


def test_a_mean_with_weights_is_that_of_all_parts():
    values, weights = np.array([1.0, 2.0, 4.0, 3.0, 9.0, 5.0]), np.array([1.0, 2.0, 0.0, 1.0, 1.0, 3.0])
    with pytest.warns(ShortSeries):
        found = block_average(values, weights, blocks=3)
    assert found.mean == pytest.approx((weights @ values) / 8.0)
    sums = [weights[k:k + 2] @ (values[k:k + 2] - found.mean) for k in (0, 2, 4)]
    assert found.error == pytest.approx(np.sqrt(1.5 * np.sum(np.square(sums))) / 8.0)
    assert found.blocks == 3
    # Independent values of weights that vary fourfold: the error is that of sum(w v)/sum(w).
    random = np.random.default_rng(9)
    weights = random.uniform(0.5, 2.0, 400)
    errors = [block_average(random.normal(size=400), weights).error for _ in range(50)]
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.sqrt(np.sum(weights**2)) / weights.sum(), rel=0.08)


def test_a_short_series_says_so():
    series = ar1(np.random.default_rng(1), 0.95, (100,))
    with pytest.warns(ShortSeries, match="correlation times, fewer than 20"):
        found = block_average(series)
    assert found.is_short and found.blocks == 4
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isnan(block_average([1.0, 2.0, 3.0]).error)
        assert block_average(np.ones(50)).error == 0.0
    for wrong in ([], [np.nan, 1.0], [[1.0, 2.0]]):
        with pytest.raises(ResultError, match="finite values"):
            block_average(wrong)
    with pytest.raises(ResultError, match="one weight per value"):
        block_average([1.0, 2.0], [1.0, -1.0])
    with pytest.raises(ResultError, match="2 to 5 blocks, not 6"):
        block_average(np.arange(5.0), blocks=6)


def test_the_mean_angle_of_a_surface_that_fluctuates():
    angles = 24.0 + 1.5 * ar1(np.random.default_rng(8), 0.8, (400,))
    angles[:100] += np.linspace(-20.0, 0.0, 100)  # the start, which `after` leaves out
    frames = []
    for k, degrees in enumerate(angles):
        slope = np.tan(np.radians(degrees))
        slabs = [np.array([(x, -9), (x + 1, -9), (x + 1, slope * (x + 1)), (x, slope * x)]) for x in range(-4, 4)]
        frames.append(Frame.from_polygons(slabs, time=0.25 * k))
    found = surface_angle(frames, after=25.0, columns=10)
    assert_allclose(found.angles, angles[100:], atol=1e-9)
    assert_allclose(found.times, 0.25 * np.arange(100, 400))
    assert found.mean == pytest.approx(angles[100:].mean())
    assert found.correlation_time == pytest.approx(0.25 * 4.5, rel=0.35)
    assert found.error == pytest.approx(1.5 * np.sqrt(9.0 / 300), rel=0.4)
    assert abs(found.mean - 24.0) < student(found.blocks) * found.error
    given = surface_angle(iter(frames), after=25.0, between=(-1.0, 3.5), columns=10, blocks=6)
    assert given.mean == pytest.approx(found.mean) and given.blocks == 6
    with pytest.raises(ResultError, match="no frames from 1000 s on"):
        surface_angle(frames, after=1000.0)


def test_the_angle_of_a_run(small_drum):
    run = Trajectory(small_drum)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShortSeries)
        found = surface_angle(run, after=0.1)
    late = run[run.times >= 0.1]
    bounds = late[0].bounds[late[0].free]
    low, high = bounds[:, 0].min(), bounds[:, 2].max()
    middle = 0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high
    assert_allclose(found.angles, [free_surface(frame, *middle).angle for frame in late])
    assert_array_equal(found.times, late.times)
    assert 4 <= found.blocks <= len(late) and found.error > 0.0


def falling(n_frames=5):
    """Squares that fall at 1 m/s in two columns, x = 0 and x = 5, one frame per second; a fixed one falls, too."""
    places = np.array([(0, y) for y in range(6)] + [(5, y) for y in range(3)] + [(0.2, 2.5)], dtype=float)
    held = [False] * 9 + [True]
    return [squares(places - np.array([0.0, 1.0 * k]), fixed=held, density=2.0, time=1.0 * k) for k in range(n_frames)]


def test_flow_through_a_line():
    flow = flow_rate(falling(), (-1, -0.5), (1, -0.5))
    assert_array_equal(flow.bodies, [1, 1, 1, 1])
    assert_allclose(flow.rate, 2.0)
    assert flow.mean == pytest.approx(2.0)
    assert_array_equal(flow_rate(falling(), (1, -0.5), (-1, -0.5)).bodies, [-1, -1, -1, -1])
    assert_array_equal(flow_rate(falling(), (-1, -0.5), (9, -0.5)).bodies, [2, 2, 2, 1])
    # What passes is what is beyond the line afterwards.
    frames = falling()
    beyond = [mass_beyond(frame, (0, -0.5), (0, -1)) for frame in frames]
    assert_allclose(np.diff(beyond), flow_rate(frames, (-1, -0.5), (9, -0.5)).mass)
    assert mass_beyond(frames[0], (0, 0.2), (0, -1)) == pytest.approx(2 * 2 * 0.7)
    assert mass_beyond(frames[0], (0, 1.2), (-2, -1)) == pytest.approx(
        sum(frames[0].density[k] * area_of(clip(frames[0].vertices[k], np.array([0, 1.2]), np.array([2, 1])))
            for k in range(9)))


def test_where_bodies_enter_or_leave_messages_name_what_to_use():
    """Finds a refusal without a remedy, and displacements from one body to another."""
    frames = [squares([(0, 0), (3, 0)], time=0.0), squares([(0, 1)], time=1.0)]
    with pytest.raises(ResultError, match="use run.departures, .*time_series.* or mass_beyond of each frame"):
        flow_rate(frames, (-1, 0.5), (1, 0.5))
    other = dataclasses.replace(frames[1], id=np.array([7]))
    with pytest.raises(ResultError, match="not the same ones; if some enter or leave, choose"):
        mean_squared_displacement([frames[1], other])


def test_mixing_of_separate_and_of_mixed_kinds():
    places = np.array([(x + 0.5, y + 0.5) for y in range(16) for x in range(16)])
    frame = squares(places)
    halves = places[:, 0] < 8
    assert lacey_index(frame, halves, 4.0) == pytest.approx(0.0, abs=1e-12)
    board = (places.sum(axis=1) % 2) < 1
    # Every cell has the mean share: the variance vanishes, below that of a random mixture.
    assert lacey_index(frame, board, 4.0) == pytest.approx(1.0 / (1.0 - 16 / 256))
    random = np.random.default_rng(1)
    mixed = [lacey_index(frame, random.permutation(halves), 4.0) for _ in range(400)]
    assert np.mean(mixed) == pytest.approx(1.0, abs=0.01)
    with pytest.raises(ResultError, match="both kinds"):
        lacey_index(frame, np.ones(256, bool), 4.0)
    with pytest.raises(ResultError, match="choose larger cells"):
        lacey_index(frame, halves, 0.5)


def test_mean_squared_displacement_of_flight_and_of_oscillation():
    frames = [squares([(3.0 * t, 4.0 * t), (5.0, 0.0)], fixed=[False, True], time=t) for t in 0.5 * np.arange(6)]
    found = mean_squared_displacement(frames)
    assert_allclose(found.lag, 0.5 * np.arange(6))
    assert_allclose(found.square, (5.0 * found.lag) ** 2, atol=1e-24)
    assert_array_equal(found.count, [6, 5, 4, 3, 2, 1])
    assert_allclose(mean_squared_displacement(frames, [0], relative=True).square, 0.0, atol=1e-24)
    # One period of x = cos t: <(x(t + lag) - x(t))^2> over all t of whole periods is 1 - cos(lag) ... but for the ends.
    n = 24
    times = 2 * np.pi * np.arange(3 * n) / n
    swing = mean_squared_displacement([squares([(np.cos(t), 0.0)], time=t) for t in times])
    assert_allclose(swing.square[n], 0.0, atol=1e-24)
    assert swing.square[n // 2] == pytest.approx(4 * np.mean(np.cos(times[: 3 * n - n // 2]) ** 2))
    with pytest.raises(ResultError, match="not equally spaced"):
        mean_squared_displacement([*frames, squares([(0, 0), (1, 0)], fixed=[False, True], time=2.6)])
    # Frames at the steps of 0.3 nearest to multiples of 1: their intervals differ by a step.
    near = [dataclasses.replace(squares([(0.3 * step, 0.0)], time=0.3 * step), step=step) for step in (0, 3, 7, 10, 13)]
    assert mean_squared_displacement(near).square[4] == pytest.approx(3.9**2)
    with pytest.raises(ResultError, match="not equally spaced"):
        mean_squared_displacement([*near, dataclasses.replace(near[-1], step=14, time=4.2)])


# --- documentation -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in analysis.__all__ if name != "Window"])
def test_every_measure_says_what_it_is(name):
    entry = getattr(analysis, name)
    text = inspect.getdoc(entry)
    assert text and not text.startswith(f"{name}(")
    if name in ("solid_fraction", "fabric_tensor", "anisotropy", "stress_tensor", "body_stress", "coarse_grain", "lucy",
                "free_surface", "flow_rate", "lacey_index", "mean_squared_displacement", "force_distribution",
                "rattlers", "coordination_number", "profile"):
        assert any(f"({year})" in text for year in range(1900, 2027)) or "1927" in text, "no source"
    if dataclasses.is_dataclass(entry):
        columns = columns_of(entry)
        assert set(field_names(entry)) <= set(columns)
        properties = {key for key, value in vars(entry).items() if isinstance(value, property)}
        assert properties <= set(columns)
        assert {column.unit for key, column in columns.items() if "stress" in key} <= {"N/m2"}
