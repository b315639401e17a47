"""Medians, ratios and slopes on data whose truth is known."""

import numpy as np
import pytest
from polydem_lab.bench import statistics


def coverage(estimate, truth, trials=300, seed=5):
    """Part of the trials in which the interval of estimate(random) holds the truth, and the mean width."""
    random = np.random.default_rng(seed)
    found = [estimate(random) for _ in range(trials)]
    return np.mean([each.low <= truth <= each.high for each in found]), np.mean(
        [each.high - each.low for each in found]
    )


@pytest.mark.parametrize("repeats, widest", [(7, 3.1), (20, 1.6)])
def test_the_interval_of_a_median_holds_the_truth_in_95_percent_and_is_not_idle(repeats, widest):
    covered, width = coverage(lambda random: statistics.median(random.normal(10.0, 1.0, repeats)), 10.0)
    assert covered >= 0.93
    assert width < widest


def test_the_interval_of_a_slope_holds_the_truth_in_95_percent_and_is_not_idle():
    sizes = np.array([2.5e3, 5e3, 1e4, 1e5, 1e6])

    def measured(random):
        return statistics.slope(sizes, [1e-3 * size**1.08 * random.lognormal(0.0, 0.05, 7) for size in sizes])

    covered, width = coverage(measured, 1.08)
    assert covered >= 0.93
    assert width < 0.03


def test_a_law_without_noise_is_found_exactly():
    sizes = np.array([1e3, 1e4, 1e5])
    found = statistics.slope(sizes, [np.full(7, 3.0 * size**0.75) for size in sizes])
    assert found.value == pytest.approx(0.75, abs=1e-12)
    assert (found.low, found.high) == pytest.approx((0.75, 0.75), abs=1e-12)
    assert statistics.intercept(sizes, 3.0 * sizes**0.75, 0.75) == pytest.approx(3.0)


def test_a_paired_ratio_does_not_see_drift_that_both_share():
    random = np.random.default_rng(3)
    drift = dict(enumerate(random.lognormal(0.0, 0.5, 9)))
    upper = {key: 0.9 * value for key, value in drift.items()}
    paired = statistics.median_of_ratios(upper, drift)
    apart = statistics.ratio_of_medians(list(upper.values()), list(drift.values()))
    assert (paired.value, paired.low, paired.high) == pytest.approx((0.9, 0.9, 0.9))
    assert apart.high - apart.low > 0.2


def test_repeats_that_only_one_of_two_has_are_left_out_of_their_ratio():
    found = statistics.median_of_ratios({1: 2.0, 2: 4.0, 3: 100.0}, {1: 1.0, 2: 2.0})
    assert (found.value, found.repeats) == (2.0, 2)


def test_the_median_of_an_even_number_and_the_least_are_right():
    found = statistics.median([4.0, 1.0, 2.0, 100.0])
    assert (found.value, found.least, found.repeats) == (3.0, 1.0, 4)


def test_the_same_data_have_the_same_interval():
    values = np.random.default_rng(1).lognormal(size=7)
    assert statistics.median(values) == statistics.median(values)


def test_nothing_measured_is_no_number_and_one_repeat_has_no_interval():
    assert not statistics.median([])
    assert not statistics.slope([10.0], [[1.0, 2.0]])
    assert not statistics.median_of_ratios({1: 1.0}, {2: 1.0})
    assert statistics.median([]).text() == "-"
    assert statistics.median([3.0]).text() == "3.00"


def test_students_quantile_agrees_with_tables():
    for freedom, quantile in ((1, 12.706), (6, 2.4469), (30, 2.0423)):
        assert statistics._student(0.025, freedom) == pytest.approx(-quantile, rel=1e-4)


@pytest.mark.parametrize(
    "value, text",
    [(0.0123456, "0.0123"), (123456.7, "123457"), (1e-7, "1.00e-07"), (0.0, "0"), (float("nan"), "-"), (-2.5, "-2.50")],
)
def test_numbers_are_written_with_three_digits(value, text):
    assert statistics.number(value) == text


def test_the_interval_of_a_slope_knows_that_a_power_law_does_not_fit():
    sizes = np.array([2.5e3, 5e3, 7.5e3, 1e4, 1.25e4])

    def measured(random):
        above = random.lognormal(0.0, 0.1, len(sizes))  # what caches do to a size is the same in all repeats
        return statistics.slope(sizes, [a * size * random.lognormal(0.0, 0.01, 7) for a, size in zip(above, sizes)])

    covered, _ = coverage(measured, 1.0)
    assert covered >= 0.93


def test_a_law_that_bends_has_a_growing_exponent():
    sizes = np.array([1e3, 1e4, 1e5])
    assert statistics.curvature(sizes, sizes**1.3) == pytest.approx(0.0, abs=1e-9)
    assert statistics.curvature(sizes, np.exp(0.05 * np.log(sizes) ** 2)) == pytest.approx(0.1 * np.log(10.0))
    assert np.isnan(statistics.curvature(sizes[:2], sizes[:2]))
