"""Speed against error, from made-up samples whose errors and times are known."""

import math

import numpy as np
import pytest
from polydem_lab.precision.figures import precision_drawings
from polydem_lab.precision.report import write_precision_report
from polydem_lab.precision.samples import Sample, choices_of, read_samples, references_of, result_text
from polydem_lab.precision.scenes import SCENES, Model, restitution, spread
from polydem_lab.precision.tables import all_tables, overall, recommendation
from polydem_lab.precision.work_precision import WorkPrecision, errors_of, fastest
from polydem_post.base.result_file import ResultError

SCENE, MODEL = "flat_impact", "area/rate/none"
DURATION = 1.0e-3


def sample(numerics, precision, steps, error=0.0, cost=1e-5, status="finished", repeat=0, scene=SCENE, model=MODEL):
    """A run in which two copies miss (1, 0, 0) by error and 3 error, which costs so much per step [s]."""
    values = np.array([[[1.0 + error, 0.0, 0.0], [1.0, 3.0 * error, 0.0]]])
    text = result_text(values) if status == "finished" and repeat == 0 else "what it said"
    seconds = cost * steps if status == "finished" else math.nan
    return Sample(scene, model, numerics, precision, steps, repeat, status, DURATION, seconds, 1.0 / steps, "0", text)


def made_up():
    """Verlet of first order, Gear of second, dearer and stopped at the largest step; single precision with a floor."""
    samples = [sample("gear, second order", "quadruple", steps, 1e-9 * 1024 / steps) for steps in (1024, 512)]
    for steps in (8, 16, 32, 64):
        samples += [sample("velocity_verlet", "double", steps, 0.1 / steps, repeat=repeat, cost=1e-5 * (1 + repeat))
                    for repeat in (0, 1)]
        samples.append(sample("velocity_verlet", "single", steps, max(0.1 / steps, 4e-3), cost=0.9e-5))
        if steps > 8:
            samples.append(sample("gear", "double", steps, 0.1 / steps**2, cost=2e-5))
    samples.append(sample("gear", "double", 8, status="stopped"))
    samples.append(sample("velocity_verlet", "double", 8, status="refused", model="area/unheard_of/none"))
    return samples


def curve(study, numerics, precision="double"):
    return next(c for c in study.curves if (c.numerics, c.precision) == (numerics, precision))


def test_errors_are_root_mean_square_and_worst_over_the_copies():
    values = np.array([[[1.0, 2.0], [3.0, 4.0]], [[0.3, 0.4], [0.0, 0.0]]])
    rms, worst, growth = errors_of(values, np.zeros_like(values))
    assert rms == pytest.approx(0.5 / math.sqrt(2.0))
    assert worst == pytest.approx(0.5)
    assert growth == pytest.approx((math.sqrt(15.0), 0.5 / math.sqrt(2.0)))


def test_without_a_reference_all_moments_count_but_those_with_contacts():
    values = np.array([0.1, math.nan, -0.3])[:, None, None]
    rms, worst, growth = errors_of(values, None)
    assert (rms, worst) == pytest.approx((math.sqrt(0.05), 0.3))
    assert math.isnan(growth[1])


def test_orders_are_those_of_the_errors():
    study = WorkPrecision(made_up())
    floor = study.floor(SCENE, MODEL)
    assert floor == pytest.approx(1e-9 * math.sqrt(5.0), rel=1e-6)
    assert curve(study, "velocity_verlet").order(floor) == pytest.approx(1.0, abs=1e-4)
    assert curve(study, "gear").order(floor) == pytest.approx(2.0, abs=1e-4)
    assert curve(study, "gear").order(floor, worst=True) == pytest.approx(2.0, abs=1e-4)
    assert math.isnan(curve(study, "gear").order(1e-3))


def test_times_are_the_least_of_the_repeats_per_simulated_second():
    point = curve(WorkPrecision(made_up()), "velocity_verlet").points[0]
    assert (point.least, point.median, point.repeats) == pytest.approx((0.08, 0.12, 2))
    assert point.dt == pytest.approx(DURATION / 8)


def test_the_time_for_an_error_is_interpolated_and_never_extrapolated():
    study = WorkPrecision(made_up())
    verlet, single = curve(study, "velocity_verlet"), curve(study, "velocity_verlet", "single")
    rms = math.sqrt(5.0) * 0.1
    time, dt, share = verlet.time_for(rms / 24.0)
    assert (time, dt, share) == pytest.approx((0.24, DURATION / 24, 1.0 / 24))
    assert verlet.time_for(rms / 65.0) is None
    assert verlet.time_for(1.0)[0] == pytest.approx(0.08)
    assert single.time_for(rms / 32.0) is None


def test_an_error_that_comes_back_at_smaller_steps_does_not_count_as_reached():
    samples = [sample("velocity_verlet, second order", "quadruple", steps) for steps in (1024, 512)]
    samples += [sample("gear", "double", steps, error) for steps, error in ((8, 1e-6), (16, 1e-2), (32, 1e-3))]
    assert curve(WorkPrecision(samples), "gear").time_for(1e-4) is None


def test_the_fastest_choice_depends_on_the_error():
    study = WorkPrecision(made_up())
    curves = study.curves_of(SCENE, MODEL)
    assert fastest(curves, 0.1)[0].precision == "single"
    assert fastest(curves, 1e-4)[0].numerics == "gear"
    assert fastest(curves, 1e-7) is None


