"""Command line: python -m polydem_post VERB, with a verb for each text in the folder help."""

from __future__ import annotations

import argparse
import difflib
import errno
import math
import os
import re
import shlex
import sys
import warnings
from dataclasses import fields, replace
from pathlib import Path

from . import __version__
from .comparison_verb import add_paper
from .data_verbs import add_data_verbs
from .emit import printable
from .picture_verbs import add_picture_verbs
from .result_file import is_refused, reason
from .table import FORMATS, timing_table
from .trajectory import ResultError, Trajectory

#: Exit codes of a result that cannot be used, and of a file that the system does not read or write, as in the program
INPUT_ERROR, NO_FILE = 2, 3

#: Exit code of an error that no reader foresaw; after Ctrl-C; if nobody reads the output any more, as in shells
UNFORESEEN, INTERRUPTED, CLOSED_PIPE = 1, 130, 141

#: Errors of a file system that takes no more; those of files that the package writes are known by their names before
NO_ROOM = errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO

#: A list of numbers that begins with a minus sign, which argparse takes for an option
NEGATIVE = re.compile(r"-[\d.][\d.eE+,:-]*")

#: Help texts of the verbs
HELP = Path(__file__).parent / "help"

#: Variable of the environment with the words that call this tool, set by the launcher
CALLED_AS = "POLYDEM_CALL"

#: Variable of the environment that shows where an unforeseen error happened
TRACEBACK = "POLYDEM_TRACEBACK"


def main(arguments: list[str] | None = None) -> int:
    """Do what the command line says; return the exit code."""
    options = _parser().parse_args(join_numbers(sys.argv[1:] if arguments is None else arguments))
    if options.only_parse:
        return 0
    warnings.showwarning = lambda message, *_: print(f"warning: {printable(str(message))}", file=sys.stderr)
    try:
        code = options.action(options) or 0
        sys.stdout.flush()
        return code
    except ResultError as error:
        print(f"error: {printable(str(error))}", file=sys.stderr)
        return NO_FILE if is_refused(error) else INPUT_ERROR
    except BrokenPipeError:
        return _end_quietly()
    except KeyboardInterrupt:
        print(f"{options.verb}: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:  # the last resort: an error that no reader foresaw is reported in a sentence, too
        if os.environ.get(TRACEBACK):
            raise
        if isinstance(error, OSError) and error.errno in NO_ROOM and error.filename is None:
            _end_quietly()
            print(f"error: standard output: cannot be written ({reason(error)})", file=sys.stderr)
            return NO_FILE
        if isinstance(error, OSError) and error.filename is not None and is_refused(error):
            print(f"error: {printable(str(error.filename))}: {reason(error)}", file=sys.stderr)
            return NO_FILE
        words = " ".join(str(error).split())
        print(f"error: {options.verb} cannot go on: {type(error).__name__}: {printable(words)[:300]}. A file may be "
              f"damaged; {TRACEBACK}=1 shows where", file=sys.stderr)
        return UNFORESEEN


def join_numbers(arguments: list[str]) -> list[str]:
    """Arguments in which a list of numbers that begins with a minus sign, like -1,1,0,2, belongs to its option."""
    joined: list[str] = []
    for word in arguments:
        if NEGATIVE.fullmatch(word) and joined and joined[-1].startswith("--") and "=" not in joined[-1]:
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _end_quietly() -> int:
    """Write no more; what to give back when the reader of a pipe, as in `| head -1`, has seen enough."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the rest is written when Python ends
    except (OSError, ValueError):
        pass
    return CLOSED_PIPE


class _Parser(argparse.ArgumentParser):
    """A parser whose help is a text of the folder help, which the launcher prints without Python."""

    def format_help(self) -> str:
        name, verb = [*self.prog.split(), ""][:2]
        if verb:
            return f"usage: {name} {help_text(verb)}"
        calls = [path.read_text(encoding="utf-8").splitlines()[:2] for path in sorted(HELP.glob("*.txt"))]
        lines = [f"  {call.replace(' [OPTIONS]', ''):<28} {meaning}" for call, meaning in calls]
        return "\n".join([f"usage: {name} VERB [ARGUMENTS]", "", *lines, ""])

    def format_usage(self) -> str:
        return self.format_help().splitlines()[0] + "\n"

    def parse_known_args(self, args=None, namespace=None):
        """Refuse what the verb does not know here, since the parser of all verbs could not name its options."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(self._about(unknown[0]))
        return found, unknown

    def _about(self, word: str) -> str:
        if not word.startswith("-"):
            return f"there is no place for the argument '{word}'"
        name = word.partition("=")[0]
        known = [option for option in self._option_string_actions if option.startswith("--")]
        near = difflib.get_close_matches(name, known, 1, cutoff=0.75)
        return f"there is no option {name}; " + (f"did you mean {near[0]}?" if near else f"see {self.prog} --help")


def help_text(verb: str) -> str:
    """What a verb does and takes; the first line is its call, the second one its meaning."""
    return (HELP / f"{verb}.txt").read_text(encoding="utf-8")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog=os.environ.get(CALLED_AS) or "polydem_post")
    parser.add_argument("--version", action="version", version=f"polydem_post {__version__}")
    # The launcher asks so before it builds for minutes.
    parser.add_argument("--only-parse", action="store_true")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    add_picture_verbs(verbs)
    table = verbs.add_parser("table")
    table.set_defaults(action=_table)
    table.add_argument("result", type=Path, metavar="RESULT")
    table.add_argument("--format", choices=FORMATS, default="text")

    tables = verbs.add_parser("tables")
    tables.set_defaults(action=_tables)
    tables.add_argument("folders", type=Path, nargs="+", metavar="BENCH")
    tables.add_argument("--output", type=Path, metavar="DIR")
    tables.add_argument("--no-figures", action="store_true")
    _add_cache(verbs)
    _add_costs(verbs)
    _add_workprecision(verbs)
    _add_sweep(verbs)
    _add_scale(verbs)
    add_data_verbs(verbs)
    add_paper(verbs, _program)
    return parser


