"""Tables of the fine-grained sweep beside the tree: measurement, model, its error, and who wins."""

from __future__ import annotations

import numpy as np
from polydem_post.base.emit import Table

from ..bench import series
from ..bench.samples import Bench, Case
from ..bench.series import SWEEP, TREE
from ..bench.statistics import Estimate, median, number, of_one_bench
from ..fine_grained.exchanges import way_of
from ..fine_grained.model import (
    FETCHED,
    MOST_THREADS,
    OBVIOUS,
    PARTITIONED,
    TREE_BARRIERS,
    Contest,
    contests,
    waiting_of,
)


def fine_grained_tables(bench: Bench) -> list[Table]:
    """The model beside the measurement, where the sweep loses, and what threads gain."""
    found, gains = contests(bench), gains_table(bench)
    tables = [times_table(found), limits_table(found), error_table(found), waiting_table(bench)] if found else []
    return [*tables, *([gains] if gains.rows else [])]


def gains_table(bench: Bench) -> Table:
    """All parallel sweeps and the tree against the plain sweep on one thread, and what they waited for."""
    table = Table(
        "fine_grained_gains", "Parallel sweeps and the tree against one thread of sort_and_sweep",
        ("scene", "boxes", "way per step over side of a box", "finder", "threads", "processors", "time per box [ns]",
         "times as fast", "barriers per step", "locks per step", "waits for the lock per step", "waiting [%]"),
    )
    fine_grained = (PARTITIONED, *OBVIOUS)
    cases = [case for case in bench.select(mode="replay") if series.elapsed_time(case)]
    threaded = {case.scene for case in cases if case.finder in fine_grained and case.threads > 1}
    plain = {case.scene: case for case in cases if case.finder == SWEEP and case.threads == 1}
    for case in cases:
        if case.scene not in threaded & set(plain) or case.finder not in (*fine_grained, SWEEP, TREE):
            continue
        counts = [case.count(name) if case.finder in OBVIOUS else np.nan for name in ("locks", "lock_waits")]
        time = series.total_time if case.threads == 1 else series.elapsed_time
        timed = ["-"] * 3
        if case.threads == 1 or not case.is_disturbed:
            timed = [median(of_one_bench(time(case))).text(), series.ratio(plain[case.scene], case, time).text(),
                     number(100.0 * waiting_share(case))]
        table.add(
            case.scene, case.boxes, number(way_of(case)), case.finder, case.threads,
            case.provenance.get("processors", "-"), *timed[:2], number(barriers_of(case)),
            *(number(count) for count in counts), timed[2],
        )
    table.note = (
        "Medians [95 % interval]; one thread: processor time, more: elapsed time, and '-' if the machine had more to "
        "do than it has processors. Way: mean displacement of the centres of free boxes in a step over "
        "their mean side, from the trace. Barriers, locks and waits for a lock that another thread held are counted. "
        "Waiting: part of the time of the finder in which a thread does not work, mean of the threads."
    )
    return table


def barriers_of(case: Case) -> float:
    """Barriers in a step of a finder with several threads: one after each pass of a fine-grained sweep."""
    if case.threads == 1 or case.finder == SWEEP:
        return 0.0
    return float(TREE_BARRIERS) if case.finder == TREE else case.count("passes")


def waiting_share(case: Case) -> float:
    """Part of the time of a finder in which its threads wait for one another; NaN if it was not recorded."""
    waiting = case.phase("waiting")
    whole = case.phase("structure", "search", "filter", "order", "merge")
    return median([waiting[key] / whole[key] for key in waiting if whole.get(key, 0.0) > 0.0]).value


def _micro(seconds: float) -> str:
    return number(1e6 * seconds)


def _micros(estimate: Estimate) -> str:
    return Estimate(1e6 * estimate.value, 1e6 * estimate.low, 1e6 * estimate.high).text()


def times_table(found: list[Contest]) -> Table:
    """Measured and predicted times of a step."""
    table = Table(
        "fine_grained", "Fine-grained sweep against parallel tree: time of a step [us]",
        ("scene", "boxes", "exchanges per box", "threads", "sweep", "measured / model", "tree", "measured / model",
         "sweep / tree", "model", "passes", "alone, part of one thread", "work per part and pass", "most / mean work",
         "fetched per pass", "waiting per pass", "model", "barrier"),
    )
    for contest in found:
        for n in contest.threads:
            step, split, passes = contest.predict(PARTITIONED, n), contest.splits[PARTITIONED], contest.passes(n)
            of_threads = (number(contest.unevenness(n)), _micro(step.fetched / passes),
                          _micros(contest.waiting_per_pass(n)), _micro(step.waiting / passes),
                          _micro(contest.waiting.of("barrier", n)))
            table.add(
                contest.one.scene, contest.one.boxes, number(contest.exchanges), n,
                _micros(contest.measured(PARTITIONED, n)), number(contest.beyond_model(PARTITIONED, n)),
                _micros(contest.measured(TREE, n)), number(contest.beyond_model(TREE, n)), contest.ratio(n).text(),
                number(step.total / contest.model(TREE, n)), number(passes, 2),
                number(split.rest / (split.rest + split.shared)), _micro(contest.work_per_part(n)),
                *(of_threads if n > 1 else ("-",) * 5),
            )
    table.note = (
        "Model: rest + work / threads + what the part with most work has beyond the mean (exchanges counted from the "
        "trace) + fetching what other cores have written + waiting on this machine (table waiting); its error is in "
        "table fine_grained_error. Alone: what one thread does alone in the sweep. Waiting per pass: mean time in "
        "which a thread of the sweep does not work."
    )
    return table


