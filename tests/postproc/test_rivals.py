"""Speed against error beside other codes: right answers of the problems, and what made-up points say."""

import csv
import math
from dataclasses import fields, replace

import numpy as np
import pytest
from polydem_lab.rivals import collectives, problems
from polydem_lab.rivals.codes import CODES, RIVALS, polydem
from polydem_lab.rivals.figures import REQUESTED, rivals_drawings
from polydem_lab.rivals.measure import threshold
from polydem_lab.rivals.points import Comparison, order_in_stiffness, read_comparison
from polydem_lab.rivals.problems import PROBLEMS, Collective, Threshold
from polydem_lab.rivals.report import publish, write_rivals_report
from polydem_lab.rivals.runs import Run, steps_per_sample
from polydem_lab.rivals.samples import FILE, ORIGIN, Sample, read_samples
from polydem_lab.rivals.scene import ANGLE, VX, VY, X, Y, area_and_inertia, box, kinetic, regular
from polydem_lab.rivals.tables import all_tables
from polydem_post.base.result_file import ResultError


def states_of(scene):
    """The states at the start of a scene, at all samples."""
    start = [(b.x, b.y, b.angle, b.vx, b.vy, b.spin) for b in scene.bodies]
    return np.array([start] * (scene.samples + 1), dtype=float)


# --- right answers -----------------------------------------------------------------------------------------------


def test_a_rigid_block_slides_by_theory():
    problem = PROBLEMS["slide"]
    scene = problem.scene(1)
    states = states_of(scene)
    # a = g (sin - mu cos), 30 degrees, friction 0.5, 2 s
    states[-1, 0, X] += 0.5 * 9.81 * (0.5 - 0.5 * math.sqrt(0.75)) * 4.0
    assert problem.error(states, scene) == pytest.approx(0.0, abs=1e-12)
    states[-1, 0, X] *= 1.5
    assert problem.error(states, scene) == pytest.approx(0.5)


def test_a_block_below_the_limit_of_friction_stays():
    scene = PROBLEMS["creep"].scene(1)
    along, across = scene.gravity
    assert along / -across == pytest.approx(0.98 * scene.friction)
    assert PROBLEMS["creep"].error(states_of(scene), scene) == 0.0


@pytest.mark.parametrize("name, restitution", [("headon_elastic", 1.0), ("headon_half", 0.5)])
def test_faces_part_with_the_restitution(name, restitution):
    scene = PROBLEMS[name].scene(1)
    states = states_of(scene)
    assert set(states[0, :, VX]) == {1.0, -1.0}
    states[-1, :, VX] *= -restitution
    assert PROBLEMS[name].error(states, scene) == 0.0
    states[-1, :, VX] *= 0.9
    assert PROBLEMS[name].error(states, scene) == pytest.approx(0.1 * restitution)


@pytest.mark.parametrize("restitution, friction, speed", [(0.5, 0.0, 0.0), (1.0, 0.0, 0.0), (0.5, 0.2, 2.0)])
def test_a_corner_leaves_with_the_restitution_and_the_limit_of_friction(restitution, friction, speed):
    vx, vy, spin = problems.after_corner(restitution, friction, speed)
    corners = problems.turned(box(1.0, 1.0).vertices, problems.TILT)
    x, y = corners[np.argmin(corners[:, 1])]
    assert vy + spin * x == pytest.approx(restitution * problems.FALL)
    normal, tangential = vy + problems.FALL, vx - speed
    assert tangential == pytest.approx(-friction * normal)
    # the angular momentum about the point of contact
    assert spin / 6.0 == pytest.approx(x * normal - y * tangential)
    assert (vx - spin * y) * speed >= 0.0
    if restitution == 1.0:
        assert vx**2 + vy**2 + spin**2 / 6.0 == pytest.approx(problems.FALL**2)


def test_squares_that_leave_so_have_no_error():
    scene = PROBLEMS["corner_slip"].scene(1)
    states = states_of(scene)
    lowest = [body.corners()[:, 1].min() for body in scene.bodies[:-1]]
    assert min(lowest) == pytest.approx(problems.gaps().min())
    assert max(lowest) < scene.duration * problems.FALL
    states[-1, :-1, VX:] = problems.after_corner(0.5, 0.2, 2.0)
    assert PROBLEMS["corner_slip"].error(states, scene) == 0.0
    states[-1, :-1, VY] += 0.1
    assert PROBLEMS["corner_slip"].error(states, scene) == pytest.approx(0.1)


