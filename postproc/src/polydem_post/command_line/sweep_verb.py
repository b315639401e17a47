"""The verb sweep."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from ..base.result_file import ResultError
from . import arguments


def add_sweep(verbs) -> None:
    """Add `sweep` to the verbs of the command line."""
    sweep = verbs.add_parser("sweep")
    sweep.add_argument("--program", type=Path)
    steps = sweep.add_subparsers(dest="step", required=True, metavar="make|run|collect")

    make = steps.add_parser("make")
    make.set_defaults(action=_sweep_make)
    make.add_argument("words", nargs="+", metavar="WORD")
    make.add_argument("--output", type=Path, required=True, metavar="FOLDER")
    make.add_argument("--cores", type=arguments.count, default=1, metavar="N")

    run = steps.add_parser("run")
    run.set_defaults(action=_sweep_run)
    run.add_argument("folder", type=Path, metavar="FOLDER")
    run.add_argument("--cores", type=arguments.count, metavar="N")
    run.add_argument("--threads", type=arguments.count, default=1, metavar="T")
    run.add_argument("--rows", type=arguments.numbers, metavar="A,B,C")
    run.add_argument("--names", type=arguments.words, metavar="A,B,C")
    run.add_argument("--retry", action="store_true")

    collect = steps.add_parser("collect")
    collect.set_defaults(action=_sweep_collect)
    collect.add_argument("folder", type=Path, metavar="FOLDER")


def _sweep_make(options: argparse.Namespace) -> None:
    from ..sweep.batch import LISTED_ENTRY, make_sweep

    lists = [word for word in options.words if LISTED_ENTRY.fullmatch(word)]
    files = [word for word in options.words if word not in lists]
    tables = [word for word in files if word.lower().endswith(".csv")]
    bases = [word for word in files if word not in tables]
    if len(bases) != 1 or len(tables) > 1:
        raise ResultError("sweep make takes one namelist, and a table (.csv) or lists as scene.seed=1,2,3; see --help")
    table = Path(tables[0]) if tables else None
    sweep = make_sweep(Path(bases[0]), options.output, _sweep_program(options), table, lists, options.cores)
    arguments.say(f"{sweep.folder}: {len(sweep.runs)} runs; next: ./polydem sweep run "
         f"{shlex.quote(str(sweep.folder))}")


def _sweep_run(options: argparse.Namespace) -> int:
    from ..sweep.batch import Sweep
    from ..sweep.runner import Runner, available_cores

    runs = Sweep(options.folder).choose(options.rows, options.names)
    runner = Runner(_sweep_program(options), options.cores or len(available_cores()), options.threads, arguments.say)
    return runner.run(runs, options.retry)


def _sweep_collect(options: argparse.Namespace) -> None:
    from ..sweep.batch import Sweep
    from ..sweep.collect import CSV_FILE, HDF5_FILE, collect_sweep

    collect_sweep(Sweep(options.folder), arguments.say)
    arguments.say(f"{options.folder / CSV_FILE}\n{options.folder / HDF5_FILE}")


def _sweep_program(options: argparse.Namespace) -> Path:
    if options.program is None:
        raise ResultError("--program is missing: call ./polydem sweep, which knows it")
    return options.program