def _add_cache(verbs) -> None:
    cache = verbs.add_parser("cache")
    cache.set_defaults(action=_cache)
    cache.add_argument("folder", type=Path, metavar="BENCH")
    cache.add_argument("--program", type=Path, required=True)
    cache.add_argument("--finders", type=_words, metavar="A,B,C")
    cache.add_argument("--scenes", type=_words, metavar="A,B,C")
    cache.add_argument("--steps", type=_numbers, default=[2, 12], metavar="FEW,MORE")
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
    work.add_argument("--program", type=_program, action="append", default=[], metavar="PREC=PATH")


def _program(text: str) -> tuple:
    precision, equals, path = text.partition("=")
    if not equals or precision not in ("single", "double", "quadruple"):
        raise argparse.ArgumentTypeError(f"'{text}' is not like double=PATH")
    return precision, Path(path)


def _add_sweep(verbs) -> None:
    sweep = verbs.add_parser("sweep")
    sweep.add_argument("--program", type=Path)
    steps = sweep.add_subparsers(dest="step", required=True, metavar="make|run|collect")

    make = steps.add_parser("make")
    make.set_defaults(action=_sweep_make)
    make.add_argument("words", nargs="+", metavar="WORD")
    make.add_argument("--output", type=Path, required=True, metavar="FOLDER")
    make.add_argument("--cores", type=_count, default=1, metavar="N")

    run = steps.add_parser("run")
    run.set_defaults(action=_sweep_run)
    run.add_argument("folder", type=Path, metavar="FOLDER")
    run.add_argument("--cores", type=_count, metavar="N")
    run.add_argument("--threads", type=_count, default=1, metavar="T")
    run.add_argument("--rows", type=_numbers, metavar="A,B,C")
    run.add_argument("--names", type=_words, metavar="A,B,C")
    run.add_argument("--retry", action="store_true")

    collect = steps.add_parser("collect")
    collect.set_defaults(action=_sweep_collect)
    collect.add_argument("folder", type=Path, metavar="FOLDER")


def _add_scale(verbs) -> None:
    scale = verbs.add_parser("scale")
    scale.set_defaults(action=_scale)
    scale.add_argument("counts", type=Path, nargs="+", metavar="COUNTS")
    scale.add_argument("--save", type=Path, metavar="FILE.csv")
    scale.add_argument("--bodies", type=_positives, default=[1e6], metavar="N,...")
    scale.add_argument("--body", type=_positive, metavar="S")
    for default, *names in ((2e-6, "latency"), (1e9, "bandwidth"), (0.5, "halo-body"), (1.1, "imbalance"),
                            (40.0, "interval"), (4.0, "redistribution"),
                            (300.0, "redistributed-bytes")):
        scale.add_argument(*(f"--{name}" for name in names), type=_positive, default=default, metavar="X",
                           dest=names[-1].replace("-", "_"))
    scale.add_argument("--sums", type=_count, default=2, metavar="K")
    scale.add_argument("--shape")
    scale.add_argument("--margin", type=_positive)


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
        raise argparse.ArgumentTypeError(f"'{text}' is not an integer from 1 on")
    return int(text)


def _numbers(text: str) -> list[int]:
    try:
        return [int(word) for word in text.split(",")]
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of integers like 0,10,-1") from error


def _words(text: str) -> list[str]:
    return [word for word in text.split(",") if word]


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
    _say(f"{sweep.folder}: {len(sweep.runs)} runs; next: ./polydem sweep run "
         f"{shlex.quote(str(sweep.folder))}")


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


def _say(line: str) -> None:
    print(printable(line), flush=True)


if __name__ == "__main__":
    sys.exit(main())