def test_the_ladder_stands_up_to_the_limit_of_friction_at_both_ends():
    centre, foot, head, angle = problems.ladder_corners(problems.ladder_answer())
    assert math.tan(angle) == pytest.approx(1.0 / problems.ladder_answer())
    # foot: N upwards, grip N to the right; head: grip P upwards, P = grip N to the left; weight 1 at the centre
    below = 1.0 / (1.0 + problems.GRIP**2)
    against = problems.GRIP * below
    (rx, ry), (gx, _) = head - foot, centre - foot
    assert rx * problems.GRIP * against + ry * against - gx == pytest.approx(0.0, abs=1e-12)


def test_loads_of_one_are_the_right_answers():
    along, across = PROBLEMS["topple"].scene(1.0).gravity
    assert along / -across == pytest.approx(1.0 / 4.0)
    blocks = PROBLEMS["lean"].scene(1.0).bodies[:-1]
    above = [np.mean([block.x for block in blocks[k:]]) for k in range(1, len(blocks))]
    assert max(centre - below.x for centre, below in zip(above, blocks)) == pytest.approx(0.5)


def test_what_falls_is_seen_and_what_stands_is_not():
    for name, column, amount in (("topple", ANGLE, -0.5), ("ladder", X, -0.1), ("lean", Y, -0.5)):
        scene = PROBLEMS[name].scene(0.9)
        states = states_of(scene)
        assert PROBLEMS[name].error(states, scene) is True
        states[-1, 0, column] += amount
        assert PROBLEMS[name].error(states, scene) is False


@pytest.mark.parametrize("answer", [0.5, 0.9, 0.999, 1.003, 1.4])
def test_a_threshold_is_found_within_the_last_bisection(answer):
    problem = Threshold("topple", "", "", lambda load: load, lambda load, scene: load < answer)
    found = threshold(lambda scene, *_: Run(scene, (), 0), problem, {}, 1.0)
    assert abs(math.log10(abs(found - 1.0) / abs(answer - 1.0))) < 2.0 / 2**5 + 1e-12
    assert (found > 1.0) == (answer > 1.0)


def test_the_stack_measures_the_greatest_displacement():
    problem = PROBLEMS["stack"]
    scene = problem.scene(1)
    states = states_of(scene)
    states[-1, 3, X] += 0.03
    states[-1, 3, ANGLE] += 0.08
    assert problem.error(states, scene) == pytest.approx(0.05)


def test_the_gas_has_its_energy_and_error():
    scene = PROBLEMS["gas"].scene(2)
    states = states_of(scene)
    area, _ = area_and_inertia(regular(6, 1.0).vertices)
    assert kinetic(states, scene)[0] == pytest.approx([0.5 * scene.density * 100 * area * 25.0, 0.0])
    covered = 100 * area / (scene.bodies[100].corners()[:, 0].max() - 4.0) ** 2
    assert covered == pytest.approx(0.3)
    states[1:, :, VX:] *= math.sqrt(1.01)
    assert PROBLEMS["gas"].error(states, scene) == pytest.approx(0.01)
    assert not np.array_equal(states_of(PROBLEMS["gas"].scene(3))[0], states[0])


def test_the_wave_of_the_dominoes_has_its_speed():
    scene = PROBLEMS["domino"].scene(1)
    times = np.linspace(0.0, scene.duration, scene.samples + 1)
    states = states_of(scene)
    for k in range(collectives.DOMINOES):
        states[:, k, ANGLE] = -np.maximum(times - 0.1 * k, 0.0)
    assert collectives.train_speed(states, scene) == pytest.approx(5.0)
    assert PROBLEMS["domino"].error(states, scene) == pytest.approx(5.0 / collectives.SPEED - 1.0)
    assert math.isnan(collectives.train_speed(states_of(scene), scene))
    foot = scene.bodies[0].corners()[1]
    first = scene.bodies[0]
    arm = foot - np.array([first.x, first.y])
    assert (first.vx - first.spin * arm[1], first.vy + first.spin * arm[0]) == pytest.approx((0.0, 0.0))


def test_grains_that_leave_are_counted_over_time():
    scene = PROBLEMS["hopper"].scene(1)
    times = np.linspace(0.0, scene.duration, scene.samples + 1)
    states = states_of(scene)
    states[:, :500, Y] = np.where(times[:, None] * 60.0 > np.arange(500), -2.0, 1.0)
    assert PROBLEMS["hopper"].error(states, scene) == pytest.approx(60.0, rel=0.02)
    assert math.isnan(PROBLEMS["hopper"].error(states_of(scene), scene))


