"""Verdicts follow the data: a bench that behaves as the paper says confirms its claims, and another one does not."""

import itertools
from dataclasses import replace

import pytest
from polydem_lab.bench.samples import Case, read_bench
from polydem_lab.claims import rules_structure as claim_rules_structure
from polydem_lab.claims.judge import claims_document, judge_all
from polydem_lab.claims.targets import targets
from polydem_lab.claims.verdicts import (
    CONFIRMED,
    CONTRADICTED,
    IN_PART,
    NOT_MEASURED,
    NOT_TESTABLE,
    UNDECIDED,
    UNDECIDED_QUICK,
    counts_table,
    of_parts,
    of_quick,
    verdict_table,
)
from polydem_lab.costs import complexity
from synthetic_bench import Machine, input_of, kept_in_memory, truths, write_drums, write_hard_scenes, write_sample

SIZES = (2522, 5058, 12651, 100000)
SLOWER = Machine("beta", "AMD EPYC", clock="3.3 GHz", slowness=1.3)


def as_the_paper_says():
    """Truths under which every claim that synthetic samples can show is true."""
    found = truths()
    found["sort_and_sweep"] = replace(found["sort_and_sweep"], shares=(0.85, 0.0, 0.05, 0.05, 0.05, 0.0))
    found["quadtree"] = replace(found["quadtree"], shares=(0.2, 0.4, 0.25, 0.1, 0.05, 0.0))
    return found


def verdicts(folder, finders=None, machines=(Machine(),), hard=True, **options):
    """Claim -> finding of a bench that follows some truths."""
    finders = finders or as_the_paper_says()
    for machine in machines:
        write_drums(folder / machine.host, finders, machine, SIZES, repeats=3, **options)
    if hard:
        write_hard_scenes(folder / machines[0].host, finders)
    folders = [folder / machine.host for machine in machines]
    return {claim.id: finding for claim, finding in judge_all(read_bench(folders))}


def changed(finder, **changes):
    """The truths with one finder changed."""
    finders = as_the_paper_says()
    counts = changes.pop("counts", {})
    finders[finder] = replace(finders[finder], counts={**finders[finder].counts, **counts}, **changes)
    return finders


@pytest.fixture(scope="module", autouse=True)
def in_memory():
    """Benches of hundreds of samples; that those of files are the same, test_bench.py shows."""
    with kept_in_memory():
        yield


@pytest.fixture(scope="module")
def agreeing(tmp_path_factory):
    return verdicts(tmp_path_factory.mktemp("agreeing"), machines=(Machine(), SLOWER))


@pytest.mark.parametrize("claim", ["C1", "C2", "C4", "C5", "C6", "C7", "C10", "C11", "C12", "C15", "C16", "C17", "C19"])
def test_a_bench_as_the_paper_says_confirms(agreeing, claim):
    assert agreeing[claim].verdict == CONFIRMED, agreeing[claim]


@pytest.mark.parametrize(
    "claim, finder, changes, verdict",
    [
        ("C1", "quadtree", {"exponent": 1.2, "time": 8.0}, IN_PART),
        ("C2", "quadtree", {"time": 90.0}, CONTRADICTED),
        ("C2", "quadtree", {"time": 20.0}, CONTRADICTED),
        ("C4", "quadtree", {"shares": (0.6, 0.2, 0.1, 0.05, 0.05, 0.0)}, CONTRADICTED),
        ("C5", "partitioned_sweep", {"gain": 2.0}, IN_PART),
        ("C5", "quadtree", {"gain": 1.0}, IN_PART),
        ("C6", "quadtree", {"time": 20.0}, IN_PART),
        ("C7", "quadtree", {"counts": {"depth": 0}}, NOT_MEASURED),
        ("C12", "linked_cells", {"time": 2000.0}, IN_PART),
        ("C17", "sort_and_sweep", {"counts": {"idle_swaps": 0.05}}, CONTRADICTED),
        ("C19", "linked_cells", {"time": 2000.0}, CONTRADICTED),
        ("C15", "quadtree", {"counts": {"searches": 0.0}}, NOT_MEASURED),
    ],
)
def test_a_verdict_flips_with_the_data(tmp_path, claim, finder, changes, verdict):
    finders = changed(finder, **changes)
    if claim == "C7":
        del finders["quadtree"]
    found = verdicts(tmp_path, finders, hard=claim in ("C12", "C19"))
    assert found[claim].verdict == verdict, found[claim]


