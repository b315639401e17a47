"""The model of the fine-grained sweep on samples whose truth it knows."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from polydem_post.bench import read_bench
from polydem_post.fine_grained import PARTITIONED, Waiting, agreement, contests, fine_grained_tables
from polydem_post.series import TREE
from synthetic_bench import Truth, write_sample

BOXES = 10000
#: Time of a step on one thread [s]: of the sweep 100 us, of which threads share 90; of the tree 300 us,
#: of which search and filter take 225
SWEEP = Truth(10.0, 1.0, (0.9, 0.0, 0.05, 0.03, 0.02, 0.0), counts={"swaps": 0.5, "passes": 2.0 / BOXES})
TREE_TRUTH = Truth(30.0, 1.0, (0.1, 0.5, 0.25, 0.1, 0.05, 0.0))
#: Cost of a barrier and of a region for each thread more [s]
BARRIER, REGION = 22e-6, 2e-6


def sweep_time(n):
    return 10e-6 + 90e-6 / n + (n > 1) * (2 * BARRIER * n + REGION * n)


def tree_time(n):
    return 75e-6 + 225e-6 / n + (n > 1) * 3 * REGION * n


@pytest.fixture(scope="module")
def contest(tmp_path_factory):
    """Samples on 1, 2 and 4 threads that follow the model."""
    folder = tmp_path_factory.mktemp("threads")
    for finder, truth, time in ((PARTITIONED, SWEEP, sweep_time), (TREE, TREE_TRUTH, tree_time)):
        for n in (1, 2, 4):
            for repeat in range(4):
                here = replace(truth, gain=1e-9 * truth.time * BOXES / time(n))
                write_sample(folder, f"drum_{BOXES}", finder, here, BOXES, repeat=repeat, threads=n, noise=0.001)
                with h5py.File(folder / "samples" / f"drum_{BOXES}-{finder}-{n}-{repeat}.h5", "a") as file:
                    file["case/barrier_cost"] = BARRIER * n if n > 1 else 0.0
                    file["case/region_cost"] = REGION * n if n > 1 else 0.0
    (found,) = contests(read_bench([folder]))
    return found


@pytest.mark.parametrize("n", [1, 2, 4, 3, 8, 32])
def test_the_model_predicts_times_from_one_thread_and_the_cost_of_waiting(contest, n):
    assert contest.model(PARTITIONED, n) == pytest.approx(sweep_time(n), rel=0.01)
    assert contest.model(TREE, n) == pytest.approx(tree_time(n), rel=0.01)


def test_it_says_with_how_many_threads_the_sweep_loses(contest):
    truth = next(n for n in range(1, 100) if sweep_time(n) >= tree_time(n))
    assert truth == 3 and contest.loses_at() == truth
    assert contest.seen_to_lose_at() == 4
    assert agreement(contest) == "3 of 3"
    assert contest.best_threads() == min(range(1, 100), key=sweep_time)


def test_work_per_part_halves_with_the_threads(contest):
    assert contest.work_per_part(2) == pytest.approx(90e-6 / 2 / 2, rel=0.01)
    assert contest.work_per_part(4) == pytest.approx(90e-6 / 4 / 2, rel=0.01)


def test_a_wrong_model_is_seen_in_the_table(contest):
    cheap = replace(contest, waiting=Waiting({2: 1e-9, 4: 1e-9}, {2: 1e-9, 4: 1e-9}))
    assert cheap.loses_at() is None and agreement(cheap) == "2 of 3"


def test_samples_without_the_cost_of_waiting_have_no_model_but_a_table(tmp_path):
    for finder, truth in ((PARTITIONED, SWEEP), (TREE, TREE_TRUTH)):
        for n in (1, 2):
            for repeat in range(2):
                write_sample(tmp_path, "drum_5", finder, truth, BOXES, repeat=repeat, threads=n)
    times, limits, _ = fine_grained_tables(read_bench([tmp_path]))
    assert times.rows and np.isnan(contests(read_bench([tmp_path]))[0].model(PARTITIONED, 2))
    row = dict(zip(limits.heading, limits.rows[0]))
    assert (row["loses from, model"], row["agree"]) == ("-", "-")


def test_costs_between_and_beyond_the_measured_numbers_of_threads_lie_on_lines():
    waiting = Waiting({2: 2.0, 4: 4.0}, {4: 8.0})
    assert waiting.of("barrier", 1) == 0.0
    assert waiting.of("barrier", 3) == pytest.approx(3.0)
    assert waiting.of("barrier", 8) == pytest.approx(8.0)
    assert waiting.of("region", 8) == pytest.approx(16.0)
    assert np.isnan(Waiting({}, {}).of("barrier", 2))