def test_depths_are_those_of_separating_axes():
    scene = collectives.dense_scene(1, count=4, width=10.0)
    states = states_of(scene)
    states[:, :4, :3] = [(2.0, 2.0, 0.0), (4.0, 2.0, 0.0), (6.0, 2.0, 0.0), (8.0, 2.0, 0.0)]
    assert collectives.greatest_depth(states, scene) == 0.0
    states[3, 1, X] = 2.0 + math.sqrt(0.75) * 1.0
    states[3, 0:2, ANGLE] = math.pi / 2.0  # faces to faces, 0.866 apart: they just touch
    assert collectives.greatest_depth(states, scene) == pytest.approx(0.0, abs=1e-9)
    states[3, 1, X] -= 0.03
    assert collectives.greatest_depth(states, scene) == pytest.approx(0.03)
    states[5, 2, Y] = math.sqrt(0.75) / 2.0 - 0.07
    assert collectives.greatest_depth(states, scene) == pytest.approx(0.07)


def test_close_pairs_are_all_pairs_that_are_close():
    points = np.random.default_rng(0).uniform(0.0, 5.0, (60, 2))
    first, second = collectives.close_pairs(points, 0.8)
    found = {frozenset(pair) for pair in zip(first.tolist(), second.tolist())}
    distance = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    assert found == {frozenset((i, j)) for i in range(60) for j in range(i) if distance[i, j] < 0.8}
    assert len(found) == len(first) > 20


@pytest.mark.parametrize("name", PROBLEMS)
def test_bodies_begin_apart_and_every_code_has_settings(name):
    problem = PROBLEMS[name]
    scene = problem.scene(0.9 if isinstance(problem, Threshold) else problem.seeds[0])
    assert len(scene.free) > 0
    assert all(area_and_inertia(body.vertices)[0] > 0.0 for body in scene.bodies)
    assert isinstance(problem, Collective) == (name == "hopper")
    for word in RIVALS:
        if not CODES[word].omits(problem):
            for series in CODES[word].series(problem):
                steps = [steps_per_sample(scene, knobs["dt"]) for knobs in series.knobs.values()]
                assert sorted(steps) == steps
                assert sorted(series.knobs) == list(series.knobs)
    assert polydem.DEFAULT in polydem.series(problem)[0].knobs
    other = polydem.series_of_law(problem, "polar")
    assert {series.column for series in other} == {"polydem, polar"}
    assert all(knobs["law"] == "polar" for series in other for knobs in series.knobs.values())
    assert not any("law" in knobs for series in polydem.series(problem) for knobs in series.knobs.values())


# --- what points say ---------------------------------------------------------------------------------------------


def sample(column, level, error, median, problem="slide", series=None, **changes):
    made = Sample(problem, column, series or column, level, "{}", 1, 0, "v1", "finished", error, median, median, 3,
                  100.0 * 2**level, math.nan, 1.0, "")
    return replace(made, **changes)


def made_up():
    """polydem is of order 1/2 and dear, Chipmunk of order 1 and cheap, Box2D stops at 1e-3."""
    made = [sample("polydem", 7 + k, 10.0 ** (-0.5 * k - 0.5), 1e-2 * 10.0 ** (0.5 * k)) for k in range(5)]
    made += [sample("polydem, polar", 7 + k, 10.0 ** (-k - 1), 2e-2 * 10.0 ** (0.5 * k)) for k in range(5)]
    made += [sample("Chipmunk", k, 10.0 ** (-k - 1), 1e-4 * 4**k) for k in range(4)]
    made += [sample("Box2D v3", k, max(3e-2 / 4**k, 1e-3), 5e-5 * 2**k, series="Box2D v3, stiff") for k in range(4)]
    made += [sample("Chipmunk", 0, math.nan, 3e-4, repeat=1, least=0.9e-4)]
    made += [sample("polydem", 12, math.nan, math.nan, status="failed", message="a guard stopped it", least=math.nan)]
    return made


def table_of(found, name, folder):
    return next(table for table in all_tables(found, folder) if table.name == "rivals_" + name)


