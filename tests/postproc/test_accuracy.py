"""Errors of one quantity from made-up values: orders, what is refused, what is noise, what keeps a tolerance."""

import math

import pytest
from polydem_post import Frame
from polydem_post.accuracy.estimate import (
    CONVERGED,
    FITTED,
    NOISE,
    REFUSED,
    bound,
    estimate,
    integrate,
    needs_separation,
    noise_of,
    separated,
)
from polydem_post.accuracy.quantities import horizon, parse, usual_quantities
from polydem_post.base.result_file import ResultError

#: Rounding errors of the made-up values
TINY = 1e-15


def steps(order, error, limit=1.0):
    """Values at steps whose errors have an order; `error` is that of the step 1."""
    return {step: limit + error * step**order for step in (0.5, 1.0, 2.0, 4.0)}


def stiff(order, distance, limit=1.0):
    """Values at stiffnesses whose distances have an order; `distance` is that of the stiffness 1."""
    return {factor: limit + distance * factor**-order for factor in (0.25, 1.0, 4.0, 16.0)}


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0])
def test_the_order_in_dt_is_measured_and_the_limit_found(order):
    found = integrate(steps(order, 1e-3), TINY)
    assert found.order == pytest.approx(order, rel=1e-6)
    assert found.limit == pytest.approx(1.0, abs=1e-12)
    assert found.error(1.0) == pytest.approx(1e-3, rel=1e-6)
    assert found.error(4.0) == pytest.approx(1e-3 * 4**order, rel=1e-6)


@pytest.mark.parametrize("values", [
    {0.5: 1.001, 1.0: 1.002, 2.0: 1.001},       # changes sign
    {0.5: 1.001, 1.0: 1.002, 2.0: 1.0021},      # order below 0.7
    {0.5: 1.001, 1.0: 1.002}])                  # the coarse window failed
def test_without_an_order_in_dt_the_error_is_that_of_order_1(values):
    found = integrate(values, TINY)
    assert found.order is None
    assert found.error(1.0) == pytest.approx(2.0 * 1e-3)
    assert found.error(0.5) == pytest.approx(1e-3)


def test_the_widest_stable_step_with_a_small_error_is_taken():
    found = integrate(steps(2.0, 1e-3), TINY)
    assert found.widest(5e-3, {0.5, 1.0, 2.0, 4.0}) == 2.0
    assert found.widest(1e-1, {0.5, 1.0, 2.0}) == 2.0
    assert found.widest(1e-3 / 16.0, set(steps(1, 1))) == pytest.approx(0.9 * 0.25, rel=1e-6)
    wild = integrate({**steps(2.0, 1e-3), 4.0: 1.0}, TINY)
    assert wild.widest(2e-3, {0.5, 1.0, 2.0, 4.0}) == 1.0


@pytest.mark.parametrize("order", [0.25, 0.5, 1.0])
def test_the_order_in_the_stiffness_is_fitted_and_the_limit_extrapolated(order):
    values = stiff(order, 0.05)
    found = estimate(values, integrate(steps(2.0, 1e-7, values[1.0]), TINY), TINY, 1e-2)
    assert (found.state, found.order) == (FITTED, pytest.approx(order, rel=1e-6))
    assert found.limit == pytest.approx(1.0, abs=1e-12)
    assert found.distance == pytest.approx(0.05, rel=1e-6)
    assert found.doubt < 1e-10
    assert 0.05 * found.stiffness(1e-2) ** -order == pytest.approx(5e-3, rel=1e-6)


def test_an_order_that_changes_is_a_doubt_and_asks_for_more_stiffness():
    values = stiff(0.5, 0.05)
    values[0.25] = values[1.0] + 1.5 * (values[1.0] - values[4.0])
    found = estimate(values, integrate(steps(2.0, 1e-7), TINY), TINY, 1e-2)
    softer = math.log(1.5) / math.log(4.0)
    assert found.low_order == pytest.approx(softer, rel=1e-6)
    steady = (values[1.0] - values[4.0]) / (4.0**softer - 1.0)
    assert found.doubt == pytest.approx(abs(1.0 - (values[4.0] - steady)), rel=1e-6)
    assert found.stiffness(1e-2) > 2.0 * (0.05 / 5e-3) ** 2


