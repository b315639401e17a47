"""The verb `paper`: says what it will do, makes what is missing, writes the report."""

from __future__ import annotations

import argparse
import os
import signal
import time
from pathlib import Path

from polydem_post.base.result_file import ResultError
from polydem_post.command_line.arguments import say, words

from ..comparison.plan import QUICK_LIMIT, ROOT, make_plan


def add_paper(verbs) -> None:
    """Add the parser of the verb."""
    paper = verbs.add_parser("paper")
    paper.set_defaults(action=run_paper)
    mode = paper.add_mutually_exclusive_group()
    mode.add_argument("--quick", action="store_true")
    mode.add_argument("--full", action="store_true")
    paper.add_argument("--dry-run", action="store_true")
    paper.add_argument("--report-only", action="store_true")
    paper.add_argument("--output", type=Path, default=Path("results/paper"), metavar="DIR")
    paper.add_argument("--other", type=_folder, action="append", default=[], metavar="DIR")
    paper.add_argument("--publish", type=Path, metavar="DIR")
    paper.add_argument("--program", type=program, action="append", default=[], metavar="PREC=PATH")
    paper.add_argument("--verifier", type=Path)
    paper.add_argument("--overlaps", type=Path)
    paper.add_argument("--spent", type=float, metavar="S")
    paper.add_argument("--without", type=words, default=[], metavar="PIECES")
    paper.add_argument("--plan", type=Path, metavar="FILE")


def run_paper(options: argparse.Namespace) -> int:
    """Do what the options say; the exit code."""
    from ..comparison.publish import publish
    from ..comparison.report import collect, write_comparison  # needs much that other verbs do not
    from ..comparison.run import INTERRUPTED, Comparison, Tools

    began = time.monotonic() - (options.spent or 0.0)
    mode = "full" if options.full else "quick"
    tools = Tools({name: path.resolve() for name, path in options.program},
                  *(path and path.resolve() for path in (options.verifier, options.overlaps)))
    if "double" not in tools.programs:
        raise ResultError("--program double=PATH is missing: call ./polydem paper, which knows it")
    output, plan, published = (path and path.resolve() for path in (options.output, options.plan, options.publish))
    os.chdir(ROOT)  # namelists name their files from here
    folder = Path(os.path.relpath(output, ROOT)) / mode
    if any(letter.isspace() or letter == "'" for letter in str(folder)):
        raise ResultError(f"{folder}: namelists cannot name a folder with blanks or quotes; choose another --output")
    cores = len(os.sched_getaffinity(0))
    pieces = make_plan(mode, folder, cores, plan)
    unknown = set(options.without) - {piece.name for piece in pieces}
    if unknown:
        raise ResultError(f"--without {','.join(sorted(unknown))}: no such piece; the pieces are "
                          f"{', '.join(piece.name for piece in pieces)}")
    deadline = began + QUICK_LIMIT if mode == "quick" else None
    dry = options.dry_run or options.report_only
    comparison = Comparison(folder, mode, pieces, tools, deadline, say, dry, without=frozenset(options.without))
    comparison.open(as_it_is=options.report_only)
    if not options.report_only:
        signal.signal(signal.SIGTERM, _interrupt)
        comparison.announce()
        if options.dry_run:
            return 0
        try:
            comparison.run()
        except KeyboardInterrupt:
            say("interrupted; the same command goes on where it was")
            return INTERRUPTED
    contents = collect(comparison, options.other)
    page = write_comparison(comparison, contents, output)
    if published:
        say(f"{publish(contents, mode, output, published)}: published")
    say(f"{page}: written {time.monotonic() - began:.0f} s after the start")
    return 0


def program(text: str) -> tuple:
    """A precision and the program that computes in it, like double=PATH."""
    precision, equals, path = text.partition("=")
    if not equals or precision not in ("single", "double", "quadruple"):
        raise argparse.ArgumentTypeError(f"'{text}' is not like double=PATH")
    return precision, Path(path)


def _folder(text: str) -> Path:
    """A folder, from where the command was called."""
    return Path(text).resolve()


def _interrupt(*_) -> None:
    raise KeyboardInterrupt