def test_the_time_for_an_error_is_interpolated_and_needs_the_next_finer_point():
    found = Comparison(made_up())
    assert found.time_for("slide", "polydem", 1e-2) == pytest.approx(1e-2 * 10.0**1.5)
    assert found.time_for("slide", "polydem", 10.0**-1.75) == pytest.approx(1e-2 * 10.0**1.25)
    assert found.time_for("slide", "Chipmunk", 1e-4) == pytest.approx(1e-4 * 4**3)
    assert math.isinf(found.time_for("slide", "Box2D v3", 1e-4))
    lucky = [sample("Rapier", level, error, 1.0 + level) for level, error in enumerate((1e-5, 1e-1, 1e-3))]
    assert Comparison(lucky).time_for("slide", "Rapier", 1e-4) == math.inf
    assert Comparison(lucky).time_for("slide", "Rapier", 1e-3) == 3.0


def test_times_are_medians_and_least_of_the_repeats():
    point = next(p for p in Comparison(made_up()).points if (p.series, p.level) == ("Chipmunk", 0))
    assert (point.median, point.least, point.most, point.repeats) == pytest.approx((2e-4, 0.9e-4, 3e-4, 2))
    assert point.values == (0.1,)


def test_tables_compare_all_codes(tmp_path):
    (tmp_path / ORIGIN).write_text("polydem: v1\nSiconos: missing, it needs the Debian packages x\n", encoding="utf-8")
    found = Comparison(made_up())
    assert found.columns == ["polydem", "polydem, polar", "Box2D v3", "Chipmunk"]
    rows = {row[1]: row[2:] for row in table_of(found, "cheapest", tmp_path).rows}
    assert rows["0.01"] == ("3.2e-01", "6.3e-02", "8.7e-05", "4.0e-04", "3.7e+03")
    assert rows["0.0001"][2:] == ("-", "6.4e-03", "never")
    ratios = table_of(found, "ratios", tmp_path)
    assert ratios.heading == ("problem", "0.1", "0.01", "0.001", "0.0001")
    assert [(row[0], row[2], row[4]) for row in ratios.rows] == [("slide", "3.7e+03", "never")]
    assert table_of(found, "least", tmp_path).rows == [("slide", "3.2e-03", "1.0e-05", "1.0e-03", "1.0e-04", "-")]
    orders = {row[1]: row[-1] for row in table_of(found, "stiffness", tmp_path).rows}
    assert orders == {"default": "0.50", "polar": "1.0"}
    left = table_of(found, "left_out", tmp_path).rows
    assert ("Siconos", "everywhere", "it needs the Debian packages x") in left
    assert ("Yade", "everywhere", "") not in left
    assert ("polydem", "slide, level 12", "a guard stopped it") in left
    assert table_of(found, "spread", tmp_path).rows == [("Chipmunk", "3.33", "3.33", "3.33", "1")]


def test_the_profile_is_that_of_dolan_and_more(tmp_path):
    found = Comparison(made_up())
    ratios = found.profile(found.columns)
    assert {len(each) for each in ratios.values()} == {4}
    assert sum(ratio == 1.0 for each in ratios.values() for ratio in each) == 4
    assert ratios["Box2D v3"][-1] == math.inf
    assert ratios["polydem"][1] == pytest.approx(0.316 / 8.66e-5, rel=0.02)
    rows = {row[0]: row[1:] for row in table_of(found, "profile", tmp_path).rows}
    assert rows["Box2D v3"] == ("0.75", "0.75", "0.75", "0.75", "0.75", "0.75", "4")
    assert rows["polydem"][-2:] == ("0.50", "4")


def test_collective_values_are_compared_with_the_rivals_at_their_finest_steps(tmp_path):
    made = [sample("Chipmunk", level, value + seed, 1e-3, "hopper", seed=seed)
            for level, value in ((0, 50.0), (3, 40.0)) for seed in (-1, 0, 1)]
    made += [sample("Rapier", 3, 36.0 + seed, 1e-3, "hopper", seed=seed) for seed in (-1, 0, 1)]
    made += [sample("polydem", 9, 41.8 + seed, 1e-1, "hopper", seed=seed) for seed in (-1, 0, 1)]
    found = Comparison(made)
    mean, sampling = found.references["hopper"]
    assert (mean, sampling) == pytest.approx((38.0, math.sqrt(2.0 / 3.0) / 2.0))
    own = next(point for point in found.points if point.column == "polydem")
    assert (own.error, own.sampling) == pytest.approx((0.1, 1.0 / math.sqrt(3.0)))
    assert found.floor("hopper") == pytest.approx(2.0 * sampling / 38.0)
    assert [error for _, error in found.judged()] == [0.1]
    table = table_of(found, "collective", tmp_path)
    assert "38.0 +- " in table.note
    assert ("hopper", "polydem", "9", "41.8", "5.8e-01", "1.0e-01", "3", "1.0e-01", "51200") in table.rows
    assert "rivals_collective" in [drawing.name for drawing in rivals_drawings(found, tmp_path)]
    assert Comparison([sample("polydem", 9, 40.0, 1e-1, "hopper")]).references == {"hopper": None}