def test_the_update_of_the_structure_is_judged_by_ratio_and_slopes(tmp_path, agreeing):
    assert agreeing["C3"].verdict == CONTRADICTED
    finders = changed("quadtree", shares=(0.1, 0.5, 0.25, 0.1, 0.05, 0.0))
    assert verdicts(tmp_path / "ratio", finders, hard=False)["C3"].verdict == IN_PART
    finders = {name: replace(truth, exponent=1.4) for name, truth in finders.items()}
    assert verdicts(tmp_path / "both", finders, hard=False)["C3"].verdict == CONFIRMED


def test_a_contradicted_slope_tells_whether_the_operations_grow(tmp_path):
    found = verdicts(tmp_path, changed("quadtree", exponent=1.2, time=8.0), hard=False)["C1"]
    assert "tests 1.00" in found.reason


def test_the_depth_of_the_tree_is_compared_with_the_papers(tmp_path):
    for boxes in (2522, 12651):
        truth = replace(truths()["quadtree"], counts={"depth": 14, "nodes": 1.6})
        for repeat in range(2):
            write_sample(tmp_path, f"drum_{boxes}", "quadtree", truth, boxes, repeat=repeat)
    assert {c.id: f for c, f in judge_all(read_bench([tmp_path]))}["C7"].verdict == CONTRADICTED


def test_memory_against_clock_needs_two_machines_that_state_their_clocks(tmp_path, agreeing):
    assert agreeing["C10"].verdict == CONFIRMED
    assert verdicts(tmp_path / "one", hard=False)["C10"].verdict == NOT_MEASURED
    silent = replace(SLOWER, clock="unknown")
    assert verdicts(tmp_path / "silent", machines=(Machine(), silent), hard=False)["C10"].verdict == NOT_TESTABLE
    faster = replace(SLOWER, slowness=0.7)
    assert verdicts(tmp_path / "faster", machines=(Machine(), faster), hard=False)["C10"].verdict == CONTRADICTED


def test_wrong_lists_on_cut_walls_contradict(tmp_path):
    write_hard_scenes(tmp_path, as_the_paper_says())
    for finder in ("quadtree", "linked_cells"):
        truth = truths()[finder]
        write_sample(tmp_path, "sizes_50", finder, truth, 3000, pair_hash=finder, bodies=2500)
    found = {c.id: f for c, f in judge_all(read_bench([tmp_path]))}["C11"]
    assert found.verdict == IN_PART and "Equal lists on 3 of 4 scenes" in found.reason


def test_a_list_that_was_not_compared_with_the_oracle_proves_nothing(tmp_path):
    write_hard_scenes(tmp_path, as_the_paper_says())
    write_sample(tmp_path, "sizes_50", "quadtree", truths()["quadtree"], 3000, checked="sort_and_sweep")
    assert {c.id: f for c, f in judge_all(read_bench([tmp_path]))}["C11"].verdict == NOT_MEASURED


@pytest.mark.parametrize("jump, verdict", [(1.0, CONTRADICTED), (1.5, CONFIRMED)])
def test_a_rise_beyond_a_cache_is_seen(tmp_path, jump, verdict):
    for boxes in (2522, 5058, 100000):
        truth = replace(truths()["quadtree"], time=45.0 * (jump if boxes > 50000 else 1.0))
        for repeat in range(6):
            write_sample(tmp_path, f"drum_{boxes}", "quadtree", truth, boxes, repeat=repeat)
    assert {c.id: f for c, f in judge_all(read_bench([tmp_path]))}["C13"].verdict == verdict