def test_without_softer_windows_the_last_correction_is_the_doubt():
    values = stiff(0.5, 0.05)
    del values[0.25]
    found = estimate(values, integrate(steps(2.0, 1e-7), TINY), TINY, 1e-2)
    assert found.doubt == pytest.approx(0.05 / 4.0, rel=1e-6)


@pytest.mark.parametrize("values, reason", [
    ({1.0: 1.0, 4.0: 1.02, 16.0: 1.0}, "change sign"),
    ({1.0: 1.0, 4.0: 1.02, 16.0: 1.044}, "order -"),
    ({1.0: 1.0, 4.0: 1.02, 16.0: 1.0385}, "order 0.06"),
    ({1.0: 1.0, 4.0: 1.02, 16.0: 1.0205}, "order 2.66")])
def test_what_has_no_order_that_is_believed_is_refused(values, reason):
    found = estimate(values, integrate(steps(2.0, 1e-7), TINY), TINY, 1e-2)
    assert found.state == REFUSED and reason in found.reason and not found.is_usable


def test_small_differences_need_no_order():
    values = {0.25: 1.003, 1.0: 1.0, 4.0: 1.0002, 16.0: 1.0}
    found = estimate(values, integrate(steps(2.0, 1e-7), TINY), TINY, 1e-2)
    assert found.state == CONVERGED
    assert bound(values, 1.0, TINY) == pytest.approx(2e-4 / (1.0 - 4.0**-0.15))
    assert found.stiffness(1e-2) == 1.0
    assert found.stiffness(5e-2) == 0.25


def test_noise_is_the_spread_of_last_bits_or_what_is_not_smooth_in_the_stiffness():
    assert noise_of(1.0, [1.0 + 3e-6, 1.0 - 1e-6], [1.01, 0.99]) == pytest.approx(4e-6)
    assert noise_of(1.0, [1.0, 1.0], [1.01, 1.02]) == pytest.approx(3e-2)
    smooth = [1.0 + 0.05 * factor**-0.5 for factor in (1.0, 1.03, 1.0 / 1.03)]
    assert noise_of(smooth[0], [], smooth[1:]) < 5e-5


def test_noise_is_never_fitted():
    values = stiff(0.5, 0.05)
    found = estimate(values, integrate(steps(2.0, 1e-7), TINY), 4e-3, 1e-2)
    assert found.state == NOISE and found.order is None and "last bits" in found.reason
    found = estimate(values, integrate(steps(2.0, 1e-7), TINY), 0.0125 / 2.0, 2e-2)
    assert found.state == NOISE and "differences" in found.reason
    assert integrate(steps(2.0, 1e-3), 1.5e-3).order is None


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_integration_errors_are_separated_from_differences_of_stiffness(order):
    exact = stiff(0.5, 0.05)
    integration = integrate({step: exact[1.0] + 1e-2 * step**order for step in (0.5, 1.0, 2.0)}, TINY)
    raw = {factor: value + 1e-2 for factor, value in exact.items()}
    raw[16.0] = exact[16.0] - 1e-2
    assert needs_separation(raw, integration, TINY, 1e-2)
    assert not needs_separation(exact, integrate(steps(2.0, 1e-5), TINY), TINY, 1e-2)
    assert not needs_separation({factor: 1.0 + 1e-6 * factor for factor in exact}, integration, TINY, 1e-2)
    pairs = {factor: (value + error, value + error / 2.0**order) for (factor, value), error in
             zip(exact.items(), (1e-2, 0.0, 1e-2, -1e-2)) if factor != 1.0}
    values, doubt = separated(pairs, integration)
    assert doubt == 0.0
    found = estimate({**values, 1.0: integration.limit}, integration, TINY, 1e-2, doubt)
    assert found.order == pytest.approx(0.5, abs=1e-9)


def test_without_an_order_in_dt_the_halves_are_in_doubt():
    integration = integrate({0.5: 1.001, 1.0: 1.002}, TINY)
    values, doubt = separated({4.0: (1.2, 1.19), 16.0: (1.1, 1.095)}, integration)
    assert values == {4.0: 1.19, 16.0: 1.095} and doubt == pytest.approx(0.01)


# --- quantities --------------------------------------------------------------------------------------------------


