"""Options of the tests of ranks, results to compare with, and the table of all combinations."""

import datetime
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from runs import PARALLEL, contents, count, run, state_hash
from scenes import write_scene

HERE = Path(__file__).parent


@dataclass
class Expected:
    """What the program without MPI makes of a scene."""

    hash: str
    contents: dict
    steps: int
    contacts: int


@dataclass
class Outcome:
    """Combinations that were tried with a scene and a number of ranks, and those that were equal."""

    tried: int = 0
    equal: int = 0
    #: Bodies that changed their process, per run
    migrations: list = field(default_factory=list)


def pytest_addoption(parser):
    parser.addoption("--full", action="store_true", help="try all combinations and write equality.md")
    parser.addoption("--kills", type=int, default=3, help="how often a rank is killed")


def pytest_configure(config):
    config.outcomes = {}
    config.expected = {}
    config.restarts = []
    config.matrix = {}


@pytest.fixture
def outcomes(request):
    """Outcomes by scene and ranks."""
    return request.config.outcomes


@pytest.fixture
def expected(request, tmp_path_factory):
    """A function that gives what the program without MPI makes of a scene, and remembers it."""

    def expect(scene):
        known = request.config.expected
        if scene not in known:
            folder = tmp_path_factory.mktemp(f"{scene}_serial")
            write_scene(folder / "scene.nml", scene)
            output, _ = run(folder / "scene.nml", folder / "result")
            known[scene] = Expected(state_hash(output), contents(folder / "result"), count(output, "steps"),
                                    count(output, "contacts"))
        return known[scene]

    return expect


@pytest.fixture
def restarts(request):
    """Runs that went on with another number of ranks: scene, ranks, steps at the interruptions."""
    return request.config.restarts


@pytest.fixture
def matrix(request):
    """Runs that had one hash, by pair of capabilities."""
    return request.config.matrix


def pytest_sessionfinish(session):
    config = session.config
    if config.getoption("full") and config.outcomes:
        (HERE / "equality.md").write_text(table(config), encoding="utf-8")


def table(config):
    """What all combinations gave, in Markdown."""
    ranks = sorted({number for _, number in config.outcomes})
    told = subprocess.run([PARALLEL, "--version"], capture_output=True, text=True, check=True).stdout
    version = next(line for line in told.splitlines() if line.startswith("polydem "))
    combinations = max(outcome.tried for outcome in config.outcomes.values())
    lines = [
        "# The same bits for any number of processes", "",
        f"Written by `run_ranks.py --full` on {datetime.date.today()} with {version}. Each cell: runs whose state "
        "hash, trajectory (all frames, contacts, walls and rows of the energy balance) and counts of steps and "
        f"contacts were those of the program without MPI, of {combinations} runs with every finder on 1 and 2 threads; "
        "in brackets how often a body changed its process in a run.", "",
        "| scene | steps | contacts | " + " | ".join(f"{number} ranks" for number in ranks) + " |",
        "|---|--:|--:|" + "---|" * len(ranks),
    ]
    for scene, known in config.expected.items():
        cells = [f"{outcome.equal} of {outcome.tried} ({min(outcome.migrations, default=0)} to "
                 f"{max(outcome.migrations, default=0)})"
                 for outcome in (config.outcomes[scene, number] for number in ranks)]
        lines.append(f"| {scene} | {known.steps} | {known.contacts} | " + " | ".join(cells) + " |")
    lines += ["", "Runs that were interrupted by a signal and went on with other ranks, to the same bits:", "",
              "| scene | ranks | interrupted after steps |", "|---|---|---|"]
    for scene, numbers, steps in config.restarts:
        way = " -> ".join(str(number or "serial") for number in numbers)
        lines.append(f"| {scene} | {way} | {', '.join(map(str, steps))} |")
    if config.matrix:
        lines += ["", f"Pairs of [capabilities](capabilities.py): {len(config.matrix)} pairs, each with one hash in "
                  f"{min(config.matrix.values())} runs with finders, 1 to 4 threads, 1 to 7 ranks and interruptions "
                  "drawn by seed."]
    return "\n".join(lines) + "\n"