def test_whole_steps_tell_what_a_week_is_worth_and_no_more(tmp_path):
    write_drums(
        tmp_path, {"quadtree": truths()["quadtree"]}, sizes=(12651,), repeats=2, threads=(1,), mode="live", noise=0.0
    )
    found = {c.id: f for c, f in judge_all(read_bench([tmp_path]))}["C14"]
    assert found.verdict == NOT_TESTABLE
    assert found.ours.startswith("3.19 ms per step; a week: ")


@pytest.mark.parametrize("slowness, verdict", [(1.01, CONFIRMED), (1.3, CONTRADICTED)])
def test_levels_of_optimisation_are_compared_side_by_side(tmp_path, slowness, verdict):
    finders = as_the_paper_says()
    assert verdicts(tmp_path / "o3", finders, hard=False)["C18"].verdict == NOT_MEASURED
    for name in ("quadtree", "sort_and_sweep"):
        finders[f"{name}_o2"] = replace(finders[name], time=slowness * finders[name].time)
    assert verdicts(tmp_path / "both", finders, hard=False)["C18"].verdict == verdict


@pytest.mark.parametrize("unsorted, ordered, verdict", [
    (2.0, 1.5, CONFIRMED), (1.0, 1.0, IN_PART), (2.0, 2.0, IN_PART), (1.0, 2.0, CONTRADICTED)])
def test_the_worst_order_is_judged_by_exponents(tmp_path, unsorted, ordered, verdict):
    for boxes in (1000, 4000):
        for finder, power in (("unsorted_sweep", unsorted), ("sort_and_sweep", ordered)):
            write_sample(tmp_path, f"worst_order_{boxes}", finder, truths()["sort_and_sweep"], boxes, repeat=0,
                         first_counts={"swaps": round(boxes**power)})
    assert {c.id: f for c, f in judge_all(read_bench([tmp_path]))}["C16"].verdict == verdict


def test_whole_steps_with_the_making_of_the_boxes_are_judged_where_there_are_enough(tmp_path):
    finders = changed("quadtree", time=90.0)
    assert verdicts(tmp_path, finders, hard=False)["C2"].verdict == CONTRADICTED
    paper_s = {name: as_the_paper_says()[name] for name in ("quadtree", "sort_and_sweep")}
    for sizes, verdict, told in ((SIZES[:2], CONTRADICTED, "Replay, without"), (SIZES[2:3], CONFIRMED, "Whole steps")):
        write_drums(tmp_path / "live", paper_s, sizes=sizes, repeats=3, threads=(1,), mode="live", noise=0.0)
        found = {c.id: f for c, f in judge_all(read_bench([tmp_path / "alpha", tmp_path / "live"]))}
        assert found["C2"].verdict == verdict and found["C2"].reason.startswith(told), found["C2"]
    assert found["C1"].verdict == CONFIRMED and found["C1"].ours.count("without the boxes") == 2


def test_a_parallel_sweep_that_gains_on_drums_larger_than_the_papers_does_not_contradict_it(tmp_path):
    finders = as_the_paper_says()
    folder = tmp_path / "alpha"
    write_drums(folder, finders, sizes=SIZES, repeats=3)
    for finder, gain in (("partitioned_sweep", 3.0), ("sort_and_sweep", 1.4), ("quadtree", 1.7)):
        for repeat in range(4):
            write_sample(folder, "drum_100000", finder, replace(finders[finder], gain=gain), 100000, repeat=repeat,
                         threads=2)
    found = {c.id: f for c, f in judge_all(read_bench([folder]))}["C5"]
    assert found.verdict == CONFIRMED and "100000 boxes, 2 threads" in found.ours