class Run(list):
    """Frames that stand for a trajectory, with columns of a series."""

    balance_units = {"kinetic": "J/m"}
    time_series_units = {"kinetic_energy": "J/m", "time": "s"}
    energy_balance = {"kinetic": [0.0, 4.0, -6.0]}
    time_series = {"kinetic_energy": [math.nan, 1.0, 3.0], "time": [0.0, 1.0, 2.0]}
    settings = {"sink": {"bin": None}}


def run_of(*places, number=1):
    """A run in which squares of side 2 are at these places, and turn as far as they are high."""
    square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    frames = Run()
    for time, place in enumerate(places):
        outlines = [[(x + place[0] + 9.0 * k, y + place[1]) for x, y in square] for k in range(number)]
        frame = Frame.from_polygons(outlines, velocity=[place] * number, angular_velocity=[place[1]] * number,
                                    time=float(time), density=1.0)
        object.__setattr__(frame, "angle", frame.angle + place[1])
        frames.append(frame)
    return frames


def value_and_scale(word, run):
    quantity = parse(word, run)
    return quantity.value(run), quantity.scale(run)


def test_quantities_of_bodies_have_the_scale_of_their_rim():
    run = run_of((0.0, 0.0), (3.0, 4.0), (2.0, 1.0))
    rim = math.sqrt(2.0) * 4.0
    assert value_and_scale("body.1.x", run) == pytest.approx((2.0, rim))
    assert value_and_scale("body.1.y", run) == pytest.approx((1.0, rim))
    assert value_and_scale("body.1.angle", run) == pytest.approx((1.0, 4.0))
    assert value_and_scale("body.1.vx", run) == pytest.approx((2.0, rim))
    assert value_and_scale("body.1.spin", run) == pytest.approx((1.0, 4.0))
    assert value_and_scale("body.1.x=0.5", run) == pytest.approx((2.0, 0.5))
    several = run_of((0.0, 0.0), (3.0, 4.0), (2.0, 1.0), number=4)
    assert value_and_scale("centre.y", several) == pytest.approx((1.0, 5.0))


def test_columns_have_a_last_value_and_a_mean_without_what_is_not_a_number():
    run = run_of((0.0, 0.0), (1.0, 0.0))
    assert value_and_scale("kinetic_energy", run) == (3.0, 3.0)
    assert value_and_scale("kinetic_energy:mean", run) == pytest.approx(((1.0 + 0.5 * 3.0) / 1.5, 3.0))
    assert value_and_scale("kinetic", run) == (-6.0, 6.0)
    assert value_and_scale("kinetic:mean", run) == pytest.approx((0.5, 6.0))


def test_flow_counts_what_passes_a_line():
    run = run_of((0.0, 1.0), (0.0, -1.0), (0.0, -3.0))
    assert value_and_scale("flow:2,0,-2,0", run) == pytest.approx((-4.0, 4.0))
    assert value_and_scale("flow:-2,0,2,0", run)[0] == pytest.approx(4.0)


@pytest.mark.parametrize("word", ["time", "kinetic:median", "body.2.x", "body.1.z", "centre.angle", "flow:0,0,1",
                                  "body.1.x=0", "body.1.x=-1", "body.1.x=nan"])
def test_what_is_no_quantity_is_an_error(word):
    with pytest.raises(ResultError, match="--quantity"):
        parse(word, run_of((0.0, 0.0), (1.0, 0.0)))


def test_usual_quantities_are_those_of_few_bodies_or_of_all():
    assert usual_quantities(run_of((0.0, 0.0))) == ["body.1.x", "body.1.y", "body.1.angle"]
    assert usual_quantities(run_of((0.0, 0.0), number=4)) == ["centre.x", "centre.y", "kinetic_energy:mean", "bin.mass"]


def test_the_horizon_is_the_last_frame_before_bodies_differ():
    run = run_of((0.0, 0.0), (1.0, 0.0), (2.0, 0.0))
    near = run_of((0.0, 0.0), (1.02, 0.0), (2.2, 0.0))
    diameter = 2.0 * math.sqrt(2.0)
    assert horizon(run, [run, near], 0.3 / diameter) is None
    assert horizon(run, [run, near], 0.1 / diameter) == 1.0
    assert horizon(run, [near], 0.01 / diameter) == 0.0