def test_seeds_of_other_problems_give_a_root_mean_square(tmp_path):
    made = [sample("Chipmunk", 0, error, 1e-3, "gas", seed=seed) for seed, error in enumerate((0.03, 0.04))]
    found = Comparison(made)
    assert found.points[0].error == pytest.approx(math.sqrt(0.00125))
    assert table_of(found, "seeds", tmp_path).rows == [("gas", "Chipmunk", "0", "3.5e-02", "4.0e-02", "2", "1.0e-03")]


def test_points_of_an_older_version_are_left_aside():
    made = [sample("polydem", 9, 0.5, 1.0), sample("Chipmunk", 0, 0.1, 1.0),
            sample("polydem", 9, 0.2, 2.0, version="v2")]
    found = Comparison(made)
    assert [(point.column, point.error) for point in found.points] == [("Chipmunk", 0.1), ("polydem", 0.2)]


def test_an_order_needs_three_stiffnesses():
    points = Comparison(made_up()).series("slide")["polydem", "polydem"]
    assert order_in_stiffness(points) == pytest.approx(0.5)
    assert math.isnan(order_in_stiffness(points[:2]))


def write(folder, samples):
    with (folder / FILE).open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow([each.name for each in fields(Sample)])
        rows.writerows([[getattr(each, field.name) for field in fields(Sample)] for each in samples])


def test_the_report_is_written_the_same_every_time_and_published(tmp_path):
    write(tmp_path, made_up())
    (tmp_path / FILE).write_text((tmp_path / FILE).read_text(encoding="utf-8") + "slide,pol", encoding="utf-8")
    assert len(read_samples(tmp_path)) == len(made_up())
    (tmp_path / REQUESTED).write_text("scene,requested,achieved\nstack,1e-2,8e-3\nstack,1e-3,2e-3\n", encoding="utf-8")
    page = write_rivals_report(tmp_path)[-1]
    first = page.read_text(encoding="utf-8")
    assert first.startswith("# Tables of speed against error beside other codes\n")
    assert "Points of v1." in first
    figures = {path.stem for path in (tmp_path / "report" / "figures").glob("*.png")}
    assert figures == {"rivals_all", "rivals_slide", "rivals_profile", "rivals_requested"}
    write_rivals_report(tmp_path, figures=False)
    assert page.read_text(encoding="utf-8") == first
    published = publish(tmp_path, tmp_path / "page")
    assert published.read_text(encoding="utf-8") == first
    assert (tmp_path / "page" / "rivals_profile.png").exists()
    assert (tmp_path / "page" / "tables" / "rivals_points.csv").read_text(encoding="utf-8").count("polar") == 10


def test_figures_have_every_series_and_the_floor(tmp_path):
    drawings = {drawing.name: drawing for drawing in rivals_drawings(Comparison(made_up()), tmp_path)}
    axis = drawings["rivals_slide"].figure.axes[1]
    assert len(axis.containers) == 4
    assert "way" in axis.get_ylabel()
    assert "rivals_requested" not in drawings
    (tmp_path / REQUESTED).write_text("scene,wanted\nstack,1e-2\n", encoding="utf-8")
    with pytest.raises(ResultError, match="needs the columns scene, requested and achieved"):
        rivals_drawings(Comparison(made_up()), tmp_path)


def test_files_of_something_else_are_refused(tmp_path):
    with pytest.raises(ResultError, match="there is no such file"):
        read_comparison(tmp_path)
    write(tmp_path, [])
    with pytest.raises(ResultError, match="there are no points"):
        read_comparison(tmp_path)
    for wrong in ({"problem": "marbles"}, {"status": "lost"}, {"median": -1.0}, {"column": "Havok"},
                  {"error": math.inf}):
        write(tmp_path, [replace(sample("polydem", 9, 0.1, 1.0), **wrong)])
        with pytest.raises(ResultError, match="is not a file of ./polydem rivals"):
            read_samples(tmp_path)