def test_every_fine_grained_sweep_that_was_measured_has_a_verdict_of_its_own(tmp_path):
    finders = as_the_paper_says()
    for name, gain in (("odd_even_sweep", 0.1), ("mended_sweep", 1.5)):
        finders[name] = replace(finders["partitioned_sweep"], gain=gain * finders["partitioned_sweep"].time / 50.0)
    write_drums(tmp_path, finders, sizes=SIZES, repeats=3)
    judged = judge_all(read_bench([tmp_path]))
    rows = {row[0]: row for row in verdict_table(judged).rows}
    assert rows["C5"][3:5] == ("by part", IN_PART)
    found = {rows[f"C5{letter}"][1].split("(")[-1].rstrip(")"): rows[f"C5{letter}"][4] for letter in "abc"}
    assert found == {"partitioned_sweep": CONFIRMED, "odd_even_sweep": CONFIRMED, "mended_sweep": CONTRADICTED}
    assert "C5e" in rows and "C5f" not in rows and "C2a" not in rows
    counts = {row[0]: row[2].split(", ") for row in counts_table(judged).rows}
    assert "C5c" in counts["parts contradicted"] and "C5" in counts[IN_PART]
    quick = {row[0]: row[4] for row in verdict_table(of_quick(judged)).rows}
    assert all(verdict != "undecided" for verdict in quick.values()) and quick["C5c"] == CONTRADICTED


@pytest.mark.parametrize("deeper, steps, verdict", [(0, 1, CONFIRMED), (2, 1, IN_PART), (0, 0, IN_PART),
                                                    (3, 3, CONTRADICTED)])
def test_the_depth_is_judged_by_levels_and_by_growth(tmp_path, deeper, steps, verdict):
    for k, boxes in enumerate((2522, 5058, 7599, 10014, 12651)):
        truth = replace(truths()["quadtree"], counts={"depth": 9 + deeper + steps * (k > 1), "nodes": 1.6})
        write_sample(tmp_path, f"drum_{boxes}", "quadtree", truth, boxes, repeat=0)
    assert {c.id: f for c, f in judge_all(read_bench([tmp_path]))}["C7"].verdict == verdict


@pytest.mark.parametrize("kind, claim", [("soft_3", "C12"), ("range_4", "C19")])
def test_tree_and_sweep_are_judged_apart_where_the_paper_advises_neither(tmp_path, kind, claim):
    (bench,) = with_scenes((as_the_paper_says(), {kind: (9.0, 0.5, 1.0)}))
    found = bench(tmp_path)[claim]
    assert found.verdict == IN_PART and "tree yes" in found.reason and "sweep no" in found.reason


def test_the_quick_comparison_leaves_open_only_what_more_samples_here_decide(tmp_path):
    write_drums(tmp_path, as_the_paper_says(), sizes=SIZES, repeats=3)
    found = {claim.id: finding.verdict for claim, finding in of_quick(judge_all(read_bench([tmp_path])))}
    assert found["C10"] == NOT_MEASURED and found["C12"] == UNDECIDED_QUICK


@pytest.mark.parametrize("tree, verdict", [(90, CONFIRMED), (300, IN_PART), (40, CONTRADICTED)])
def test_complexities_are_judged_by_their_ratio(monkeypatch, agreeing, tmp_path, tree, verdict):
    monkeypatch.setattr(complexity, "counter", lambda: "a tool")
    monkeypatch.setattr(complexity, "totals", lambda finder, _: {"total": tree if finder == "quadtree" else 80})
    monkeypatch.setattr(complexity, "count_finder", lambda *_: [complexity.Procedure("a.f90", "find", 9)])
    assert claim_rules_structure.complexities(None).verdict == verdict
    monkeypatch.setattr(complexity, "counter", lambda: None)
    write_sample(tmp_path, "drum_100", "verlet", truths()["quadtree"], 100)
    found = {c.id: f for c, f in judge_all(read_bench([tmp_path]))}["C8"]
    assert found.verdict == NOT_MEASURED and "pip install" in found.reason


def test_nothing_measured_says_what_to_run_for_every_claim_but_the_untestable(tmp_path):
    write_sample(tmp_path, "drum_100", "verlet", truths()["quadtree"], 100)
    bench = read_bench([tmp_path])
    found = {claim.id: finding for claim, finding in judge_all(bench)}
    assert list(found) == [f"C{k}" for k in range(1, 20)]
    for identifier in set(found) - {"C8", "C9"}:
        assert found[identifier].verdict == NOT_MEASURED
        assert found[identifier].reason.startswith("It needs ")
    assert found["C9"].verdict == NOT_TESTABLE
    text = claims_document(bench)
    assert all(f"| C{k} |" in text for k in range(1, 20))


