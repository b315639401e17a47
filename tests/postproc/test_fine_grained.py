"""The model of the fine-grained sweep on samples whose truth it knows."""

import os
import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from polydem_lab.bench.samples import read_bench
from polydem_lab.bench.series import SWEEP as PLAIN
from polydem_lab.bench.series import TREE
from polydem_lab.fine_grained.exchanges import Exchanges, exchanges_down, exchanges_of, exchanges_up_to, way_of
from polydem_lab.fine_grained.model import MOVE_COST, PARTITIONED, SEARCH_COST, Waiting, contests, not_negative
from polydem_lab.report.fine_grained_figures import fine_grained_drawings, scenes_of, what_fails
from polydem_lab.tables.fine_grained_tables import agreement, error_told, fine_grained_tables, span_of_error
from synthetic_bench import Truth, write_sample

BOXES = 10000
#: Time of a step on one thread [s]: of the sweep 100 us, of which threads share 90; of the tree 300 us,
#: of which structure, search and filter take 255
PASSES = 5.0
SWEEP = Truth(10.0, 1.0, (0.9, 0.0, 0.05, 0.03, 0.02, 0.0), counts={"swaps": 0.5, "passes": PASSES / BOXES})
TREE_TRUTH = Truth(30.0, 1.0, (0.1, 0.5, 0.25, 0.1, 0.05, 0.0), counts={"left_leaf": 0.5, "candidates": 5.0})
#: Cost of a barrier and of a region for each thread more [s]
BARRIER, REGION = 22e-6, 2e-6


def sweep_time(n):
    return 10e-6 + 90e-6 / n + (n > 1) * (PASSES * BARRIER * n + REGION * n)


def tree_time(n):
    return 45e-6 + 255e-6 / n + (n > 1) * (3 * BARRIER * n + REGION * n)


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
    ratio, near = contest.nearest_to_lose()
    assert near == max(range(2, 257), key=lambda n: sweep_time(n) / tree_time(n))
    assert ratio == pytest.approx(sweep_time(near) / tree_time(near), rel=0.01)


def test_work_per_part_halves_with_the_threads(contest):
    assert contest.work_per_part(2) == pytest.approx(90e-6 / 2 / PASSES, rel=0.01)
    assert contest.work_per_part(4) == pytest.approx(90e-6 / 4 / PASSES, rel=0.01)


def test_a_wrong_model_is_seen_in_the_table(contest):
    cheap = replace(contest, waiting=Waiting({2: 1e-9, 4: 1e-9}, {2: 1e-9, 4: 1e-9}))
    assert cheap.loses_at() is None and agreement(cheap) == "2 of 3"


def test_samples_without_the_cost_of_waiting_have_no_model_but_a_table(tmp_path):
    for finder, truth in ((PARTITIONED, SWEEP), (TREE, TREE_TRUTH)):
        for n in (1, 2):
            for repeat in range(2):
                write_sample(tmp_path, "drum_5", finder, truth, BOXES, repeat=repeat, threads=n)
    times, limits, *_ = fine_grained_tables(read_bench([tmp_path]))
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


# --- Parts with given work --------------------------------------------------------------------------------------------

#: Boxes of a row, of which the first so many exchange places in pairs, four exchanges of ends each
ROW = 64


