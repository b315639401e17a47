"""The verb `rivals`: error against time beside other codes."""

from __future__ import annotations

import argparse
from pathlib import Path

from polydem_post.base.result_file import ResultError
from polydem_post.command_line.arguments import count, say, words

from .paper import program

#: Repeats of every point, in a whole and in a short study
REPEATS, QUICK_REPEATS = 3, 2


def add_rivals(verbs) -> None:
    """Add the parser of the verb."""
    rivals = verbs.add_parser("rivals")
    rivals.set_defaults(action=run_rivals)
    rivals.add_argument("problems", nargs="*", metavar="PROBLEM")
    rivals.add_argument("--quick", action="store_true")
    rivals.add_argument("--law", type=words, default=[], metavar="NAME,...")
    rivals.add_argument("--without", type=words, default=[], metavar="CODE,...")
    rivals.add_argument("--repeats", type=count, metavar="N")
    rivals.add_argument("--output", type=Path, default=Path("results/rivals"), metavar="DIR")
    rivals.add_argument("--report-only", action="store_true")
    rivals.add_argument("--publish", type=Path, metavar="DIR")
    rivals.add_argument("--environment", type=Path, default=Path("build/rivals"), metavar="DIR")
    rivals.add_argument("--program", type=program, action="append", default=[], metavar="double=PATH")


def run_rivals(options: argparse.Namespace) -> None:
    """Do what the options say."""
    from ..rivals.codes import RIVALS
    from ..rivals.problems import PROBLEMS
    from ..rivals.report import publish, write_rivals_report
    from ..rivals.study import Plan, Study

    _insist(options.problems, list(PROBLEMS), "problem")
    _insist(options.without, RIVALS, "other code")
    if not options.report_only:
        programs = dict(options.program)
        if "double" not in programs:
            raise ResultError("--program double=PATH is missing: call ./polydem rivals, which knows it")
        chosen = [each for name, each in PROBLEMS.items()
                  if name in (options.problems or PROBLEMS) and (options.problems or each.quick or not options.quick)]
        plan = Plan(chosen, options.law, options.without,
                    options.repeats or (QUICK_REPEATS if options.quick else REPEATS), options.quick)
        Study(options.output, plan, programs["double"].resolve(), options.environment, say).measure()
    page = write_rivals_report(options.output)[-1]
    print(publish(options.output, options.publish) if options.publish else page)


def _insist(given: list, known: list, what: str) -> None:
    """ResultError for a name that is unknown."""
    unknown = [name for name in given if name not in known]
    if unknown:
        raise ResultError(f"there is no {what} {', '.join(unknown)}; there are {', '.join(known)}")
