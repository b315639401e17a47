"""The verb accuracy."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..base.result_file import ResultError
from . import arguments

#: Exit code if some quantity has no estimate, or no entries keep the tolerance
NOT_KNOWN = 1


def add_accuracy(verbs) -> None:
    """Add `accuracy` to the verbs of the command line."""
    accuracy = verbs.add_parser("accuracy")
    accuracy.set_defaults(action=_accuracy)
    accuracy.add_argument("namelist", type=Path, metavar="FILE.nml")
    accuracy.add_argument("--program", type=Path)
    accuracy.add_argument("--tolerance", type=arguments.positive, default=1e-2, metavar="X")
    accuracy.add_argument("--quantity", action="append", default=[], metavar="NAME")
    accuracy.add_argument("--duration", type=arguments.positive, metavar="T")
    accuracy.add_argument("--start-from", metavar="RESULT")
    accuracy.add_argument("--set", action="append", default=[], dest="entries", metavar="GROUP.KEY=VALUE")
    accuracy.add_argument("--output", type=Path, metavar="FOLDER")
    accuracy.add_argument("--cores", type=arguments.count, metavar="N")
    accuracy.add_argument("--threads", type=arguments.count, default=1, metavar="T")


def _accuracy(options: argparse.Namespace) -> int:
    from ..accuracy.report import lines_of, write_table
    from ..accuracy.study import Request, study_accuracy
    from ..sweep.runner import available_cores

    if options.program is None:
        raise ResultError("--program is missing: call ./polydem accuracy, which knows it")
    if not options.tolerance < 1.0:
        raise ResultError("--tolerance takes a number below 1, such as 1e-2")
    cores = options.cores or max(len(available_cores()), options.threads)
    request = Request(options.namelist, options.program, options.tolerance, tuple(options.quantity), options.duration,
                      options.start_from or "", tuple(options.entries), options.output, cores, options.threads)
    outcome = study_accuracy(request, arguments.say)
    for line in lines_of(outcome):
        arguments.say(line)
    arguments.say(str(write_table(outcome)))
    known = all(found.is_usable for found in outcome.estimates.values())
    return 0 if known and outcome.recommended is not None else NOT_KNOWN
