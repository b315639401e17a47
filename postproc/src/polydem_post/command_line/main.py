"""Command line: python -m polydem_post VERB, with a verb for each text in the folders of help texts.

The verbs of the laboratory (`polydem_lab`) are known by the names of their texts. This module alone of the package
knows that there is a laboratory, and imports it when one of its verbs is called.
"""

from __future__ import annotations

import argparse
import difflib
import errno
import os
import re
import sys
import warnings
from importlib import import_module
from pathlib import Path

from .. import __version__
from ..base import interrupts
from ..base.emit import printable
from ..base.result_file import ResultError, is_refused, reason
from .accuracy_verb import add_accuracy
from .data_verbs import add_data_verbs
from .picture_verbs import add_picture_verbs
from .sweep_verb import add_sweep

#: Exit codes of a result that cannot be used, and of a file that the system does not read or write, as in the program
INPUT_ERROR, NO_FILE = 2, 3

#: Exit code of an error that no reader foresaw; after Ctrl-C; if nobody reads the output any more, as in shells
UNFORESEEN, INTERRUPTED, CLOSED_PIPE = 1, 130, 141

#: Errors of a file system that takes no more; those of files that the package writes are known by their names before
NO_ROOM = errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO

#: A list of numbers that begins with a minus sign, which argparse takes for an option
NEGATIVE = re.compile(r"-[\d.][\d.eE+,:-]*")

#: The verbs of the laboratory
LAB = "polydem_lab.command_line"

#: Help texts of the verbs, here and in the laboratory, which lies beside this package
HELP = Path(__file__).parent / "help"
LAB_HELP = Path(__file__).parents[2].joinpath(*LAB.split(".")) / "help"

#: Variable of the environment with the words that call this tool, set by the launcher
CALLED_AS = "POLYDEM_CALL"

#: Variable of the environment that shows where an unforeseen error happened
TRACEBACK = "POLYDEM_TRACEBACK"


def main(arguments: list[str] | None = None) -> int:
    """Do what the command line says; return the exit code."""
    words = join_numbers(sys.argv[1:] if arguments is None else arguments)
    options = _parser(words).parse_args(words)
    if options.only_parse:
        return 0
    warnings.showwarning = lambda message, *_: print(f"warning: {printable(str(message))}", file=sys.stderr)
    try:
        interrupts.raise_exceptions()
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
        said = " ".join(str(error).split())
        print(f"error: {options.verb} cannot go on: {type(error).__name__}: {printable(said)[:300]}. A file may be "
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
    """A parser whose help is the text of a verb, which the launcher prints without Python."""

    def format_help(self) -> str:
        name, verb = [*self.prog.split(), ""][:2]
        if verb:
            return f"usage: {name} {help_text(verb)}"
        calls = [path.read_text(encoding="utf-8").splitlines()[:2] for path in help_files().values()]
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


def help_files() -> dict[str, Path]:
    """The help text of each verb, in the order of their names."""
    return {path.stem: path for path in sorted([*HELP.glob("*.txt"), *LAB_HELP.glob("*.txt")], key=lambda p: p.stem)}


def help_text(verb: str) -> str:
    """What a verb does and takes; the first line is its call, the second one its meaning."""
    return help_files()[verb].read_text(encoding="utf-8")


def _parser(words: list[str]) -> argparse.ArgumentParser:
    """The parser of a command line; it knows options of the laboratory where one of its verbs is among the words."""
    parser = _Parser(prog=os.environ.get(CALLED_AS) or "polydem_post")
    parser.add_argument("--version", action="version", version=f"polydem_post {__version__}")
    # The launcher asks so before it builds for minutes.
    parser.add_argument("--only-parse", action="store_true")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    add_picture_verbs(verbs)
    add_data_verbs(verbs)
    add_sweep(verbs)
    add_accuracy(verbs)
    laboratory = sorted(path.stem for path in LAB_HELP.glob("*.txt"))
    if not set(laboratory).isdisjoint(words):
        import_module(LAB).add_verbs(verbs)
    else:
        for verb in laboratory:
            verbs.add_parser(verb)
    return parser