@pytest.mark.parametrize("parts", [p for n in (1, 2, 3) for p in itertools.product([True, False, None], repeat=n)])
def test_a_verdict_on_parts_is_given_if_undecided_parts_cannot_change_it(parts):
    possible = set()
    for filled in itertools.product(*([part] if part is not None else [True, False] for part in parts)):
        possible.add(CONFIRMED if all(filled) else IN_PART if any(filled) else CONTRADICTED)
    assert of_parts(list(parts)) == (possible.pop() if len(possible) == 1 else UNDECIDED)


#: Claims that are judged by exact numbers, without an interval, and those that never are
EXACT = {"C7", "C8", "C11", "C15", "C16", "C17"}
NEVER = {"C9", "C14"}


def several(**changes):
    """The truths with several finders changed: name=dictionary."""
    finders = as_the_paper_says()
    return {name: replace(truth, **changes.get(name, {})) for name, truth in finders.items()}


def of_drums(*finders, **options):
    """Benches of drums alone that follow some truths: inside the rule, outside, and on both sides of a bound."""
    return [lambda folder, each=each: verdicts(folder, each, hard=False, **options) for each in finders]


def with_scenes(*benches):
    """The same with one scene of every kind: (truths, changed factors of scenes)."""

    def made(folder, finders, changes):
        write_drums(folder, finders, sizes=SIZES, repeats=3)
        write_hard_scenes(folder, finders, changes=changes)
        return {claim.id: finding for claim, finding in judge_all(read_bench([folder]))}

    return [lambda folder, each=each: made(folder, *each) for each in benches]


def two_machines(slowness, noise=0.01):
    return lambda folder: verdicts(
        folder, machines=(Machine(), replace(SLOWER, slowness=slowness)), hard=False, noise=noise
    )


def a_jump(jump, noise):
    def made(folder):
        for boxes in (2522, 5058, 100000):
            truth = replace(truths()["quadtree"], time=45.0 * (jump if boxes > 50000 else 1.0), structure_sway=0.0)
            for repeat in range(6):
                write_sample(folder, f"drum_{boxes}", "quadtree", truth, boxes, repeat=repeat, noise=noise)
        return {claim.id: finding for claim, finding in judge_all(read_bench([folder]))}

    return made


def other_builds(slowness, sway=0.0):
    finders = as_the_paper_says()
    for name in ("quadtree", "sort_and_sweep"):
        finders[f"{name}_o2"] = replace(finders[name], time=slowness * finders[name].time, sway=sway)
    return finders