def test_tables_recommend_count_and_tell_what_is_missing():
    study = WorkPrecision(made_up())
    rows = {row[0]: row for row in recommendation(study).rows}
    assert rows["0.1"][1:4] == ("velocity_verlet", "single", "1 of 1")
    assert rows["0.001"][1:4] == ("gear", "double", "1 of 1")
    assert "1e-05" not in rows
    assert ("0.001", "velocity_verlet", "double", "0 of 1", "0", "-") in overall(study).rows
    tables = {table.name: table for table in all_tables(study)}
    assert tables["workprecision_left_out"].rows == [(SCENE, "area/unheard_of/none", "velocity_verlet", "what it said")]
    assert tables["workprecision_stopped"].rows == [(SCENE, MODEL, "gear", "double", "8")]


def test_the_recommendation_compares_times_on_the_same_pairs():
    # Second order is offered in one of two pairs, and is the fastest there; in the other it is as slow as first order.
    damped, elastic = "area/rate/none", "area/none/none"
    samples = [sample("gear", "quadruple", steps, model=model) for model in (damped, elastic) for steps in (1024, 512)]
    costs = {(damped, "velocity_verlet"): 1.2e-5, (damped, "velocity_verlet, second order"): 1e-5,
             (damped, "gear"): 2e-5, (elastic, "velocity_verlet"): 1e-4, (elastic, "gear"): 1e-5}
    samples += [sample(numerics, "double", steps, 1e-9, cost, model=model)
                for (model, numerics), cost in costs.items() for steps in (8, 16)]
    study = WorkPrecision(samples)
    assert recommendation(study).rows[0][1:6] == ("gear", "double", "2 of 2", "1.41", "2")
    rows = {row[1]: row[3:] for row in overall(study).rows if row[0] == "0.1"}
    assert rows == {"velocity_verlet": ("2 of 2", "0", "3.46"), "gear": ("2 of 2", "1", "1.41"),
                    "velocity_verlet, second order": ("2 of 2", "1", "3.16")}


def test_a_model_without_a_reference_gives_no_points():
    samples = [each for each in made_up() if each.precision != "quadruple"]
    assert WorkPrecision(samples).curves == []


def test_figures_have_a_panel_per_model_and_every_curve():
    drawing = precision_drawings(WorkPrecision(made_up()))[0]
    panel = drawing.figure.axes[1]
    assert panel.get_title() == "area, rate, none"
    assert len(panel.containers) == 3


def test_the_report_is_written_and_the_same_every_time(tmp_path):
    lines = [",".join(Sample.__dataclass_fields__)]
    lines += [",".join(f'"{value}"' for value in each.__dict__.values()) for each in made_up()]
    (tmp_path / "samples.csv").write_text("\n".join(lines) + "\nflat_impact,area/rate", encoding="utf-8")
    assert len(read_samples(tmp_path)) == len(made_up())
    page = write_precision_report(tmp_path)[-1]
    first = page.read_text(encoding="utf-8")
    origin = "Samples of a revision that is not recorded."
    assert first.startswith(f"## Speed against error\n\n{origin}\n\n### Recommendation\n")
    assert (tmp_path / "report" / "figures" / "workprecision_flat_impact.svg").exists()
    write_precision_report(tmp_path, figures=False)
    assert page.read_text(encoding="utf-8") == first
    (tmp_path / "programs.txt").write_text("double: polydem 0.1.0 (git abc)\n", encoding="utf-8")
    told = write_precision_report(tmp_path, figures=False)[-1].read_text(encoding="utf-8")
    assert told.count("Samples of double: polydem 0.1.0 (git abc).") > 1


def test_files_of_something_else_are_refused(tmp_path):
    with pytest.raises(ResultError, match="there is no such file"):
        read_samples(tmp_path)
    (tmp_path / "samples.csv").write_text("scene,steps\nflat_impact,many\n", encoding="utf-8")
    with pytest.raises(ResultError, match="is not a file of ./polydem workprecision"):
        read_samples(tmp_path)


def test_theory_agrees_with_known_values():
    assert restitution(Model("area", "none", "none")) == 1.0
    assert restitution(Model("area", "rate", "none")) == pytest.approx(0.74408, abs=1e-5)
    assert restitution(Model("area", "matuttis_chen", "none")) == pytest.approx(0.74779, abs=1e-5)
    e = restitution(Model("area", "hunt_crossley", "none"))
    u = 250.0 * math.sqrt(0.25 / 1e7) / 0.01 * 0.1
    assert u - math.log(1.0 + u) == pytest.approx(-e * u - math.log(1.0 - e * u), abs=1e-12)


def test_copies_are_spread_over_every_step():
    for period in (1.0, 0.5, 0.25, 0.125):
        phases = np.sort(np.mod(spread(32), period)) / period
        gaps = np.diff(np.concatenate([phases, [phases[0] + 1.0]]))
        assert gaps.max() < 5.0 / 32.0


def test_every_scene_has_its_namelist_and_steps_that_end_together():
    for scene in SCENES.values():
        assert scene.duration > 0.0
        for steps in (*scene.steps, scene.reference, scene.reference // 2):
            assert steps % scene.moments == 0
        assert scene.reference == 0 or scene.reference >= 4 * max(scene.steps)
        assert len(set(choices_of(scene, ("double", "single")))) > 0
        assert all(choice.precision == "quadruple" for choice in references_of(scene))