def row_of(movers, steps=7):
    """Bounds of a row of boxes, (step, box, 4); at every second step the first ones stand the other way round."""
    bounds = np.zeros((steps, ROW, 4))
    left = np.tile(np.arange(ROW, dtype=float), (steps, 1))
    left[1::2, :movers] = left[1::2, :movers].reshape(-1, movers // 2, 2)[:, :, ::-1].reshape(-1, movers)
    bounds[:, :, 0], bounds[:, :, 2] = left, left + 0.5
    bounds[:, :, 1], bounds[:, :, 3] = np.arange(ROW), np.arange(ROW) + 0.5
    return bounds


def test_exchanges_are_counted_where_ends_stood():
    values = np.array([3.0, 1.0, 2.0, 7.0, 5.0, 6.0, 4.0, 4.0])
    expected = [sum(before > value for before in values[:k]) for k, value in enumerate(values)]
    assert exchanges_down(values).tolist() == expected
    random = np.random.default_rng(5)
    values = np.arange(200.0) + random.normal(0.0, 8.0, 200)
    assert exchanges_down(values).tolist() == [int((values[:k] > values[k]).sum()) for k in range(200)]


def test_exchanges_of_both_axes_add_up_over_the_list():
    bounds = row_of(16)
    summed = exchanges_up_to(bounds[0], bounds[1])
    assert (len(summed), summed[0], summed[32], summed[-1]) == (2 * ROW + 1, 0, 4 * 8, 4 * 8)


#: Work of a step that the parts below have: what an end and an exchange cost, and the rest [s]
END, EXCHANGE, REST = 1e-7, 4e-7, 2e-6


def write_row(folder, name, movers, repeats=4, fetch=0.0):
    """Samples of a row on 1, 2 and 4 threads: a pass takes as long as the part with most of the given work."""
    (folder / "traces" / name).mkdir(parents=True)
    with h5py.File(folder / "traces" / name / "trace.h5", "w") as file:
        file["aabb"] = row_of(movers)
    swaps = 2 * movers
    for n in (1, 2, 4):
        # All exchanges lie in the first quarter of the list, so in one part
        work = 4 * ROW * END / n + (swaps if movers <= ROW // 4 else max(swaps / n, ROW / 2)) * EXCHANGE
        seconds = {PARTITIONED: work + REST + fetch * ROW * (n - 1) / n**2, TREE: 1e-3 / n}
        for finder, time in seconds.items():
            shares = (work / seconds[PARTITIONED], 0.0, 0.0, 1.0 - work / seconds[PARTITIONED], 0.0, 0.0)
            truth = Truth(1e9 * time / ROW, 1.0, shares if finder == PARTITIONED else (0.0, 0.5, 0.5, 0.0, 0.0, 0.0),
                          counts={"swaps": swaps / ROW, "passes": 2.0 / ROW})
            for repeat in range(repeats):
                write_sample(folder, name, finder, truth, ROW, repeat=repeat, threads=n, noise=1e-5)
                with h5py.File(folder / "samples" / f"{name}-{finder}-{n}-{repeat}.h5", "a") as file:
                    file["case/barrier_cost"] = file["case/region_cost"] = 1e-15 if n > 1 else 0.0


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """Two rows with different numbers of exchanges, all of them in the first quarter of the list."""
    folder = tmp_path_factory.mktemp("rows")
    for name, movers in (("row_slow", 4), ("row_fast", 16)):
        write_row(folder, name, movers)
    return contests(read_bench([folder]))


def test_the_work_of_ends_and_exchanges_is_told_apart(rows):
    for contest, movers in zip(rows, (4, 16)):
        whole = 4 * ROW * END + 2 * movers * EXCHANGE
        assert contest.exchanging == pytest.approx(2 * movers * EXCHANGE / whole, rel=0.01)
        assert contest.splits[PARTITIONED].rest == pytest.approx(REST, rel=0.01)


@pytest.mark.parametrize("n", [2, 4])
def test_the_part_with_most_work_decides_the_time(rows, n):
    for contest, movers in zip(rows, (4, 16)):
        mean = (4 * ROW * END + 2 * movers * EXCHANGE) / n
        most = 4 * ROW * END / n + 2 * movers * EXCHANGE
        assert contest.unevenness(n) == pytest.approx(most / mean, rel=0.01)
        assert contest.predict(PARTITIONED, n).uneven == pytest.approx(most - mean, rel=0.02)
        assert contest.model(PARTITIONED, n) == pytest.approx(most + REST, rel=0.01)
    assert span_of_error(rows, PARTITIONED, n) == pytest.approx((1.0, 1.0), abs=0.01)
    least, worst = span_of_error(rows, PARTITIONED, n, ("uneven", "fetched"))
    assert 1.0 < least < worst  # even parts alone do not explain the time


# --- The first thread of the tree -------------------------------------------------------------------------------------

#: What a step of the tree takes: to scan all boxes, and to compare all candidates; to repair the tree and to search for
#: a box that left its leaf [s]
SCAN, COMPARE, REPAIR, SEARCH = 20e-6, 50e-6, 1e-6, 3e-6


def tree_step(moved, n):
    """Time of a step with so many boxes that left their leaf [s]."""
    repair, search = REPAIR * moved, SEARCH * moved
    if moved <= 5 * BOXES / (n - 1 or 1) / (MOVE_COST + SEARCH_COST):
        return SCAN / n + max(repair + search, (repair + search + COMPARE) / n)
    return SCAN / n + max(repair, (repair + COMPARE) / n) + search / n


@pytest.fixture(scope="module")
def trees(tmp_path_factory):
    """Scenes of one size in which 1, 20 and 200 boxes leave their leaf, on 1, 2 and 4 threads."""
    folder = tmp_path_factory.mktemp("trees")
    for moved in (1, 20, 200):
        parts = np.array([SCAN + REPAIR * moved, SEARCH * moved, COMPARE, 0.0, 0.0, 0.0])
        for n in (1, 2, 4):
            truth = Truth(1e9 * tree_step(moved, n) / BOXES, 1.0, tuple(parts / parts.sum()),
                          counts={"left_leaf": moved / BOXES, "candidates": 5.0})
            for repeat in range(3):
                for finder in (PARTITIONED, TREE):
                    write_sample(folder, f"drum_{moved}", finder, truth, BOXES, repeat=repeat, threads=n, noise=1e-5)
                    with h5py.File(folder / "samples" / f"drum_{moved}-{finder}-{n}-{repeat}.h5", "a") as file:
                        file["case/barrier_cost"] = file["case/region_cost"] = 1e-15 if n > 1 else 0.0
    return {int(found.one.scene.split("_")[1]): found for found in contests(read_bench([folder]))}


@pytest.mark.parametrize("moved, first", [(1, True), (20, True), (200, False)])
def test_the_others_wait_for_the_first_thread_of_the_tree(trees, moved, first):
    contest = trees[moved]
    assert contest.repairing == pytest.approx(REPAIR * moved / (SCAN + REPAIR * moved), rel=0.02)
    assert contest.first_searches(2) == first
    for n in (2, 4):
        assert contest.predict(TREE, n).total == pytest.approx(tree_step(moved, n), rel=0.01)
    assert (contest.wait_for_first(2) > 1e-6) == (moved > 1)


def test_the_tree_expects_what_its_source_says():
    path = Path(os.environ["POLYDEM_SOURCE_DIR"]) / "src/neighbours/finders/quadtree/quadtree.f90"
    source = path.read_text(encoding="utf-8")
    said = re.search(r"move_cost = (\d+)_ip, search_cost = (\d+)_ip", source).groups()
    assert tuple(map(int, said)) == (MOVE_COST, SEARCH_COST)


def test_a_trace_of_other_boxes_is_not_counted(tmp_path):
    write_row(tmp_path, "row", 16)
    case = read_bench([tmp_path]).select(finder=PARTITIONED, threads=1)[0]
    assert exchanges_of(case, 4) == Exchanges(32.0, {1: 32.0, 2: 32.0, 3: 32.0, 4: 32.0})
    (tmp_path / "traces" / "row" / "trace.h5").unlink()
    assert exchanges_of(case, 4) is None
    with h5py.File(tmp_path / "traces" / "row" / "trace.h5", "w") as file:
        file["aabb"] = row_of(8)
    assert exchanges_of(case, 5) is None
    assert contests(read_bench([tmp_path]))[0].unevenness(4) == 1.0


def test_what_fetching_costs_is_fitted_to_two_threads_and_tells_four(tmp_path):
    cost = 5e-8
    for name, movers in (("row_slow", 4), ("row_fast", 16)):
        write_row(tmp_path, name, movers, fetch=cost)
    found = contests(read_bench([tmp_path]))
    for contest in found:
        assert contest.fetch[PARTITIONED] == pytest.approx([cost], rel=0.02)
        assert contest.predict(PARTITIONED, 4).fetched == pytest.approx(cost * ROW * 3 / 16, rel=0.02)
        assert contest.measured(PARTITIONED, 4).value == pytest.approx(contest.model(PARTITIONED, 4), rel=0.01)
    (error,) = (table for table in fine_grained_tables(read_bench([tmp_path])) if table.name == "fine_grained_error")
    told = [dict(zip(error.heading, row)) for row in error.rows if row[0] == PARTITIONED]
    assert [row["serves"] for row in told] == ["work on one thread", "fit", "check"]
    assert float(told[-1]["fetching a box [ns]"]) == pytest.approx(50.0, rel=0.02)
    assert [float(word) for word in told[-1]["and fetching"].split(" to ")] == pytest.approx([1.0, 1.0], abs=0.01)
    spoken = f"with 4 threads: partitioned_sweep {told[-1]['and fetching']}, quadtree "
    assert spoken in error_told(found)


def test_least_squares_without_negative_numbers():
    rows = np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]])
    assert not_negative(rows, rows @ [2.0, 3.0]) == pytest.approx([2.0, 3.0])
    assert not_negative(rows, rows @ [4.0, -1.0]) == pytest.approx([3.0, 0.0])
    assert not_negative(rows, -np.ones(3)) == pytest.approx([0.0, 0.0])
    assert not_negative(np.ones((1, 2)), np.ones(1)) == pytest.approx([1.0, 0.0])