UPDATE = {"exponent": 1.4, "time": 1.0}
#: Claim -> benches whose whole interval is inside the rule, outside of it, and on both sides of a bound
BENCHES = {
    "C1": of_drums(
        as_the_paper_says(),
        several(quadtree={"exponent": 1.2}, sort_and_sweep={"exponent": 1.3}),
        several(quadtree={"exponent": 1.05, "sway": 0.1}),
    ),
    "C2": of_drums(
        as_the_paper_says(), several(quadtree={"time": 90.0}), several(quadtree={"time": 50.0, "sway": 0.05})
    ),
    "C3": of_drums(
        several(quadtree={**UPDATE, "shares": (0.1, 0.5, 0.25, 0.1, 0.05, 0.0)}, sort_and_sweep=UPDATE),
        several(quadtree={"shares": (0.5, 0.1, 0.25, 0.1, 0.05, 0.0)}),
        several(
            quadtree={**UPDATE, "shares": (0.16, 0.5, 0.25, 0.05, 0.04, 0.0), "structure_sway": 0.3},
            sort_and_sweep=UPDATE,
        ),
    ),
    "C4": of_drums(
        as_the_paper_says(),
        several(quadtree={"shares": (0.6, 0.2, 0.1, 0.05, 0.05, 0.0)}),
        several(quadtree={"shares": (0.3, 0.3, 0.25, 0.1, 0.05, 0.0), "structure_sway": 0.2}),
    ),
    "C5": of_drums(
        as_the_paper_says(),
        several(partitioned_sweep={"gain": 3.0}, quadtree={"gain": 1.0}, sort_and_sweep={"gain": 0.9}),
        several(quadtree={"gain": 1.2, "sway": 0.1}),
    ),
    "C6": of_drums(
        as_the_paper_says(),
        several(quadtree={"exponent": 1.5, "time": 0.65}),
        several(quadtree_called={"sway": 0.4}),
    ),
    "C10": [two_machines(1.3), two_machines(0.7), two_machines(1.0, noise=0.1)],
    "C12": with_scenes(
        (as_the_paper_says(), None),
        (as_the_paper_says(), {"bed": (0.8, 1.0, 3.0), "gas_10": (1.5, 1.0, 3.0), "soft_3": (1.0, 1.0, 9.0)}),
        (several(linked_cells={"sway": 20.0}), None),
    ),
    "C13": [a_jump(1.5, 0.01), a_jump(1.0, 0.01), a_jump(1.1, 0.1)],
    "C18": of_drums(other_builds(1.01), other_builds(1.3), other_builds(1.05, sway=0.1)),
    "C19": with_scenes(
        (as_the_paper_says(), None),
        (as_the_paper_says(), {"range_4": (1.0, 1.0, 9.0)}),
        (several(linked_cells={"sway": 20.0}), None),
    ),
}


def test_every_claim_is_judged_by_intervals_by_exact_numbers_or_never():
    assert set(BENCHES) | EXACT | NEVER == {f"C{k}" for k in range(1, 20)}
    assert len(BENCHES) + len(EXACT) + len(NEVER) == 19


@pytest.mark.parametrize("where, verdict", list(enumerate([CONFIRMED, CONTRADICTED, UNDECIDED])))
@pytest.mark.parametrize("claim", list(BENCHES))
def test_only_a_whole_interval_confirms_or_contradicts(tmp_path, claim, where, verdict):
    finding = BENCHES[claim][where](tmp_path)[claim]
    assert finding.verdict == verdict, finding


@pytest.mark.parametrize("claim", sorted(set(BENCHES) - {"C12", "C19"}))
def test_what_was_measured_once_has_no_interval_and_is_undecided(tmp_path, monkeypatch, claim):
    monkeypatch.setattr(Case, "values", _first_repeat_alone)
    finding = BENCHES[claim][0](tmp_path)[claim]
    assert finding.verdict == UNDECIDED, finding


def _first_repeat_alone(case, quantity):
    return {(str(s.path.parent), 1): quantity(s) for s in case.samples if s.repeat == 1}


@pytest.mark.parametrize("made_by", [input_of("gas", 1000), input_of("bed", 1000), input_of("other", 1000), False])
def test_what_is_called_a_drum_and_is_none_says_nothing_about_drums(tmp_path, made_by):
    found = verdicts(tmp_path, hard=False, made_by=made_by)
    for claim in sorted(set(found) - {"C8"}):
        assert found[claim].verdict in (NOT_MEASURED, NOT_TESTABLE), (claim, found[claim])
    bench = read_bench([tmp_path / "alpha"])
    assert not targets(bench.on()).rows
    assert ("of drum_2522, drum_5058" in claims_document(bench)) is (made_by is False)


def test_drums_of_any_name_confirm_what_drums_do(tmp_path):
    for boxes in SIZES:
        for finder, truth in as_the_paper_says().items():
            for repeat in range(4):
                made_by = input_of("drum", boxes)
                write_sample(tmp_path, f"gas_{boxes}", finder, truth, boxes, repeat=repeat, made_by=made_by)
    found = {claim.id: finding for claim, finding in judge_all(read_bench([tmp_path]))}
    assert (found["C1"].verdict, found["C2"].verdict, found["C4"].verdict) == (CONFIRMED, CONFIRMED, CONFIRMED)
