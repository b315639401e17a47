"""The verbs of the laboratory but paper."""

from __future__ import annotations

import argparse
from dataclasses import fields, replace
from pathlib import Path

from polydem_post.base.result_file import ResultError
from polydem_post.command_line import arguments

from .paper import add_paper, program
from .rivals import add_rivals


def add_verbs(verbs) -> None:
    """Add the verbs of the laboratory to those of the command line."""
    tables = verbs.add_parser("tables")
    tables.set_defaults(action=_tables)
    tables.add_argument("folders", type=Path, nargs="+", metavar="BENCH")
    tables.add_argument("--output", type=Path, metavar="DIR")
    tables.add_argument("--no-figures", action="store_true")
    _add_cache(verbs)
    _add_costs(verbs)
    _add_workprecision(verbs)
    add_rivals(verbs)
    _add_scale(verbs)
    add_paper(verbs)


def _add_cache(verbs) -> None:
    cache = verbs.add_parser("cache")
    cache.set_defaults(action=_cache)
    cache.add_argument("folder", type=Path, metavar="BENCH")
    cache.add_argument("--program", type=Path, required=True)
    cache.add_argument("--finders", type=arguments.words, metavar="A,B,C")
    cache.add_argument("--scenes", type=arguments.words, metavar="A,B,C")
    cache.add_argument("--steps", type=arguments.numbers, default=[2, 12], metavar="FEW,MORE")
    cache.add_argument("--machine", action="store_true")
    for level in ("D1", "LL"):
        cache.add_argument(f"--{level}", metavar="SIZE,WAYS,LINE")
    cache.add_argument("--branch-sim", action="store_true")


def _add_costs(verbs) -> None:
    costs = verbs.add_parser("costs")
    costs.set_defaults(action=_costs)
    costs.add_argument("--program", type=Path, required=True)
    costs.add_argument("--inputs", type=Path, default=Path("inputs"))
    costs.add_argument("--output", type=Path, default=Path("results/costs"))
    costs.add_argument("--repeats", type=int, default=9)
    costs.add_argument("--threads", type=int, default=1)


def _add_workprecision(verbs) -> None:
    work = verbs.add_parser("workprecision")
    work.set_defaults(action=_workprecision)
    work.add_argument("scenes", nargs="*", metavar="SCENE")
    work.add_argument("--output", type=Path, default=Path("results/workprecision"), metavar="DIR")
    work.add_argument("--repeats", type=int, default=3, metavar="N")
    work.add_argument("--report-only", action="store_true")
    work.add_argument("--program", type=program, action="append", default=[], metavar="PREC=PATH")


def _add_scale(verbs) -> None:
    scale = verbs.add_parser("scale")
    scale.set_defaults(action=_scale)
    scale.add_argument("counts", type=Path, nargs="+", metavar="COUNTS")
    scale.add_argument("--save", type=Path, metavar="FILE.csv")
    scale.add_argument("--bodies", type=arguments.positives, default=[1e6], metavar="N,...")
    scale.add_argument("--body", type=arguments.positive, metavar="S")
    for default, *names in ((2e-6, "latency"), (1e9, "bandwidth"), (0.5, "halo-body"), (1.1, "imbalance"),
                            (40.0, "interval"), (4.0, "redistribution"),
                            (300.0, "redistributed-bytes")):
        scale.add_argument(*(f"--{name}" for name in names), type=arguments.positive, default=default, metavar="X",
                           dest=names[-1].replace("-", "_"))
    scale.add_argument("--sums", type=arguments.count, default=2, metavar="K")
    scale.add_argument("--shape")
    scale.add_argument("--margin", type=arguments.positive)


def _tables(options: argparse.Namespace) -> None:
    from ..report.bench_report import write_report

    written = write_report(options.folders, options.output, figures=not options.no_figures)
    print(written[-1].parent)


def _cache(options: argparse.Namespace) -> None:
    from ..bench.samples import read_bench
    from ..costs.cache import count_misses
    from ..costs.cachegrind import PLAIN_MODEL, Model, machine_model

    if len(options.steps) != 2 or not 1 <= options.steps[0] < options.steps[1]:
        raise ResultError("--steps takes two numbers, the first at least 1 and less than the second")
    model = machine_model() if options.machine else Model(**PLAIN_MODEL)
    model = replace(model, **{level: getattr(options, level) for level in ("D1", "LL") if getattr(options, level)})
    finders = options.finders or read_bench([options.folder]).named("finder")
    steps, branches = tuple(options.steps), options.branch_sim
    count_misses(options.folder, options.program, finders, model, steps, options.scenes, branches, say=arguments.say)


def _costs(options: argparse.Namespace) -> None:
    from ..costs.models import Study, measure_costs, write_costs

    if options.repeats < 0 or options.threads < 1:
        raise ResultError("--repeats takes numbers from 0 on, --threads from 1")
    study = Study(options.program, options.inputs, options.output, options.threads)
    samples = measure_costs(study, options.repeats, say=arguments.say)
    print(write_costs(samples, options.output).document("text"), end="")


def _workprecision(options: argparse.Namespace) -> None:
    from ..precision.report import write_precision_report
    from ..precision.samples import Study
    from ..precision.scenes import SCENES

    unknown = [name for name in options.scenes if name not in SCENES]
    if unknown:
        raise ResultError(f"there is no scene {', '.join(unknown)}; there are {', '.join(SCENES)}")
    if options.repeats < 1:
        raise ResultError("--repeats takes a number of at least 1")
    if not options.report_only:
        study = Study(options.output, dict(options.program), arguments.say)
        study.measure([SCENES[name] for name in options.scenes or SCENES], options.repeats)
    print(write_precision_report(options.output)[-1])


def _scale(options: argparse.Namespace) -> None:
    from ..scaling.exchange_model import Machine, fit_law, read_counts, scale_table, strip_table
    from ..scaling.exchange_runs import MARGIN, SHAPE, read_run, read_runs, runs_tables, write_runs

    runs, files = [], []
    for path in options.counts:
        found = [read_run(path)] if path.is_dir() else read_runs(path)
        runs += found
        files += [] if found else [path]
    counts = [run.as_count() for run in runs if run.ranks > 1] + (read_counts(files) if files else [])
    if options.save:
        write_runs(runs, options.save)
    if not counts and not options.save:
        raise ResultError("a run on one rank exchanges nothing; give runs on several ranks, too (run --ranks R)")
    tables = runs_tables(runs) if runs else []
    tables += [strip_table(counts)] if counts else []
    if options.body:
        machine = Machine(**{field.name: getattr(options, field.name) for field in fields(Machine)})
        shape = options.shape or (SHAPE if runs else "drum")
        law = fit_law(counts, shape, options.margin or (MARGIN if shape == SHAPE else 0.2))
        tables += [scale_table(law, machine, bodies) for bodies in options.bodies]
    print("\n".join(table.document("markdown") for table in tables), end="")