# --- What fails -------------------------------------------------------------------------------------------------------

#: Finder -> how many times as fast as one thread of the plain sweep it is on 2 threads
GAINS = {"odd_even_sweep": 0.25, "locked_sweep": 0.8, "mended_sweep": 1.0, PARTITIONED: 1.6, PLAIN: 1.3, TREE: 0.9}


@pytest.fixture(scope="module")
def fails(tmp_path_factory):
    """Rows that move little and much, on 1 and 2 threads, with given gains; those of mended_sweep differ."""
    folder = tmp_path_factory.mktemp("fails")
    for name, movers, change in (("row_much", 16, 1.3), ("row_little", 4, 0.7)):
        (folder / "traces" / name).mkdir(parents=True)
        with h5py.File(folder / "traces" / name / "trace.h5", "w") as file:
            file["aabb"] = row_of(movers)
            file["is_wall"] = np.arange(ROW) >= ROW // 2
        for finder, gain in GAINS.items():
            gain *= change if finder == "mended_sweep" else 1.0
            counts = {"passes": 9.0 / ROW, "locks": 3.0 / ROW, "lock_waits": 2.0 / ROW}
            truth = Truth(50.0, 1.0, gain=gain, counts=counts)
            for n in (1, 2):
                for repeat in range(4):
                    write_sample(folder, name, finder, truth, ROW, repeat=repeat, threads=n, noise=0.001)
    return read_bench([folder])


