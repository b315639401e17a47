"""Command line: python -m polydem_post plot, table, tables, cache, costs, workprecision, sweep or scale."""

from __future__ import annotations

import argparse
import math
import os
import sys
import warnings
from dataclasses import fields, replace
from pathlib import Path

from . import __version__
from .emit import printable
from .table import FORMATS, timing_table
from .trajectory import ResultError, Trajectory

#: Exit code of a result that cannot be used, as in the program itself
INPUT_ERROR = 2

#: Exit code of what no reader foresaw, and of a program whose output nobody reads any more, as shells have it
UNFORESEEN, CLOSED_PIPE = 1, 141

#: Variable of the environment that shows where an unforeseen error happened
TRACEBACK = "POLYDEM_TRACEBACK"


def main(arguments: list[str] | None = None) -> int:
    """Do what the command line says; return the exit code."""
    options = _parser().parse_args(arguments)
    warnings.showwarning = lambda message, *_: print(f"warning: {printable(str(message))}", file=sys.stderr)
    try:
        code = options.action(options) or 0
        sys.stdout.flush()
        return code
    except ResultError as error:
        print(f"error: {printable(str(error))}", file=sys.stderr)
        return INPUT_ERROR
    except BrokenPipeError:
        return _end_quietly()
    except Exception as error:  # the last resort: what no reader foresaw is told in a sentence as well
        if os.environ.get(TRACEBACK):
            raise
        words = " ".join(str(error).split())
        print(f"error: {options.verb} cannot go on: {type(error).__name__}: {printable(words)[:300]}. A file may be "
              f"damaged; "
              f"{TRACEBACK}=1 shows where", file=sys.stderr)
        return UNFORESEEN