def error_table(found: list[Contest]) -> Table:
    """Measured time over that of the model, by what the model knows."""
    table = Table(
        "fine_grained_error", "Error of the model: measured time over that of the model, least and most of all scenes",
        ("finder", "threads", "scenes", "waiting alone", "and uneven parts", "and fetching", "fetching a box [ns]",
         "and the nodes of a search [ns]", "serves"), texts=1,
    )
    for finder in FETCHED:
        fitted = {contest.free_threads[1] for contest in found if len(contest.free_threads) > 1}
        for n in sorted({n for contest in found for n in contest.free_threads}):
            here = [contest for contest in found if n in contest.free_threads and contest.has_model]
            costs = [number(1e9 * cost) for cost in here[0].fetch.get(finder, [])] if here else []
            if here:
                table.add(finder, n, len(here), *(_span(here, finder, n, left_out) for left_out in
                                                  (("fetched", "uneven"), ("fetched",), ())),
                          *[*costs, "-", "-"][:2],
                          "work on one thread" if n == 1 else "fit" if n in fitted else "check")
    table.note = (
        "1: as measured; above 1 the model is too fast. Waiting alone: work in equal parts; uneven parts: the part "
        "with most exchanges is waited for; fetching: boxes, and nodes of the tree, that another core has written. "
        "Fit: the costs of fetching are fitted to these samples, all scenes at once. Check: nothing is fitted to them."
    )
    return table


def span_of_error(found: list[Contest], finder: str, threads: int, left_out: tuple = ()) -> tuple[float, float]:
    """Least and most of the measured time over that of the model, without some of its parts."""
    errors = []
    for contest in found:
        step = contest.predict(finder, threads)
        predicted = step.total - sum(getattr(step, name) for name in left_out)
        errors.append(contest.measured(finder, threads).value / predicted)
    return min(errors), max(errors)


def _span(found: list[Contest], finder: str, threads: int, left_out: tuple) -> str:
    least, most = span_of_error(found, finder, threads, left_out)
    return f"{number(least)} to {number(most)}"


def error_told(found: list[Contest]) -> str:
    """The error of the model with the most threads, in words; empty if there is no model."""
    able = [contest for contest in found if contest.has_model]
    most = max((contest.free_threads[-1] for contest in able), default=1)
    able = [contest for contest in able if most in contest.free_threads]
    if most == 1:
        return ""
    spans = (f"{finder} {_span(able, finder, most, ())}" for finder in FETCHED)
    return f"Measured time over that of the model with {most} threads: {', '.join(spans)}."


def limits_table(found: list[Contest]) -> Table:
    """With how many threads the sweep loses to the tree."""
    table = Table(
        "fine_grained_limits", "With how many threads the fine-grained sweep loses to the tree",
        ("scene", "boxes", "exchanges per box", "loses from, model", "loses from, measured", "measured up to",
         "agree", "greatest sweep / tree with several, model", "threads there",
         "best number of threads for the sweep, model"),
    )
    for contest in found:
        model, seen, most = contest.loses_at(), contest.seen_to_lose_at(), contest.threads[-1]
        predicted = model or f"not to {MOST_THREADS}" if contest.has_model else "-"
        ratio, near = contest.nearest_to_lose() if contest.has_model else (np.nan, "-")
        table.add(contest.one.scene, contest.one.boxes, number(contest.exchanges), predicted,
                  seen or f"not to {most}", most, agreement(contest), number(ratio) if contest.has_model else "-",
                  near, contest.best_threads() or "-")
    table.note = (
        "Agree: model and measurement name the same winner with every measured number of threads; undecided where the "
        "interval of the measured ratio holds 1. A greatest ratio as near to 1 as the error of the model (table "
        "fine_grained_error) leaves the limit open; with more threads than were measured the model is a prediction."
    )
    return table


def agreement(contest: Contest) -> str:
    """Whether the model names the winner that was measured: 3 of 3, 1 undecided."""
    if not contest.has_model:
        return "-"
    right, open_ones = 0, 0
    for n in contest.threads:
        won = contest.ratio(n).at_least(1.0)
        predicted = contest.model(PARTITIONED, n) >= contest.model(TREE, n)
        right += won is predicted
        open_ones += won is None
    text = f"{right} of {len(contest.threads) - open_ones}"
    return f"{text}, {open_ones} undecided" if open_ones else text


def waiting_table(bench: Bench) -> Table:
    """What waiting costs on this machine."""
    waiting = waiting_of(bench)
    table = Table("waiting", "Cost of waiting on this machine [us]", ("threads", "barrier", "start and join threads"))
    for n in sorted(waiting.barrier):
        table.add(n, _micro(waiting.barrier[n]), _micro(waiting.region.get(n, np.nan)))
    table.note = "Medians of what was measured just before each sample: 15 batches of 20 barriers and 20 empty regions."
    return table