def test_gains_barriers_and_locks_of_every_parallel_sweep_stand_in_a_table(fails):
    (table,) = [each for each in fine_grained_tables(fails) if each.name == "fine_grained_gains"]
    rows = [dict(zip(table.heading, row)) for row in table.rows]
    assert len(rows) == 2 * 2 * len(GAINS)
    for row in rows:
        if row["threads"] == "2" and row["finder"] != "mended_sweep":
            assert float(row["times as fast"].split()[0]) == pytest.approx(GAINS[row["finder"]], rel=0.01)
        barriers = {PLAIN: 0.0, TREE: 3.0}.get(row["finder"], 9.0)
        assert float(row["barriers per step"]) == (barriers if row["threads"] == "2" else 0.0)
        locks = "-" if row["finder"] in (PARTITIONED, PLAIN, TREE) else "3.00"
        assert row["locks per step"] == locks


def test_the_way_of_free_boxes_follows_from_the_trace(fails):
    for case in fails.select(finder=PLAIN, threads=1):
        movers = 16 if case.scene == "row_much" else 4
        # Of the free half of the row so many boxes move by one place in a step; their mean side is half a place
        assert way_of(case) == pytest.approx(movers / (ROW // 2) / 0.5)


def test_the_title_of_the_figure_says_what_fails_and_what_works(fails):
    (drawing,) = [each for each in fine_grained_drawings(fails) if each.name == "fine_grained"]
    title = drawing.figure.get_suptitle().splitlines()
    assert [line.split(":")[0] for line in title] == ["Fails", "Fails", "Works", "Loses or gains"]
    assert "single ends" in title[0] and "0.25 to 0.25 times as fast" in title[0] and "blocks, changes kept" in title[2]
    above = [axis for axis in drawing.figure.axes if axis.get_title().startswith("row_")]
    assert [axis.get_title().split(":")[0] for axis in above] == ["row_little", "row_much"]
    assert "25 % of their side per step" in above[0].get_title()
    for axis in above:
        assert axis.get_ylim()[0] < 0.25 and axis.get_ylim()[1] > 1.6
    (ratio,) = [axis for axis in drawing.figure.axes if axis.get_ylabel() == "sweep / tree"]
    assert ratio.get_ylim()[0] == 0.0 and ratio.get_ylim()[1] > 1.0
    assert max(max(line.get_xdata()) for line in ratio.lines if "other machine" in line.get_label()) == 16


def test_the_figure_shows_the_size_with_most_motions_and_needs_no_tree(fails):
    (table,) = [each for each in fine_grained_tables(fails) if each.name == "fine_grained_gains"]
    rows = [dict(zip(table.heading, row)) for row in table.rows]
    drum = {**rows[0], "boxes": "12651", "way per step over side of a box": "-"}
    other = [{**drum, "scene": f"drum_{k}"} for k in range(3)]
    assert scenes_of(rows + other) == ["drum_0", "drum_1", "drum_2"]
    assert scenes_of(rows + other[:1]) == ["row_little", "row_much"]
    assert "above 1 the sweep loses" in what_fails(table).caption


def test_times_of_several_threads_on_a_machine_with_more_to_do_than_processors_are_left_out(tmp_path):
    truth = Truth(50.0, 1.0, gain=2.0, counts={"passes": 7.0 / ROW})
    for finder, time in ((PLAIN, 50.0), ("odd_even_sweep", 100.0)):
        for n in (1, 2):
            for repeat in range(3):
                write_sample(tmp_path, "row", finder, replace(truth, time=time), ROW, repeat=repeat, threads=n)
    bench = read_bench([tmp_path])
    for case in bench.cases:
        assert not case.is_disturbed
        for sample in case.samples:
            sample.case["load"] = 4.5  # of 4 processors
        assert case.is_disturbed
    (table,) = fine_grained_tables(bench)
    rows = {(row[3], row[4]): dict(zip(table.heading, row)) for row in table.rows}
    assert float(rows["odd_even_sweep", "1"]["times as fast"].split()[0]) == pytest.approx(0.5, rel=0.05)
    assert rows["odd_even_sweep", "2"]["times as fast"] == "-" != rows["odd_even_sweep", "2"]["barriers per step"]
    assert "7.0 to 7.0 barriers per step" in what_fails(table).figure.get_suptitle()