def _end_quietly() -> int:
    """What to give back when the reader of a pipe, as in `| head -1`, has seen enough."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the rest is written when Python ends
    except (OSError, ValueError):
        pass
    return CLOSED_PIPE


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="polydem_post", description="Draws and tabulates results of polydem.")
    parser.add_argument("--version", action="version", version=f"polydem_post {__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    plot = verbs.add_parser("plot", help="draw frames as a picture")
    plot.set_defaults(action=_plot)
    plot.add_argument("result", type=Path, metavar="RESULT", help="folder of a result, or one segment")
    which = plot.add_mutually_exclusive_group()
    which.add_argument("--frame", type=int, metavar="K", help="frame, counted from 0; -1, the last one, if absent")
    which.add_argument("--frames", type=_numbers, metavar="A,B,C", help="frames to draw side by side")
    plot.add_argument("--output", type=Path, metavar="FILE", help="picture; frame_K.png in the result if absent")
    plot.add_argument("--colour", choices=("speed", "angle", "id", "none"), default="speed", help="colour by this")
    plot.add_argument("--contacts", action="store_true", help="draw the forces of the contacts")

    table = verbs.add_parser("table", help="print the table of times")
    table.set_defaults(action=_table)
    table.add_argument("result", type=Path, metavar="RESULT", help="folder of a result")
    table.add_argument("--format", choices=FORMATS, default="text", help="form of the table")

    tables = verbs.add_parser("tables", help="write all tables, figures and verdicts of bench folders")
    tables.set_defaults(action=_tables)
    tables.add_argument("folders", type=Path, nargs="+", metavar="BENCH_FOLDER",
                        help="folder of a bench; several: of other machines or builds, the first one leads")
    tables.add_argument("--output", type=Path, metavar="DIR", help="where to; report in the first folder if absent")
    tables.add_argument("--no-figures", action="store_true", help="tables and verdicts only")
    _add_cache(verbs)
    _add_costs(verbs)
    _add_workprecision(verbs)
    _add_sweep(verbs)
    _add_scale(verbs)
    return parser


def _add_cache(verbs) -> None:
    cache = verbs.add_parser(
        "cache", help="count cache misses on the traces of a bench folder",
        description="Replays every trace of a bench folder in cachegrind and writes cache.csv there, which the "
                    "verb tables "
        "takes up. What cache.csv holds is not counted again: delete it after a change of the program.")
    cache.set_defaults(action=_cache)
    cache.add_argument("folder", type=Path, metavar="BENCH_FOLDER", help="folder of a bench, with traces")
    cache.add_argument("--program", type=Path, required=True, help="the built program (the launcher says which)")
    cache.add_argument("--finders", type=_words, metavar="A,B,C", help="those of the samples if absent")
    cache.add_argument("--scenes", type=_words, metavar="A,B,C", help="all that have a trace if absent")
    cache.add_argument("--steps", type=_numbers, default=[2, 12], metavar="FEW,MORE",
                       help="steps of the two replays whose difference counts (default: 2,12)")
    cache.add_argument("--machine", action="store_true",
                       help="simulate first and last level of this machine, not D1 32 KiB 8-way and LL 1 MiB 16-way")
    for level in ("D1", "LL"):
        cache.add_argument(f"--{level}", metavar="SIZE,WAYS,LINE", help=f"simulate this {level} [bytes, ways, bytes]")
    cache.add_argument("--branch-sim", action="store_true", help="count mispredicted branches too")


def _add_costs(verbs) -> None:
    costs = verbs.add_parser(
        "costs", help="measure what each optional model costs",
        description="Runs a packed drum with one optional model after the other, on and off in turns, and writes what "
        "each costs of a step and in memory. An interrupted call goes on; samples of another build are refused.")
    costs.set_defaults(action=_costs)
    costs.add_argument("--program", type=Path, required=True, help="the built program (the launcher says which)")
    costs.add_argument("--inputs", type=Path, default=Path("inputs"), help="folder of the scenes (default: inputs)")
    costs.add_argument("--output", type=Path, default=Path("results/costs"), help="where to (default: results/costs)")
    costs.add_argument("--repeats", type=int, default=9, help="timed runs of each model (default: 9); 0, "
                       "as on a busy machine: instructions and memory alone")
    costs.add_argument("--threads", type=int, default=1, help="threads of each run (default: 1)")


def _add_workprecision(verbs) -> None:
    work = verbs.add_parser(
        "workprecision", help="measure error against time over steps, integrators, laws and precisions",
        description="Runs small scenes with all steps, integrators, force laws and precisions, and writes tables, "
                    "figures and a recommendation to DIR/report. Goes on where an interrupted study was.")
    work.set_defaults(action=_workprecision)
    work.add_argument("scenes", nargs="*", metavar="SCENE", help="names in inputs/precision; all if absent")
    work.add_argument("--output", type=Path, default=Path("results/workprecision"), metavar="DIR",
                      help="folder of the study (default: results/workprecision)")
    work.add_argument("--repeats", type=int, default=3, metavar="N", help="timed runs of every choice (default: 3)")
    work.add_argument("--report-only", action="store_true", help="run nothing, write the report of what there is")
    work.add_argument("--program", type=_program, action="append", default=[], metavar="PRECISION=PATH",
                      help="a built program (the launcher says which)")


def _program(text: str) -> tuple:
    precision, equals, path = text.partition("=")
    if not equals or precision not in ("single", "double", "quadruple"):
        raise argparse.ArgumentTypeError(f"'{text}' is not like double=PATH")
    return precision, Path(path)


def _add_sweep(verbs) -> None:
    sweep = verbs.add_parser("sweep", help="run a table of runs that differ in some entries of one namelist")
    sweep.add_argument("--program", type=Path, help="the built program (the launcher says which)")
    steps = sweep.add_subparsers(dest="step", required=True, metavar="make|run|collect")

    make = steps.add_parser(
        "make", help="check a table of runs, and lay out their folders",
        usage="./polydem sweep make [TABLE.csv] BASE.nml [group.key=A,B,...]... --output FOLDER",
        description="The table has a column name and one for each entry that differs, as scene.seed; an empty cell "
                    "leaves the entry as BASE.nml has it. Listed values are combined with each other and with all "
                    "rows; values with commas stand between semicolons: 'forces.gravity=0,-9.81;0,-1.62'.")
    make.set_defaults(action=_sweep_make)
    make.add_argument("words", nargs="+", metavar="WORD", help="table, namelist, lists of values")
    make.add_argument("--output", type=Path, required=True, metavar="FOLDER", help="folder of the sweep")
    make.add_argument("--cores", type=_count, default=1, metavar="N", help="checks at once (default: 1)")

    run = steps.add_parser(
        "run", help="run what is not finished",
        description="Ends with 0 if all runs are finished, 1 if some failed, 75 if it was asked to end (INT, TERM, "
                    "HUP, USR1) before: the same command then goes on.")
    run.set_defaults(action=_sweep_run)
    run.add_argument("folder", type=Path, metavar="FOLDER", help="folder of the sweep")
    run.add_argument("--cores", type=_count, metavar="N", help="cores to use (default: all that there are)")
    run.add_argument("--threads", type=_count, default=1, metavar="T", help="threads of each run (default: 1)")
    run.add_argument("--rows", type=_numbers, metavar="A,B,C", help="only these rows of the table, counted from 1")
    run.add_argument("--names", type=_words, metavar="A,B,C", help="only the runs of these names")
    run.add_argument("--retry", action="store_true", help="run again what failed")

    collect = steps.add_parser("collect", help="write results.csv and results.h5 of what there is")
    collect.set_defaults(action=_sweep_collect)
    collect.add_argument("folder", type=Path, metavar="FOLDER", help="folder of the sweep")


def _add_scale(verbs) -> None:
    scale = verbs.add_parser(
        "scale", help="reckon the time of a step on many ranks from counts",
        description="Prints Markdown: what the ranks of runs told each other, how wide the strips of ghosts are, and "
                    "the time of a step on 1 to 4096 ranks with all that is assumed.")
    scale.set_defaults(action=_scale)
    scale.add_argument("counts", type=Path, nargs="+", metavar="COUNTS",
                       help="folders of runs on several ranks, files of --save, files of count_exchange")
    scale.add_argument("--save", type=Path, metavar="FILE.csv", help="write the counts of the runs")
    scale.add_argument("--bodies", type=_positives, default=[1e6], metavar="N,...",
                       help="bodies of all ranks, a table for each (default: 1e6)")
    scale.add_argument("--body", type=_positive, metavar="S",
                       help="time of a step per body on one rank [s]; without it counts only")
    for name, default, meaning in (
        ("latency", 2e-6, "time of a message of no length [s]"),
        ("bandwidth", 1e9, "of a rank [B/s]"),
        ("ghost", 0.5, "what a ghost costs, in bodies"),
        ("imbalance", 1.1, "work of the busiest rank over the mean"),
        ("interval", 40.0, "steps between two settlements"),
        ("settlement", 4.0, "what one costs, in steps of the own bodies"),
        ("settled-bytes", 300.0, "what one tells of a ghost"),
    ):
        scale.add_argument(f"--{name}", type=_positive, default=default, metavar="X",
                           help=f"{meaning} (default: {default:g})")
    scale.add_argument("--sums", type=_count, default=2, metavar="K", help="sums over all ranks in a step (default: 2)")
    scale.add_argument("--shape", help="packing that was counted: run, box or drum (default: run if there are runs, "
                                       "else drum)")
    scale.add_argument("--cut", default="bisection", help="bisection or morton (default: bisection)")
    scale.add_argument("--margin", type=_positive, help="of runs in m (default: those that choose their own), of "
                                                        "count_exchange in long axes of a grain (default: 0.2)")


def _positives(text: str) -> list[float]:
    return [_positive(word) for word in text.split(",")]


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above 0")
    return value


def _count(text: str) -> int:
    if not text.isdigit() or not 0 < int(text) < 1000000:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1 on")
    return int(text)


def _numbers(text: str) -> list[int]:
    try:
        return [int(word) for word in text.split(",")]
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of whole numbers like 0,10,-1") from error


def _words(text: str) -> list[str]:
    return [word for word in text.split(",") if word]


def _plot(options: argparse.Namespace) -> None:
    from .plot import plot_frames, save  # matplotlib takes long to load and a table does not need it

    trajectory = Trajectory(options.result)
    if len(trajectory) == 0:
        raise ResultError(f"{options.result}: holds no frames")
    numbers = options.frames if options.frames else [-1 if options.frame is None else options.frame]
    figure = plot_frames(trajectory, numbers, options.colour, options.contacts)
    path = options.output or trajectory.folder / _picture_name(trajectory, numbers)
    save(figure, path)
    print(path)


def _picture_name(trajectory: Trajectory, numbers: list[int]) -> str:
    counted = [number % len(trajectory) for number in numbers]
    return "frame_" + "_".join(f"{number:04d}" for number in counted) + ".png"


def _table(options: argparse.Namespace) -> None:
    print(timing_table(Trajectory(options.result), options.format))


def _tables(options: argparse.Namespace) -> None:
    from .report import write_report

    written = write_report(options.folders, options.output, figures=not options.no_figures)
    print(written[-1].parent)


def _cache(options: argparse.Namespace) -> None:
    from .bench import read_bench
    from .cache import count_misses
    from .cachegrind import PLAIN_MODEL, Model, machine_model

    if len(options.steps) != 2 or not 1 <= options.steps[0] < options.steps[1]:
        raise ResultError("--steps takes two numbers, the first at least 1 and less than the second")
    model = machine_model() if options.machine else Model(**PLAIN_MODEL)
    model = replace(model, **{level: getattr(options, level) for level in ("D1", "LL") if getattr(options, level)})
    finders = options.finders or read_bench([options.folder]).named("finder")
    steps, branches = tuple(options.steps), options.branch_sim
    count_misses(options.folder, options.program, finders, model, steps, options.scenes, branches, say=_say)


def _costs(options: argparse.Namespace) -> None:
    from .costs import Study, measure_costs, write_costs

    if options.repeats < 0 or options.threads < 1:
        raise ResultError("--repeats takes numbers from 0 on, --threads from 1")
    study = Study(options.program, options.inputs, options.output, options.threads)
    samples = measure_costs(study, options.repeats, say=_say)
    print(write_costs(samples, options.output).document("text"), end="")


def _workprecision(options: argparse.Namespace) -> None:
    from .precision_report import write_precision_report
    from .precision_samples import Study
    from .precision_scenes import SCENES

    unknown = [name for name in options.scenes if name not in SCENES]
    if unknown:
        raise ResultError(f"there is no scene {', '.join(unknown)}; there are {', '.join(SCENES)}")
    if options.repeats < 1:
        raise ResultError("--repeats takes a number of at least 1")
    if not options.report_only:
        study = Study(options.output, dict(options.program), _say)
        study.measure([SCENES[name] for name in options.scenes or SCENES], options.repeats)
    print(write_precision_report(options.output)[-1])


def _sweep_make(options: argparse.Namespace) -> None:
    from .sweep import LISTED_ENTRY, make_sweep

    lists = [word for word in options.words if LISTED_ENTRY.fullmatch(word)]
    files = [word for word in options.words if word not in lists]
    tables = [word for word in files if word.lower().endswith(".csv")]
    bases = [word for word in files if word not in tables]
    if len(bases) != 1 or len(tables) > 1:
        raise ResultError("sweep make takes one namelist, and a table (.csv) or lists as scene.seed=1,2,3; see --help")
    table = Path(tables[0]) if tables else None
    sweep = make_sweep(Path(bases[0]), options.output, _sweep_program(options), table, lists, options.cores)
    _say(f"{sweep.folder}: {len(sweep.runs)} runs; next: ./polydem sweep run {sweep.folder}")


def _sweep_run(options: argparse.Namespace) -> int:
    from .sweep import Sweep
    from .sweep_run import Runner, available_cores

    runs = Sweep(options.folder).choose(options.rows, options.names)
    runner = Runner(_sweep_program(options), options.cores or len(available_cores()), options.threads, _say)
    return runner.run(runs, options.retry)


def _sweep_collect(options: argparse.Namespace) -> None:
    from .sweep import Sweep
    from .sweep_collect import CSV_FILE, HDF5_FILE, collect_sweep

    collect_sweep(Sweep(options.folder), _say)
    _say(f"{options.folder / CSV_FILE}\n{options.folder / HDF5_FILE}")


def _sweep_program(options: argparse.Namespace) -> Path:
    if options.program is None:
        raise ResultError("--program is missing: call ./polydem sweep, which knows it")
    return options.program


def _scale(options: argparse.Namespace) -> None:
    from .exchange_model import Machine, fit_law, read_counts, scale_table, strip_table
    from .exchange_runs import MARGIN, SHAPE, read_run, read_runs, runs_tables, write_runs

    runs, files = [], []
    for path in options.counts:
        found = [read_run(path)] if path.is_dir() else read_runs(path)
        runs += found
        files += [] if found else [path]
    counts = [run.as_count() for run in runs if run.ranks > 1] + (read_counts(files) if files else [])
    if options.save:
        write_runs(runs, options.save)
    tables = runs_tables(runs) if runs else []
    tables.append(strip_table(counts))
    if options.body:
        machine = Machine(**{field.name: getattr(options, field.name) for field in fields(Machine)})
        shape = options.shape or (SHAPE if runs else "drum")
        law = fit_law(counts, shape, options.cut, options.margin or (MARGIN if shape == SHAPE else 0.2))
        tables += [scale_table(law, machine, bodies) for bodies in options.bodies]
    print("\n".join(table.document("markdown") for table in tables), end="")


def _say(line: str) -> None:
    print(printable(line), flush=True)


if __name__ == "__main__":
    sys.exit(main())
