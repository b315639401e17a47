"""Any two capabilities together: the same bits for any finder, ranks and threads, and after an interruption.

A pair of capabilities is run with all pairs on one thread; then, interrupted and continued, with a finder, ranks and
threads that a seed draws. `--full` tries every pair, more than once, and also without an interruption.
"""

import random
import sys
from collections import Counter
from pathlib import Path

import pytest
from capabilities import CAPABILITIES, LEFT_OUT, REFUSED, choices, pairs, switched_on, text
from runs import FINDERS, complaints, contents, count, differences, frames, interrupt, run, state_hash

#: Seeds of the quick test, which takes each capability in some pairs, and of the full one, which takes all pairs
QUICK_SEED = 1
FULL_SEEDS = (1, 2, 3)
#: Ranks that are drawn; None is the program without MPI. Seven take turns on few cores and are slow.
RANKS = (None, None, 1, 2, 2, 3, 3, 7)
ONE_RANK = (None, 1)


def some_pairs(seed):
    """Pairs in which every capability is once or more: first those of two that are in none."""
    drawn = [two for two in pairs() if two not in REFUSED]
    random.Random(seed).shuffle(drawn)
    times = Counter()
    for least in (max, min):
        for two in drawn:
            if least(times[name] for name in two) == 0:
                times.update(two)
                yield two


def pytest_generate_tests(metafunc):
    if "seed" in metafunc.fixturenames:
        full = metafunc.config.getoption("full")
        cases = ([(two, seed) for seed in FULL_SEEDS for two in pairs() if two not in REFUSED] if full
                 else [(two, QUICK_SEED) for two in some_pairs(QUICK_SEED)])
        metafunc.parametrize("two, seed", cases, ids=[f"{'-'.join(two)}-{seed}" for two, seed in cases])


def test_two_capabilities_have_one_hash(two, seed, request, matrix, tmp_path):
    draw = random.Random(f"{two} {seed}")
    namelist = tmp_path / "scene.nml"
    namelist.write_text(text(two), encoding="utf-8")

    def finder():
        return "--set", f"neighbours.finder={draw.choice(FINDERS)}"

    def machine():
        return draw.choice(ONE_RANK if "exact_friction" in two else RANKS), draw.randint(1, 4)

    whole, message = run(namelist, tmp_path / "whole", options=("--set", "neighbours.finder=all_pairs"))
    assert complaints(message) == []
    assert count(whole, "contacts") > 500
    if request.config.getoption("full"):
        other, _ = run(namelist, tmp_path / "other", *machine(), finder())
        assert state_hash(other) == state_hash(whole)
        assert differences(contents(tmp_path / "whole"), contents(tmp_path / "other")) == []
    folder = tmp_path / "parts"
    same = finder()
    step, _ = interrupt(folder, namelist, *machine(), same)
    assert 0 < step < count(whole, "steps")
    last, _ = run(namelist, folder, *machine(), ("--continue", *same))
    assert state_hash(last) == state_hash(whole)
    assert differences(frames(tmp_path / "whole"), frames(folder)) == []
    matrix[two] = matrix.get(two, 0) + 3


@pytest.mark.parametrize("two", REFUSED, ids="-".join)
def test_what_does_not_go_together_is_refused(two, tmp_path):
    (tmp_path / "scene.nml").write_text(text(two), encoding="utf-8")
    _, message = run(tmp_path / "scene.nml", tmp_path / "result", code=2)
    assert REFUSED[two] in message
    assert not (tmp_path / "result").exists()


def test_the_quick_sample_leaves_no_capability_out():
    times = Counter(name for two in some_pairs(QUICK_SEED) for name in two)
    assert times.keys() == CAPABILITIES.keys()


def test_no_choice_of_the_table_is_left_out():
    config = Path(__file__).parents[2] / "src" / "config"
    sys.path.insert(0, str(config))
    from generator.table import read_table
    table = read_table((config / "entries.txt").read_text(encoding="utf-8"))
    tried = {choice for name in CAPABILITIES for choice in switched_on(name)}
    missing = set(choices(*table)) - tried
    assert missing == LEFT_OUT.keys(), missing ^ LEFT_OUT.keys()
